# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Pass, fail or open, against how often a robot at its limit is judged wrongly; circles found."""

import numpy as np
import pytest

from weld_twin_core.metrics.circle import circle_of
from weld_twin_core.metrics.conformity import FAIL, OPEN, PASS, Rule


@pytest.mark.parametrize(
    ('size', 'verdict'), [(0.83e-3, PASS), (0.84e-3, OPEN), (1.16e-3, OPEN), (1.17e-3, FAIL)]
)
def test_one_reading_is_judged_with_1_645_standard_uncertainties(size, verdict):
    assert Rule(1e-3, 1e-4).judged(size) == verdict


def test_without_a_tolerance_nothing_is_judged():
    assert Rule(None, 1e-4).judged(5.0) is None


@pytest.mark.parametrize('count', [1, 30, 1000])
def test_a_robot_right_at_its_tolerance_seldom_fails_however_many_readings(count):
    rng = np.random.default_rng(2)
    rule = Rule(1e-3, 5e-5, count)
    largest = (1e-3 + rng.normal(0.0, 5e-5, (4000, count))).max(axis=1)
    wrong = np.mean([rule.judged(float(v)) == FAIL for v in largest])
    assert wrong == pytest.approx(0.05, abs=0.012)


def test_a_circle_is_found_where_it_was_put():
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    across, up = np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.0, 1.0])
    points = [0.4, 0.1, 0.2] + 0.07 * (np.outer(np.cos(turn), across) + np.outer(np.sin(turn), up))
    found = circle_of(points)
    assert found is not None
    assert found.centre == pytest.approx([0.4, 0.1, 0.2])
    assert found.radius == pytest.approx(0.07)
    assert np.allclose(found.outwards(points), (points - found.centre) / 0.07)


def test_half_a_circle_and_a_line_are_none():
    turn = np.linspace(0.0, np.pi, 200)
    half = np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    assert circle_of(half) is None
    assert circle_of(np.column_stack([turn, 2 * turn, 0 * turn])) is None
