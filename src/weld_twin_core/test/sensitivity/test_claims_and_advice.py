# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Verdicts follow the measurements; scenarios, sweeps and advice against hand values."""

import numpy as np
import pytest

from weld_twin_core.arm.rotation import rotation_matrix, transform
from weld_twin_core.motion.paths import Line, default_seam
from weld_twin_core.sensitivity import (
    advise,
    compare_profiles,
    default_tolerances,
    default_values,
    planned_study,
    sweep,
)
from weld_twin_core.sensitivity.claims import CaseName, judge, measure_case
from weld_twin_core.sensitivity.claims.measures import growth_exponent
from weld_twin_core.sensitivity.sweep import end_of_linearity, scenario_deviations
from weld_twin_core.sensitivity.trajectory_advice import Placement


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
