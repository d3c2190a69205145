# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Rows of a residual: their one layout, their spread, and how many count as independent."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ..negligible import EMPTY, SLIGHT

Row = TypeVar('Row', bound=np.generic)
ENOUGH = 12
"""Samples from which on they tell how wide they spread: a median is then good to a quarter."""
FEWEST = 3
"""Numbers from which on they show a spread at all: that of two says nothing."""
SAME_STATION = 2e-3
"""Stations closer than this in every joint [rad, m] are visits of one."""
NORMAL = 1.4826
"""Standard deviation of normal numbers over the median of their size: 1 / 0.6745."""


def effective_share(
    residual: Array,
    rows: tuple[int, ...],
    samples: tuple[int, ...],
    stations: Sequence[NDArray[np.intp] | None] = (),
) -> float:
    """
    Return the share of rows that count as independent, as a residual hangs together.

    In time by its autocorrelation, the initial positive sequence estimate [1]_ on every component of
    every recording. Where stations are visited again by how far their visits agree [2]_: what is
    not explained at a station is there at every visit.

    stations: of every recording the station of each sample, (M,); None where nothing is visited again.

    References
    ----------
    .. [1] C. J. Geyer, "Practical Markov chain Monte Carlo", Statist. Sci. 7, 1992.
    .. [2] L. Kish, "Survey Sampling", Wiley 1965, section 5.4: m units that correlate by r count as
       m / (1 + (m - 1) r).

    """
    parts = [part - part.mean(axis=0) for part in by_sample(residual, rows, samples)]
    shares = [1.0 / _correlation_time(part) for part in parts]
    for k, station in enumerate(stations):
        if station is not None:
            shares[k] = min(shares[k], _share_of_visits(parts[k], station))
    counts = [part.size for part in parts]
    return float(np.average(shares, weights=counts))


def visited(q: Array) -> NDArray[np.intp]:
    """Return which station each of some postures (M, n) is, (M,)."""
    # Nodes and motions do without these, and would start later for them.
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    one, other = cKDTree(q).query_pairs(SAME_STATION, p=np.inf, output_type='ndarray').T
    near = coo_matrix((np.ones(one.size), (one, other)), shape=2 * (len(q),))
    return np.asarray(connected_components(near, directed=False)[1], dtype=np.intp)


def _share_of_visits(part: Array, station: NDArray[np.intp]) -> float:
    """Return the share of rows (M, c) that count beside other visits of their station, (M,)."""
    count = np.bincount(station)
    again = count > 1
    sums = np.zeros((count.size, part.shape[1]))
    np.add.at(sums, station, part)
    mean = sums / count[:, None]
    freedom = (count[again] - 1).sum() * part.shape[1]
    within = float(((part - mean[station]) ** 2).sum() / freedom)
    between = max(float((mean[again] ** 2).mean()) - within / float(count[again].mean()), 0.0)
    alike = between / max(between + within, EMPTY)
    return float(np.mean(1.0 / (1.0 + (count[station] - 1) * alike)))


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
