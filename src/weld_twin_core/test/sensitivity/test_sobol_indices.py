# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Claims of the paper, advice, and Sobol and Morris indices against those of SALib."""

from importlib.metadata import version

import numpy as np
import pytest

from weld_twin_core.arm.rotation import rotation_matrix, transform
from weld_twin_core.errors import DataError
from weld_twin_core.motion.paths import Line, default_seam
from weld_twin_core.sensitivity import (
    MorrisDesign,
    SobolDesign,
    advise,
    compare_profiles,
    default_tolerances,
    default_values,
    morris_screening,
    planned_study,
    sobol_indices,
    sweep,
)
from weld_twin_core.sensitivity.claims import CaseName, judge, measure_case
from weld_twin_core.sensitivity.claims.measures import growth_exponent
from weld_twin_core.sensitivity.sweep import end_of_linearity, scenario_deviations
from weld_twin_core.sensitivity.trajectory_advice import Placement


def ishigami(unit):
    x = np.pi * (2.0 * unit - 1.0)
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def test_group_index_of_a_linear_model_is_the_share_of_the_group():
    weights = np.array([1.0, 2.0, 3.0, 4.0])
    groups = ('left', 'right', 'left', 'right')
    found = sobol_indices(lambda u: u @ weights, 'abcd', 1024, groups=groups)
    assert found.names == ('left', 'right')
    np.testing.assert_allclose(found.total, [10.0 / 30.0, 20.0 / 30.0], atol=0.01)


def test_seed_zero_is_a_seed():
    first, second = (sobol_indices(ishigami, 'abc', 256, seed=0) for _ in range(2))
    other = sobol_indices(ishigami, 'abc', 256, seed=1)
    np.testing.assert_array_equal(first.total, second.total)
    np.testing.assert_array_equal(first.total_half, second.total_half)
    assert (first.total != other.total).any()
    assert first.as_dict()['seed'] == 0


def test_morris_keeps_to_seed_zero_as_well():
    runs = [morris_screening(ishigami, 'abc', 20, seed=0).as_dict() for _ in range(2)]
    assert runs[0] == runs[1]


@pytest.mark.skipif(version('SALib') < '1.6', reason='earlier ones draw from other numbers')
def test_ways_and_measures_of_morris_are_those_of_salib():
    from SALib.analyze import morris as measured  # takes half a second, which collecting is spared
    from SALib.sample import morris as drawn

    names = tuple('abcde')
    design = MorrisDesign(names, 6, seed=4)
    problem = {'num_vars': 5, 'names': list(names), 'bounds': [[0.02, 0.98]] * 5}
    asked = {'num_levels': 8}
    seeds = [np.random.default_rng([4, k]) for k in range(2)]
    runs = drawn.sample(problem, 6, seed=seeds[0], **asked)
    np.testing.assert_allclose(design.samples(), runs, rtol=1e-14)
    results = np.sin(runs @ np.arange(1.0, 6.0)) + runs[:, 0] * runs[:, 4]
    wanted = measured.analyze(problem, runs, results, seed=seeds[1], **asked)
    found = design.screening(results)
    for key, value in (
        ('mu_star', found.mu_star),
        ('mu_star_conf', found.mu_star_half),
        ('sigma', found.sigma),
    ):
        np.testing.assert_allclose(value, np.asarray(wanted[key], dtype=float), rtol=1e-12)


def test_results_that_are_not_numbers_are_counted_and_refused():
    design = SobolDesign(('a', 'b'), 64)
    results = design.samples() @ [1.0, 2.0]
    results[[17, 40]] = np.nan, np.inf
    with pytest.raises(DataError, match=r'2 of 256 .* run 17'):
        design.indices(results)
    morris = MorrisDesign(('a', 'b'), 4)
    bad = np.full(12, 1.0)
    bad[5] = np.nan
    with pytest.raises(DataError, match='run 5'):
        morris.screening(bad)


def test_results_without_scatter_and_counts_that_are_no_power_of_two_are_refused():
    with pytest.raises(DataError, match='no scatter'):
        sobol_indices(lambda u: np.ones(len(u)), 'ab', 64)
    with pytest.raises(DataError, match='power of two'):
        SobolDesign(('a', 'b'), 1000)


def test_convergence_tells_of_half_and_all_samples():
    found = sobol_indices(ishigami, 'abc', 1024, seed=0)
    assert found.runs == 1024 * 5
    half = sobol_indices(ishigami, 'abc', 512, seed=0)
    assert found.total_half.max() < half.total_half.max()
    # The first half of a Sobol sequence is the shorter sequence.
    assert found.change == pytest.approx(np.abs(found.total - half.total).max())
    assert not sobol_indices(ishigami, 'abc', 16).converged


