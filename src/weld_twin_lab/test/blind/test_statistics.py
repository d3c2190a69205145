# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Intervals and calibration against scipy and against numbers worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import binomtest

from weld_twin_lab.blind.statistics import bootstrap, brier, calibration_error, share


@pytest.mark.parametrize(('hits', 'count'), [(0, 7), (1, 1), (3, 10), (399, 400), (40, 40)])
def test_a_share_has_the_wilson_interval_of_scipy(hits, count):
    value, low, high, n = share([True] * hits + [False] * (count - hits))
    reference = binomtest(hits, count).proportion_ci(0.95, method='wilson')
    assert n == count
    np.testing.assert_allclose([value, low, high], [hits / count, *reference], atol=1e-12)


def test_no_case_has_no_share():
    assert share([]) == (None, None, None, 0)
    assert bootstrap([]) == (None, None, None, 0)


def test_a_bootstrap_interval_has_the_width_of_theory():
    values = np.random.default_rng(1).standard_normal(400)
    value, low, high, _ = bootstrap(values, np.mean)
    assert value == pytest.approx(values.mean())
    assert high - low == pytest.approx(2 * 1.96 * values.std() / 20.0, rel=0.08)


def test_brier_score_by_hand():
    assert brier([0.9, 0.6], [True, False]).value == pytest.approx((0.01 + 0.36) / 2)


def test_calibration_error_by_hand():
    # 0.9-1.0: two cases of mean confidence 0.95, half right; 0.5-0.6: one case, right.
    error = calibration_error([0.95, 0.95, 0.5], [True, False, True])
    assert error.value == pytest.approx((2 * 0.45 + 1 * 0.5) / 3)


def test_a_calibrated_confidence_has_little_error():
    rng = np.random.default_rng(2)
    sure = rng.uniform(size=2000)
    assert calibration_error(sure, rng.uniform(size=2000) < sure).value < 0.04
    assert calibration_error(sure, rng.uniform(size=2000) < 0.5 * sure).value > 0.2
