# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Draws of tolerances: distributions, the fast model against the exact twin, the stack."""

import numpy as np
import pytest
from scipy import stats

from weld_twin_core import DataError, ModelError, default_seam
from weld_twin_core.effects import associative_scan
from weld_twin_core.effects.backlash import Backlash
from weld_twin_core.effects.geometry import JointOffset
from weld_twin_core.sensitivity import (
    Distribution,
    Outcomes,
    WeldTolerance,
    default_tolerances,
    draws_at,
    expected_deviation,
    model,
    planned_study,
    probabilities,
    scaled,
    tolerance_stack,
    tolerances_from_list,
)
from weld_twin_core.sensitivity.evaluate import exact_deviations
from weld_twin_core.sensitivity.seam_study import outcomes
from weld_twin_core.sensitivity.trajectory_advice import rms_over_arc


@pytest.fixture(scope='module')
def study(ur5):
    return planned_study(ur5, default_seam(ur5, 'arc'), 'aggressive', points=80)


@pytest.mark.parametrize(
    ('kind', 'numbers', 'frozen'),
    [
        ('normal', (1.0, 2.0), stats.norm(1.0, 2.0)),
        ('uniform', (-1.0, 3.0), stats.uniform(-1.0, 4.0)),
        ('triangular', (1.0, 2.0, 5.0), stats.triang(0.25, 1.0, 4.0)),
        ('lognormal', (2.0, 0.5), stats.lognorm(0.5, scale=2.0)),
    ],
)
def test_distributions_are_those_of_scipy(kind, numbers, frozen):
    law = Distribution(kind, numbers)
    unit = np.linspace(0.01, 0.99, 50)
    np.testing.assert_allclose(law.values(unit), frozen.ppf(unit), rtol=1e-9)
    assert law.mean == pytest.approx(frozen.mean(), rel=1e-3)
    assert law.std == pytest.approx(frozen.std(), rel=2e-2)


def test_a_distribution_is_cut_off_at_the_bounds_of_its_parameter():
    law = Distribution('normal', (1.0, 1.0), lower=0.0)
    wanted = stats.truncnorm(-1.0, np.inf, loc=1.0)
    unit = np.linspace(0.01, 0.99, 20)
    np.testing.assert_allclose(law.values(unit), wanted.ppf(unit), rtol=1e-9)
    with pytest.raises(ModelError, match='outside the bounds'):
        Distribution('uniform', (-2.0, -1.0), lower=0.0)


@pytest.mark.parametrize(
    ('entry', 'message'),
    [
        ({'effect': 'nothing'}, 'unknown effect'),
        ({'effect': 'backlash', 'std': -1.0}, 'does not scatter'),
        ({'effect': 'backlash', 'parameter': 'gap'}, 'no such parameter'),
        ({'effect': 'backlash', 'joint': 'seventh'}, "no joint 'seventh'"),
        ({'effect': 'backlash', 'distribution': 'cauchy'}, 'must be one of'),
        ({'effect': 'backlash', 'distribution': 'uniform', 'low': 0.0}, 'needs the key'),
        ({'effect': 'base_pose', 'joint': 'elbow_joint'}, 'takes no joint'),
    ],
)
def test_a_wrong_tolerance_is_refused_with_its_number(ur5, entry, message):
    with pytest.raises(ModelError, match=f'tolerance 1: .*{message}'):
        tolerances_from_list([{'effect': 'joint_offset'}, entry], ur5)


def test_tolerances_read_back_from_their_entries(ur5):
    tolerances = default_tolerances(ur5)
    again = tolerances_from_list([t.to_mapping() for t in tolerances], ur5)
    assert again == tolerances


def test_a_later_entry_replaces_an_earlier_one(ur5):
    found = tolerances_from_list(
        [
            {'effect': 'joint_offset', 'std': 1e-3},
            {'effect': 'joint_offset', 'joint': 'elbow_joint', 'std': 2e-3},
        ],
        ur5,
    )
    assert len(found) == 6
    assert {t.joint: t.distribution.numbers[1] for t in found}['elbow_joint'] == 2e-3


@pytest.mark.parametrize(
    'families',
    [
        ('joint_offset', 'link_length', 'link_twist', 'base_pose'),
        ('joint_offset', 'backlash', 'tool_pose'),
        ('servo_lag', 'backlash', 'gear_ratio'),
    ],
)
def test_fast_model_agrees_with_the_exact_twin_run_by_run(study, families):
    tolerances = default_tolerances(study.robot, families)
    draws = draws_at(tolerances, np.random.default_rng(3).random((50, len(tolerances))))
    fast = model(study, tolerances)
    assert fast.expansion is not None
    exact = model(study, tolerances, exact=True)
    for found, wanted in zip(fast(draws), exact(draws), strict=True):
        np.testing.assert_allclose(found, wanted, rtol=1e-3)
    assert fast.error < 1e-3