@pytest.mark.parametrize('groups', [None, tuple('ghgfh')])
def test_design_indices_and_intervals_are_those_of_salib(groups):
    from SALib.analyze import sobol as measured
    from SALib.sample import sobol as drawn
    from SALib.util import compute_groups_matrix

    problem = {'num_vars': 5, 'names': list('abcde'), 'bounds': [[0.0, 1.0]] * 5}
    if groups:
        problem['groups'] = list(groups)
    theirs = drawn.sample(problem, 64, calc_second_order=False, seed=7)
    design = SobolDesign(tuple('abcde'), 64, groups, 7)
    np.testing.assert_array_equal(design.samples(), theirs)
    _, names = compute_groups_matrix(list(groups or 'abcde'))
    assert design.labels == tuple(names)
    runs = theirs @ np.arange(5.0) + 3.0 * theirs[:, 0] * theirs[:, 4] ** 2
    wanted = measured.analyze(problem, runs, calc_second_order=False, seed=7)
    found = design.indices(runs)
    for key, value in (
        ('S1', found.first),
        ('ST', found.total),
        ('S1_conf', found.first_half),
        ('ST_conf', found.total_half),
    ):
        np.testing.assert_allclose(value, np.asarray(wanted[key], dtype=float), atol=1e-12)


@pytest.fixture(scope='module')
def study(ur5):
    return planned_study(ur5, default_seam(ur5), points=60)


@pytest.fixture(scope='module')
def case(ur5):
    return measure_case(ur5, default_seam(ur5))


def test_a_joint_offset_deviates_by_the_chord_of_its_arc(study):
    """D = 2 r sin(angle / 2), so it falls below proportional by angle^2 / 24."""
    offset = default_tolerances(study.robot, ('joint_offset',))[0]
    found = sweep(study, offset, default_values(offset))
    lever = np.hypot(*study.nominal.position[:, :2].T).max()
    np.testing.assert_allclose(found.max_m, 2.0 * lever * np.sin(0.5 * found.values), rtol=1e-9)
    assert found.departure[-1] == pytest.approx(-(found.values[-1] ** 2) / 24.0, rel=0.01)


def test_linearity_of_one_joint_ends_where_the_chord_is_a_hundredth_short(study):
    offset = default_tolerances(study.robot, ('joint_offset',))[0]
    end = end_of_linearity(study, offset)
    assert 1.0 - np.sin(0.5 * end) / (0.5 * end) > 0.01
    assert 1.0 - np.sin(0.45 * end) / (0.45 * end) < 0.01


def test_combined_scenario_is_below_the_sum_of_its_parts(study):
    found = {k: np.linalg.norm(v, axis=1) for k, v in scenario_deviations(study).items()}
    together = found.pop('combined')
    assert (together < sum(found.values())).all()


def test_the_power_of_a_sum_of_constants_is_one():
    grid = np.linspace(0.0, 1.0, 1000)
    assert growth_exponent(grid, np.arange(1.0, 1001.0)) == pytest.approx(1.0, abs=0.01)
    assert growth_exponent(grid, np.cumsum(grid)) == pytest.approx(2.0, abs=0.01)


def test_time_laws_do_not_matter_to_pure_geometry(ur5):
    geometry = default_tolerances(ur5, ('joint_offset', 'link_length', 'base_pose'))
    path = default_seam(ur5)
    found = compare_profiles(ur5, path, geometry, profiles=('smooth', 'aggressive'))
    assert found[0].expected_m == pytest.approx(found[1].expected_m, rel=1e-3)
    lagging = default_tolerances(ur5, ('servo_lag',))
    smooth, fast = compare_profiles(ur5, path, lagging, profiles=('smooth', 'aggressive'))
    assert fast.expected_m > 2.0 * smooth.expected_m
    assert fast.duration_s < smooth.duration_s


def test_advice_never_makes_it_worse_and_says_what_moved(ur5):
    bent = ur5.with_frames(
        tool=transform(rotation_matrix([0.0, 0.6, 0.0]), np.array([0.1, 0.0, 0.35]))
    )
    tolerances = default_tolerances(bent, ('joint_offset',))
    found = advise(bent, default_seam(bent), tolerances, tries=4)
    given, torch, base, both = found
    assert [r.label for r in found] == ['as given', 'torch', 'base', 'torch and base']
    assert both.expected_m <= min(torch.expected_m, base.expected_m) <= given.expected_m
    assert torch.placement.x == base.placement.rotation == 0.0
    assert abs(base.placement.x) <= 0.2 + 1e-9
    assert both.limit_margin_rad > 0.1


def test_moving_the_base_keeps_the_seam_where_it_is(ur5):
    moved = Placement(x=0.05, y=-0.02, yaw=0.1).robot(ur5)
    path = Line([0.5, -0.1, 0.2], [0.5, 0.1, 0.2])
    here, there = (planned_study(robot, path, points=10) for robot in (ur5, moved))
    np.testing.assert_allclose(there.nominal.position, here.nominal.position, atol=1e-9)


