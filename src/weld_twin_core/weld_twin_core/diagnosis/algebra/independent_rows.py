# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How many rows of a residual count as independent."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from .row_layout import by_sample


def effective_share(residual: Array, rows: tuple[int, ...], samples: tuple[int, ...]) -> float:
    """
    Return the share of rows that count as independent, from the residual's autocorrelation.

    Initial positive sequence estimate [1]_ on every component of every recording.

    Parameters
    ----------
    residual : array, shape (rows,)
        Whitened, as `Problem.whitened` lays it out.
    rows, samples : tuple of int
        Components and samples of every recording.

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
    if m < 8:
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
