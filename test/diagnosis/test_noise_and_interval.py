# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Noise, intervals and standard errors against the laws of what was drawn."""

from dataclasses import replace
from itertools import accumulate

import numpy as np
import pytest
from diagnosis_cells import SIGMA, effect, known_scale, tiny

import weld_twin_core as wt
from weld_twin_core.diagnosis.algebra.fit import fit
from weld_twin_core.diagnosis.algebra.noise_floor import WIDEST, noise_floor
from weld_twin_core.diagnosis.algebra.problem import Problem
from weld_twin_core.diagnosis.answer.named_effects import standard_errors
from weld_twin_core.diagnosis.unseen.held_out_shrink import Judged, _of_others, ratio_interval
from weld_twin_core.recording import JointMotion, Measurements, Recording


def moving(count, sigma=None):
    t = np.arange(count) / 50.0
    measured = Measurements(t, np.zeros((count, 3)), sigma=sigma)
    return Recording('moving', JointMotion(t, np.zeros((count, 6))), measured)


def resting(q):
    t = np.arange(len(q), dtype=float)
    measured = Measurements(t, np.zeros((len(q), 3)))
    return Recording('resting', JointMotion(t, q, static=True), measured)


def white(count, sigma=SIGMA, seed=0):
    return np.random.default_rng(seed).normal(scale=sigma, size=(3, count))


def test_in_motion_third_differences_see_the_noise_through_a_smooth_gap_of_ten_times_its_size():
    t = np.arange(4000) / 50.0
    gap = 10.0 * SIGMA * np.sin(2.0 * np.pi * 0.5 * t)
    sigma, independent = noise_floor(Problem((moving(4000),)), [white(4000) + gap])
    assert independent
    assert sigma == pytest.approx(SIGMA, rel=0.05)


def test_gross_errors_do_not_raise_the_floor():
    off = white(4000)
    off[:, ::100] += 2e-3
    sigma, _ = noise_floor(Problem((moving(4000),)), [off])
    assert sigma == pytest.approx(SIGMA, rel=0.15)


def test_at_rest_repeated_stations_see_the_noise_whatever_the_gap():
    rng = np.random.default_rng(2)
    places = np.repeat(rng.uniform(-2.0, 2.0, (400, 6)), 3, axis=0)
    gap = np.repeat(rng.normal(scale=2e-4, size=(3, 400)), 3, axis=1)
    order = rng.permutation(1200)
    problem = Problem((resting(places[order]),))
    sigma, independent = noise_floor(problem, [(white(1200) + gap)[:, order]])
    assert independent
    assert sigma == pytest.approx(SIGMA, rel=0.06)


def test_noise_read_off_a_misfit_is_no_wider_than_an_instrument_has_and_never_than_the_gap():
    problem = Problem((resting(np.random.default_rng(3).uniform(-2.0, 2.0, (150, 6))),))
    heap = np.where(np.arange(150) < 75, 8e-3, -8e-3) * np.ones((3, 1))
    for misfit in (heap, white(150, 8e-3)):
        floor = noise_floor(problem, [misfit])
        assert not floor.independent and floor.sigma <= WIDEST
    small = 0.02 * heap
    assert noise_floor(problem, [small]).sigma <= np.sqrt((small**2).mean())


def test_without_repeats_the_floor_at_rest_is_no_more_than_what_the_model_leaves():
    q = np.random.default_rng(3).uniform(-2.0, 2.0, (1500, 6))
    sigma, independent = noise_floor(Problem((resting(q),)), [white(1500)])
    assert not independent
    assert sigma == pytest.approx(SIGMA, rel=0.05)


