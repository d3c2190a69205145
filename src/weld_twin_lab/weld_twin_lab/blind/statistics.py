# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Shares and medians with their intervals, and how well a confidence is calibrated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import binomtest

from weld_twin_core.arrays import Array

DRAWS = 2000
"""Bootstrap samples; fifty of them lie beyond either end of a 95 % interval."""
BINS = 10
"""Bins of confidence in which hits are counted, a tenth wide each."""


class Estimate(NamedTuple):
    """A number, its 95 % interval, and how many ``cases`` it rests on."""

    value: float | None
    low: float | None
    high: float | None
    cases: int

    def __str__(self) -> str:
        """Return it in words."""
        if self.value is None:
            return 'none'
        return f'{self.value:.3f} ({self.low:.3f} to {self.high:.3f}; {self.cases})'


def share(hits: Sequence[bool]) -> Estimate:
    """Return a share with its Wilson score interval."""
    n, right = len(hits), sum(map(bool, hits))
    if n == 0:
        return Estimate(None, None, None, 0)
    ends = binomtest(right, n).proportion_ci(0.95, 'wilson')
    return Estimate(right / n, float(ends.low), float(ends.high), n)


def bootstrap(
    values: Sequence[float] | Array, statistic: Callable[..., Array] = np.median
) -> Estimate:
    """
    Return a statistic with its percentile bootstrap interval.

    values: rows are cases, shape (N, k).
    statistic: takes values and ``axis``.
    """
    rows = np.asarray(values, dtype=float)
    n = rows.shape[0]
    if n == 0:
        return Estimate(None, None, None, 0)
    picks = np.random.default_rng(0).integers(0, n, (DRAWS, n))
    low, high = np.quantile(statistic(rows[picks], axis=1), [0.025, 0.975])
    return Estimate(float(statistic(rows, axis=0)), float(low), float(high), n)


def brier(confidence: Sequence[float], right: Sequence[bool]) -> Estimate:
    """Return the Brier score, the mean squared error of the confidence."""
    squares = (np.asarray(confidence, dtype=float) - np.asarray(right, dtype=float)) ** 2
    return bootstrap(squares, np.mean)


def calibration_error(confidence: Sequence[float], right: Sequence[bool]) -> Estimate:
    """Return the expected calibration error over ten bins of equal width."""
    pairs = np.array([confidence, right], dtype=float).T
    return bootstrap(pairs, _calibration_error)


def _calibration_error(pairs: Array, axis: int) -> Array:
    """Return the error of every resample; pairs (..., N, 2), ``axis`` that of the cases."""
    sure, true = pairs[..., 0], pairs[..., 1]
    cases = axis if axis < 0 else axis - sure.ndim
    place = np.minimum((sure * BINS).astype(int), BINS - 1)
    off = [np.abs(((true - sure) * (place == k)).sum(axis=cases)) for k in range(BINS)]
    return np.asarray(sum(off) / sure.shape[cases])