def test_what_the_expansion_cannot_carry_or_is_too_wide_for_it_is_run_exactly(study):
    tolerances = default_tolerances(study.robot, ('transmission_ripple',))
    assert model(study, tolerances).expansion is None
    wide = default_tolerances(study.robot, ('joint_offset', 'link_length'), 300.0)
    assert model(study, wide).expansion is None


def test_fast_model_counts_from_the_known_effects(ur5, study):
    known = (JointOffset('elbow_joint', 2e-3), Backlash('wrist_1_joint', 1e-3))
    shifted = planned_study(ur5, default_seam(ur5, 'arc'), 'aggressive', points=80, known=known)
    tolerances = default_tolerances(ur5, ('joint_offset', 'backlash'))
    draws = draws_at(tolerances, np.random.default_rng(5).random((20, len(tolerances))))
    exact = model(shifted, tolerances, exact=True)(draws)
    np.testing.assert_allclose(model(shifted, tolerances)(draws).max_m, exact.max_m, rtol=1e-3)


def test_outcomes_are_those_of_a_hand_written_run():
    off = np.array([[[3e-3, 0.0]], [[-4e-3, 1e-3]], [[0.0, -2e-3]]])
    found = outcomes(off, 0.5)
    assert found.max_m[0] == pytest.approx(5e-3)
    assert found.d_norm[0] == pytest.approx(1e-2)
    assert found.across_m[0] == pytest.approx(4e-3)
    assert found.stickout_m[0] == pytest.approx(2e-3)
    assert found.rms_m[0] == pytest.approx(np.sqrt((25e-6 + 5e-6) / 2.0))


def test_expected_deviation_is_the_root_mean_square_of_many_runs(study):
    tolerances = default_tolerances(study.robot, ('joint_offset', 'link_length', 'base_pose'))
    draws = draws_at(tolerances, np.random.default_rng(0).random((4000, len(tolerances))))
    square = (exact_deviations(study, tolerances, draws) ** 2).sum(axis=-1).mean(axis=0)
    steps = np.abs(np.diff(study.s))
    mean = (0.5 * (square[1:] + square[:-1]) * steps).sum() / steps.sum()
    expected = rms_over_arc(study, expected_deviation(study, tolerances))
    assert expected == pytest.approx(np.sqrt(mean), rel=0.02)


def test_stack_counts_across_and_stickout_apart():
    across, stickout = np.linspace(0.0, 1e-3, 100), np.full(100, 2e-3)
    runs = Outcomes(across, across, across, across, stickout)
    found = tolerance_stack(runs, WeldTolerance(5e-4, 1e-3))
    assert found.inside_across.value == 0.5
    assert found.inside_stickout.value == found.inside_both.value == 0.0
    wanted = stats.binomtest(50, 100).proportion_ci(0.95, 'exact')
    assert (found.inside_across.low, found.inside_across.high) == pytest.approx(wanted)
    median = found.percentiles['max_m'][2]
    assert median[0] == pytest.approx(5e-4)
    for told, percent in zip(found.percentiles['max_m'], (5, 25, 50, 75, 90, 95, 99), strict=True):
        assert told[0] == pytest.approx(np.percentile(across, percent))
        low, high = stats.binom.ppf([0.025, 0.975], 100, percent / 100.0).astype(int)
        assert told[1:].tolist() == [across[low], across[min(high, 99)]]


def test_halved_tolerances_halve_the_deviation_of_a_linear_stack(study):
    tolerances = default_tolerances(study.robot, ('link_length',))
    unit = probabilities(200, len(tolerances))
    full = model(study, tolerances).at_probabilities(unit)
    half = model(study, scaled(tolerances, {'link_length': 0.5})).at_probabilities(unit)
    np.testing.assert_allclose(half.max_m, 0.5 * full.max_m, rtol=1e-3)


def test_a_stack_refuses_results_that_are_not_numbers():
    column = np.ones(30)
    bad = column.copy()
    bad[4] = np.nan
    with pytest.raises(DataError, match='run 4'):
        tolerance_stack(Outcomes(column, column, bad, column, column))


def test_play_of_many_gaps_equals_play_of_each():
    rng = np.random.default_rng(0)
    for count in (1, 2, 3, 90):
        q = np.round(np.cumsum(rng.normal(size=count)), 1)
        width = np.concatenate([[0.0], rng.uniform(0.0, 3.0, 6)])[:, None]
        start = rng.normal(scale=2.0, size=7)
        each = [associative_scan.play(q, w[0], s) for w, s in zip(width, start, strict=True)]
        np.testing.assert_array_equal(associative_scan.play(q, width, start), each)
