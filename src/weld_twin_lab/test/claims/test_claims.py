# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Identities are measured as such, and verdicts follow the measurements."""

import numpy as np
import pytest

from weld_twin_core.arm import catalog
from weld_twin_core.motion.paths import default_seam
from weld_twin_lab.claims import CaseName, judge, measure_case
from weld_twin_lab.claims.combined_measures import growth_exponent


@pytest.fixture(scope='module')
def case():
    robot = catalog.load('ur5')
    return measure_case(robot, default_seam(robot))


def test_the_power_of_a_sum_of_constants_is_one():
    grid = np.linspace(0.0, 1.0, 1000)
    assert growth_exponent(grid, np.arange(1.0, 1001.0)) == pytest.approx(1.0, abs=0.01)
    assert growth_exponent(grid, np.cumsum(grid)) == pytest.approx(2.0, abs=0.01)


def test_claims_of_identities_are_measured_as_such(case):
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