def test_claims_of_identities_are_measured_as_such(case, ur5):
    # Levers of a wrist: both lengths beyond an axis, the last length, and a tool on its axis.
    wrist = (np.hypot(ur5.d[4], ur5.d[5]) + ur5.d[5]) / 3.0
    inner = 2.0 * case['S_theta_mean_m'] - wrist
    assert case['distal_ratio'] == pytest.approx(wrist / inner, rel=1e-3)
    assert case['baseline_d_norm'] < 1e-9
    assert case['init_S'] == pytest.approx(1.0, abs=1e-9)
    assert case['S_a_min'] == pytest.approx(1.0) == case['S_a_max']
    assert case['offset_ratio'] == pytest.approx(1.0, abs=1e-3)
    assert case['combined_ratio_max'] < 1.0
    # Half a gap of 0.03 deg at the lever arm of an axis, whichever way it is approached.
    assert 0.0 < case['play_smooth_m'] < 2.0 * 0.5 * 5.3e-4 * case['S_theta_max_m']


JUDGED = {
    'initialization_constant': ('init_spread init_turn_spread', (9e-4, 9e-4), (9e-4, 0.5), (2e-3, 0)),
    'initialization_unit': (
        'init_S init_growth init_turn_S_m',
        (1.0009, -9e-4, 0.96), (0.9991, 9e-4, 1.06), (1.0, -2e-3, 1.0),
    ),
    'smooth_below_aggressive': ('offset_ratio lag_ratio', (1.002, 1), (1, 1.002), (1.0009, 1.0009)),
    'smooth_cumulative': ('offset_mean_ratio', (1.002,), None, (1.0009,)),
    'smooth_mitigates': ('plan_geometry_ratio plan_lag_ratio', (1.02, 1.02), (1, 1.02), (1.02, 1)),
    'backlash_local': ('local_share_play local_share_written', (0.95, 0), (0.85, 0.95), (0.85, 0.85)),
    'backlash_reversals': (
        'more_reversals_mean_play more_reversals_mean_written', (1.2, 1), (1, 1.2), (1, 1)
    ),
    'backlash_profile': (
        'play_peak_ratio play_spread_aggressive_m play_spread_smooth_m',
        (1.1, 0, 1), (1, 2.2, 1), (1, 1.8, 1),
    ),
    'proportional': ('linear_departure_max linear_departure_min', (9e-3, -9e-3), None, (0, -0.012)),
    'nonlinear_growth': ('linear_departure_max', (0.012,), None, (9e-3,)),
    'tenth_degree': ('tenth_degree_m', (1.2e-4,), None, (9e-5,)),
    # a degree at 60 mm is 1.05 mm
    'angle_above_length': (
        'S_theta_least_m S_theta_max_m S_a_max', (1.1, 2, 1), (0, 0.06, 1), (0, 0.055, 1)
    ),
    'length_bias': ('S_a_departure S_a_spread', (9e-4, 9e-4), None, (9e-4, 1.2e-3)),
    'length_place': ('S_a_max S_a_min', (1.012, 1), None, (1.009, 1)),
    'condition': ('condition_rank condition_rank_anywhere', (0.6, 0.6), (0.6, 0.4), (0.4, 0.6)),
    'combined': ('combined_exceeds', (0.6,), None, (0.4,)),
    'drift_linear': (
        'drift_exponent_angular drift_spread_angular', (0.96, 0), (1.06, 0.06), (1.06, 0.04)
    ),
    'drift_superlinear': ('drift_exponent_combined', (1.06,), None, (1.04,)),
    'ranking': (
        'rank_holds unit_angular unit_backlash unit_length unit_initial',
        (1, 0, 0, 0, 0), (0, 3, 2, 1, 1), (0, 3, 2, 1, 1.1)
    ),
}  # fmt: skip
"""Measurements of a claim with which it holds, holds under its condition, and does not hold."""


@pytest.mark.parametrize('key', JUDGED)
def test_a_claim_is_judged_by_its_measurements_on_either_side(key, case):
    names, *cases = JUDGED[key]
    for values, verdict in zip(cases, ('holds', 'holds when ', 'does not hold'), strict=True):
        if values is not None:
            measured = case | dict(zip(names.split(), map(float, values), strict=True))
            (claim,) = (c for c in judge({CaseName('a', 'b'): measured}) if c.key == key)
            assert claim.verdict.startswith(verdict)
            assert (claim.verdict == verdict) == (values is not cases[1])


def test_verdicts_follow_the_measurements(case):
    found = {claim.key: claim for claim in judge({CaseName('ur5', 'line'): case})}
    assert found['baseline'].verdict == 'holds'
    assert found['combined'].verdict == 'does not hold'
    assert found['smooth_below_aggressive'].verdict.startswith('holds when')
    turned = judge({CaseName('a', 'b'): {**case, 'distal_ratio': 1.5}})
    assert {c.key: c.verdict for c in turned}['distal'] == 'holds'
    split = judge({CaseName('a', 'b'): case, CaseName('c', 'd'): {**case, 'distal_ratio': 1.5}})
    distal = {c.key: c for c in split}['distal']
    assert (distal.verdict, distal.held, distal.cases) == ('does not hold', 1, 2)
    assert f'{case["distal_ratio"]:.2f} to 1.50' in distal.reason
