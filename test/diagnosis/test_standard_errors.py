# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Standard errors cover the truth where residuals hang together, and say so where none are."""

from dataclasses import replace
from itertools import accumulate

import numpy as np
import pytest
from diagnosis_cells import SIGMA, effect, known_scale, tiny

import weld_twin_core as wt
from weld_twin_core.diagnosis.algebra.fit import fit
from weld_twin_core.diagnosis.answer.named_effects import standard_errors

OFFSET = effect('joint_offset', joint='elbow_joint', offset=8e-4)
RUNS = 60


def errors(problem, model, share=1.0):
    scale = known_scale(problem)
    found = fit(problem, model, scale).model
    return found, standard_errors(problem, found, scale, np.zeros(0), share)


def deviations(hang):
    """Return errors of an offset over their standard errors, in noise that hangs together."""
    out = []
    for seed in range(RUNS):
        problem, model = tiny((OFFSET,), seed, count=240, static=False, turned=False, noise=0.0)
        white = np.random.default_rng(seed + 1000).normal(size=(240, 3))
        hung = np.array(list(accumulate(white, lambda last, new: hang * last + new)))
        noise = SIGMA * np.sqrt(1.0 - hang**2) * hung
        recording = problem.recordings[0]
        seen = recording.measured
        spoilt = recording.with_measured(replace(seen, position=seen.position + noise))
        problem = replace(problem, recordings=(spoilt,))
        start = model.with_found((effect('joint_offset', joint='elbow_joint'),))
        found, (std,) = errors(problem, start)
        out.append((found.found[0].offset - OFFSET.offset) / std['offset'])
    return np.array(out)


def test_in_white_noise_a_standard_error_is_one():
    # the mean square of 60 normal numbers lies below 1.5 all but one time in a hundred; the
    # larger of two estimates of one variance makes it smaller
    assert 0.45 < np.mean(deviations(0.0) ** 2) < 1.5


def test_noise_that_hangs_together_within_stretches_makes_errors_larger():
    # rows counted as independent would make this (1 + 0.8) / (1 - 0.8) = 9
    assert np.mean(deviations(0.8) ** 2) < 2.5


def test_what_the_data_do_not_show_has_no_standard_error():
    true = effect('tool_pose', xyz=[1e-3, 0.0, 0.0], rotvec=[0.0, 0.0, 0.0])
    problem, model = tiny((true,), turned=False)
    _, (std,) = errors(problem, model.with_found((true,)))
    assert set(std) == {'xyz'} and all(value > 0.0 for value in std['xyz'])


def test_a_parameter_on_its_bound_has_no_standard_error():
    true = effect('backlash', joint='elbow_joint', width=0.0)
    problem, model = tiny((true,), static=False)
    found = model.with_found((true, OFFSET.fit.with_coordinates(np.array([1e-9]))))
    scale = known_scale(problem)
    play, offset = standard_errors(problem, found, scale, np.zeros(0), 1.0)
    assert play == {} and offset['offset'] > 0.0


@pytest.mark.parametrize('slow', [False, True])
def test_modes_that_fit_as_well_widen_the_error_of_a_frequency(slow):
    # An arm that moves far more slowly than its mode shows gain over frequency squared only.
    gain = 0.05 if slow else 2.0
    true = effect('vibration', joint='shoulder_pan_joint', frequency=4.0, damping=0.05, gain=gain)
    problem, model = tiny((true,), static=False, count=120)
    _, (std,) = errors(problem, model.with_found((true,)))
    assert (std['frequency'] > 1.0) is slow


def test_a_spring_that_is_named_for_sure_is_known_to_more_than_its_own_size():
    # What every arm has a little of can stand in for it, but so much of it at once is no likelier.
    robot = wt.load('ur5')
    motion = wt.plan(robot, wt.default_seam(robot, 'polyline'), 'smooth', rate_hz=50.0).motion
    play = wt.effects.Backlash('shoulder_pan_joint', width=8e-4)
    spring = wt.effects.JointCompliance('shoulder_lift_joint', compliance=8e-6)
    commanded = wt.Recording('seam', motion)
    real = wt.Twin(robot, [play, spring]).poses(commanded)
    noise = np.random.default_rng(1).normal(scale=2e-5, size=real.position.shape)
    seen = wt.Measurements(motion.t, real.position + noise, real.rotation)
    told = wt.diagnose(commanded.with_measured(seen), robot, experiment=False)
    (found,) = (e for e in told.effects if e.effect.name == 'joint_compliance')
    assert abs(found.effect.compliance - 8e-6) < 2.0 * found.std['compliance'] < 4e-6
