# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Rows of a residual: their one layout, their spread, and how many count as independent."""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from ...arrays import Array
from .negligible import SLIGHT

Row = TypeVar('Row', bound=np.generic)
ENOUGH = 12
"""Samples from which on they tell how wide they spread: a median is then good to a quarter."""
FEWEST = 3
"""Numbers from which on they show a spread at all: that of two says nothing."""
NORMAL = 1.4826
"""Standard deviation of normal numbers over the median of their size: 1 / 0.6745."""


def effective_share(residual: Array, rows: tuple[int, ...], samples: tuple[int, ...]) -> float:
    """
    Return the share of rows that count as independent, from the residual's autocorrelation.

    Initial positive sequence estimate [1]_ on every component of every recording.

    References
    ----------
    .. [1] C. J. Geyer, "Practical Markov chain Monte Carlo", Statist. Sci. 7, 1992.

    """
    parts = by_sample(residual, rows, samples)
    shares = [1.0 / _correlation_time(part - part.mean(axis=0)) for part in parts]
    counts = [part.size for part in parts]
    return float(np.average(shares, weights=counts))


def _correlation_time(part: Array) -> float:
    """Return 1 + 2 sum of autocorrelations until a pair of them is not positive."""
    m = part.shape[0]
    if m < ENOUGH:
        return 1.0
    size = 1 << (2 * m - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(part, size, axis=0)) ** 2
    covariance = np.fft.irfft(spectrum.sum(axis=1), size)[: m // 2]
    if covariance[0] <= 0.0:
        return 1.0
    rho = covariance / covariance[0]
    even = len(rho) // 2 * 2
    pairs = rho[0:even:2] + rho[1:even:2]
    stop = int(np.argmax(pairs <= 0.0)) if (pairs <= 0.0).any() else len(pairs)
    return float(max(1.0, 2.0 * pairs[:stop].sum() - 1.0))


def by_sample(
    values: np.ndarray[tuple[int, ...], np.dtype[Row]],
    rows: tuple[int, ...],
    samples: tuple[int, ...],
) -> list[np.ndarray[tuple[int, ...], np.dtype[Row]]]:
    """Return rows, (rows, ...), as `Problem.whitened` lays them out, by recording, (M, c, ...)."""
    ends = np.cumsum([c * m for c, m in zip(rows, samples, strict=True)])
    parts = np.split(values, ends[:-1])
    each = zip(parts, rows, samples, strict=True)
    return [part.reshape(m, c, *values.shape[1:]) for part, c, m in each]


def robust_spread(values: Array) -> float:
    """Return the standard deviation of numbers about zero by the median of their size."""
    return NORMAL * float(np.median(np.abs(values)))


def measured_axes(part: Array) -> Array:
    """Return the coordinates (k, M) of (3, M) that were measured: exact zeros are no small noise."""
    size = np.abs(part).max(axis=1, initial=0.0)
    live = size > SLIGHT * size.max(initial=0.0)
    return part[live] if live.any() else part