def test_what_stations_have_in_common_with_the_next_is_no_noise():
    q = np.random.default_rng(3).uniform(-2.0, 2.0, (60, 6))
    stepped = np.where(np.arange(60) // 6 % 2, 4.0 * SIGMA, -4.0 * SIGMA)
    sigma, independent = noise_floor(Problem((resting(q),)), [white(60) + stepped])
    assert not independent
    assert sigma == pytest.approx(SIGMA, rel=0.25)


def test_the_instruments_own_figure_serves_where_nothing_was_repeated():
    recording = resting(np.random.default_rng(4).uniform(-2.0, 2.0, (500, 6)))
    said = replace(recording.measured, sigma=np.full(500, 3e-5))
    problem = Problem((recording.with_measured(said),))
    sigma, independent = noise_floor(problem, [white(500, 2e-4)])
    assert independent
    assert sigma == pytest.approx(3e-5)


def given(left, count, said):
    q = np.random.default_rng(4).uniform(-2.0, 2.0, (count, 6))
    measured = replace(resting(q).measured, sigma=np.full(count, said))
    return noise_floor(Problem((resting(q).with_measured(measured),)), [white(count, left)]).sigma


def test_a_figure_that_is_given_gives_way_only_to_what_is_surely_less():
    # The spread of 72 numbers is good to 14 %.
    assert given(2.3e-5, 24, 3e-5) == 3e-5
    assert given(2.3e-5, 2400, 3e-5) == pytest.approx(2.3e-5, rel=0.05)
    assert given(0.6e-5, 24, 3e-5) < 1e-5


def test_recordings_count_by_their_samples():
    problem = Problem((moving(6000), moving(2000)))
    sigma, _ = noise_floor(problem, [white(6000), white(2000, 3.0 * SIGMA, seed=1)])
    assert sigma == pytest.approx(SIGMA * (0.75 + 3.0 * 0.25), rel=0.05)


def errors(rng, wander):
    """Return squared errors before (RMS 1) and after (RMS 0.3), and their stretches."""
    labels = np.repeat(np.arange(8), 60)
    levels = np.exp(wander * rng.normal(size=(2, 8)))[:, labels]
    levels /= np.exp(0.5 * wander**2)
    squares = (rng.normal(size=(2, 3, labels.size)) ** 2).mean(axis=1)
    return squares[0] * levels[0], 0.09 * squares[1] * levels[1], labels


@pytest.mark.parametrize('wander', [0.0, 0.4])
def test_the_interval_of_the_shrink_holds_the_truth_about_95_times_in_100(wander):
    rng = np.random.default_rng(5)
    held = []
    for _ in range(600):
        _, (low, high) = ratio_interval(*errors(rng, wander))
        held.append(low < 0.3 < high)
    assert 0.92 < np.mean(held) < 0.985


def test_the_ratio_is_that_of_the_root_mean_squares():
    before, after = np.array([4.0, 12.0, 8.0, 8.0]), np.array([1.0, 3.0, 0.0, 4.0])
    ratio, (low, high) = ratio_interval(before, after, np.arange(4))
    assert ratio == pytest.approx(0.5)
    assert low < ratio < high


def test_motions_that_differ_widen_the_interval_by_their_distance():
    before, after = np.full(80, 4.0), np.full(80, 1.0)
    labels = np.arange(80) // 10
    ratio, (low, high) = ratio_interval(before, after, labels, elsewhere=0.5 * np.exp(0.2))
    assert ratio == pytest.approx(0.5)
    reach = 2.3646 * 0.2  # Student's t of seven
    assert (low, high) == pytest.approx((0.5 * np.exp(-reach), 0.5 * np.exp(reach)), rel=1e-4)


def test_two_stretches_still_give_an_interval():
    ratio, (low, high) = ratio_interval(np.full(50, 4.0), np.full(50, 1.0), np.arange(50) // 25)
    assert ratio == pytest.approx(0.5)
    assert 0.0 <= low < ratio < high


@pytest.mark.parametrize('among', [0, 1, 8])
def test_what_one_more_motion_shows_varies_about_what_all_show_besides_what_these_do(among):
    judged = Judged((1.0, 0.5), 0.5, (0.4, 0.7), 8), Judged((1.0, 0.6), 0.6, (0.55, 0.8), 8)
    low, high = _of_others(judged, among)
    times = np.sqrt(1.0 + among)
    assert np.log(0.5 / low) == pytest.approx(times * np.log(0.5 / 0.4))
    ends = 0.5 * (0.7 / 0.5) ** times, 0.6 * (0.8 / 0.6) ** times
    assert high == pytest.approx(max(ends))
    # Nothing is left of a gap: the interval stays as it is.
    assert _of_others([Judged((1.0, 0.0), 0.0, (0.0, 0.1), 8)], among) == (0.0, 0.1)


OFFSET = effect('joint_offset', joint='elbow_joint', offset=8e-4)
RUNS = 60


def errors_told(problem, model, share=1.0):
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
        found, (std,) = errors_told(problem, start)
        out.append((found.found[0].offset - OFFSET.offset) / std['offset'])
    return np.array(out)


def test_a_standard_error_is_one_in_white_noise_more_where_it_hangs_together_or_none():
    # the mean square of 60 normal numbers lies below 1.5 all but one time in a hundred; the
    # larger of two estimates of one variance makes it smaller
    assert 0.45 < np.mean(deviations(0.0) ** 2) < 1.5
    # rows counted as independent would make this (1 + 0.8) / (1 - 0.8) = 9
    assert np.mean(deviations(0.8) ** 2) < 2.5
    true = effect('tool_pose', xyz=[1e-3, 0.0, 0.0], rotvec=[0.0, 0.0, 0.0])
    problem, model = tiny((true,), turned=False)
    _, (std,) = errors_told(problem, model.with_found((true,)))
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
    _, (std,) = errors_told(problem, model.with_found((true,)))
    assert (std['frequency'] > 1.0) is slow


def test_a_spring_that_is_named_for_sure_is_known_to_more_than_its_own_size():
    # What every arm has a little of can stand in for it, but so much of it at once is no likelier.
    robot = wt.load('ur5')
    motion = wt.plan(robot, wt.default_seam(robot, 'polyline'), 'smooth', rate_hz=25.0).motion
    play = wt.effects.Backlash('shoulder_pan_joint', width=8e-4)
    spring = wt.effects.JointCompliance('shoulder_lift_joint', compliance=8e-6)
    commanded = wt.Recording('seam', motion)
    real = wt.Twin(robot, [play, spring]).poses(commanded)
    noise = np.random.default_rng(1).normal(scale=2e-5, size=real.position.shape)
    seen = wt.Measurements(motion.t, real.position + noise, real.rotation)
    told = wt.diagnose(commanded.with_measured(seen), robot, experiment=False)
    (found,) = (e for e in told.effects if e.effect.name == 'joint_compliance')
    assert abs(found.effect.compliance - 8e-6) < 2.0 * found.std['compliance'] < 4e-6
