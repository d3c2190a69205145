# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A fit started from the wrong mode or step still ends at the right one."""

import numpy as np
import pytest
from diagnosis_cells import HOME, all_but, effect, known_scale, tiny

from weld_twin_core import Beliefs, JointMotion, Measurements, Recording, Twin, diagnose, load
from weld_twin_core.diagnosis.algebra.fit import fit
from weld_twin_core.diagnosis.algebra.problem import Problem
from weld_twin_core.diagnosis.algebra.starts import started
from weld_twin_core.diagnosis.algebra.workspace import Workspace
from weld_twin_core.diagnosis.hypotheses.library import build


@pytest.mark.parametrize('frequency', [3.0, 9.0])
@pytest.mark.parametrize('start', [1.5, 5.5, 20.0])
def test_a_mode_is_found_from_any_frequency(frequency, start):
    true = effect('vibration', joint='elbow_joint', frequency=frequency, damping=0.03, gain=3.0)
    problem, model = tiny((true,), static=False, count=200)
    scale = known_scale(problem)
    wrong = effect('vibration', joint='elbow_joint', frequency=start, damping=0.05, gain=0.1)
    best = started(problem, model, scale, wrong)
    (found,) = fit(problem, model.with_found((best,)), scale).model.found
    assert found.frequency == pytest.approx(frequency, rel=0.05)
    assert found.gain == pytest.approx(3.0, rel=0.1)


@pytest.mark.parametrize('step', [3.1e-4, 1.7e-3])
def test_a_step_is_found_so_finely_that_stairs_stay_in_phase_far_from_zero(step):
    true = effect('quantization', joint='elbow_joint', step=step)
    problem, model = tiny((true,), static=False, count=400)
    q = problem.recordings[0].joints.q[:, 2]
    near = 1.0 / (1.0 / step + 0.3 / np.ptp(q))
    wrong = effect('quantization', joint='elbow_joint', step=near)
    best = started(problem, model, known_scale(problem), wrong)
    # a hundredth of a stair at the largest position
    assert abs(best.step - step) * np.abs(q).max() / step < 0.01 * step


def test_stairs_that_are_counted_from_anywhere_are_found():
    true = effect('quantization', joint='elbow_joint', step=1.7e-3, phase=0.4)
    problem, model = tiny((true,), static=False, count=400)
    q = problem.recordings[0].joints.q[:, 2]
    near = effect('quantization', joint='elbow_joint', step=1.7e-3 * (1 + 1e-4), phase=0.1)
    best = started(problem, model, known_scale(problem), near)
    ends = np.array([q.min(), q.max()])
    assert np.abs(ends / best.step - best.phase - (ends / 1.7e-3 - 0.4)).max() % 1.0 < 0.02


def test_an_effect_whose_fit_has_one_optimum_starts_where_it_is():
    offset = effect('joint_offset', joint='elbow_joint', offset=1e-3)
    problem, model = tiny((offset,))
    assert started(problem, model, known_scale(problem), offset) is offset


def test_a_joint_at_rest_in_the_first_recording_hides_no_stairs_of_the_second():
    robot, noise = load('ur5'), np.random.default_rng(5)
    stairs = effect('quantization', joint='elbow_joint', step=1.3e-3)
    t = np.arange(0.0, 15.0, 0.06)
    both = np.array(HOME[:6]) + 0.4 * np.sin(np.outer(t, 0.5 + 0.13 * np.arange(6)))
    still = both.copy()
    still[:, 2] = HOME[2]
    recordings = []
    for name, q in (('still', still), ('moving', both)):
        run = Recording(name, JointMotion(t, q))
        seen = Twin(robot, [stairs]).poses(run).position
        seen = seen + noise.normal(scale=2e-5, size=seen.shape)
        recordings.append(run.with_measured(Measurements(t, seen)))
    others = all_but('quantization', 'backlash', 'joint_offset')
    found = diagnose(recordings, robot, exclude=others, experiment=False)
    assert [(e.effect.name, e.effect.joint) for e in found.effects] == [
        ('quantization', 'elbow_joint')
    ]
    assert found.effects[0].effect.step == pytest.approx(1.3e-3, rel=1e-3)


def test_wide_play_that_the_load_moves_leaves_no_curve_for_springs_of_its_joint():
    robot, rng = load('ur5'), np.random.default_rng(5)
    low, high = [-2.0, -2.4, -1.8, -2.5, -2.2, -3.0], [2.0, -0.7, 1.8, -0.5, 2.2, 3.0]
    q = rng.uniform(low, high, (60, 6))
    stations = Recording('stations', JointMotion(np.arange(60.0), q, static=True))
    # the shoulder bears 42 N m at most; a search starts from 1.3 and from 6.3
    play = effect('loaded_play', joint='shoulder_lift_joint', width=2.2e-3, torque=2.9)
    seen = Twin(robot, [play]).poses(stations).position
    seen = seen + rng.normal(scale=2e-5, size=seen.shape)
    springs = all_but('loaded_play', 'stiffening', 'joint_compliance', 'joint_offset')
    measured = stations.with_measured(Measurements(stations.joints.t, seen))
    (found,) = diagnose(measured, robot, exclude=springs, experiment=False).effects
    assert found.effect.site == 'shoulder_lift_joint'
    assert found.effect.width == pytest.approx(2.2e-3, rel=0.01)


@pytest.mark.parametrize('kind', ['joint_compliance', 'loaded_play'])
def test_a_joint_at_rest_gives_way_as_others_change_its_load(kind):
    robot, t = load('ur5'), np.arange(0.0, 20.0, 0.04)
    q = np.tile(HOME[:6], (t.size, 1))
    q[:, 1] += 1.2 * np.sin(0.5 * t)
    run = Recording('swing', JointMotion(t, q))
    sizes = {'joint_compliance': {'compliance': 3e-5}, 'loaded_play': {'width': 2e-3}}
    true = effect(kind, joint='elbow_joint', **sizes[kind])
    seen = Twin(robot, [true]).poses(run).position
    seen = seen + np.random.default_rng(5).normal(scale=2e-5, size=seen.shape)
    found = diagnose(run.with_measured(Measurements(t, seen)), robot, experiment=False)
    assert [(e.effect.name, e.effect.joint) for e in found.effects] == [(kind, 'elbow_joint')]


def test_what_is_left_alone_at_its_joint_is_searched_for_anew():
    """Beside a spring that stiffens, play may stand for what the other does not."""
    problem, model = tiny(count=60)
    still = problem.recordings[0]
    play = effect('loaded_play', joint='shoulder_lift_joint', width=2.2e-3, torque=2.9)
    seen = Twin(model.robot, [play]).poses(still).position
    seen = seen + np.random.default_rng(5).normal(scale=2e-5, size=seen.shape)
    problem = Problem((still.with_measured(Measurements(still.joints.t, seen)),))
    wrong = effect('loaded_play', joint='shoulder_lift_joint', width=1e-4, torque=30.0)
    spring = effect('stiffening', joint='shoulder_lift_joint', compliance=1e-4, torque=3.0)
    scale = known_scale(problem)
    work = Workspace(problem, scale, build(problem, model, scale), Beliefs(), 1.0)
    now = work.fitted(model.with_found((wrong, spring)))
    (left,) = work.without(now, 1).model.found
    assert left.torque == pytest.approx(2.9, rel=0.1)
