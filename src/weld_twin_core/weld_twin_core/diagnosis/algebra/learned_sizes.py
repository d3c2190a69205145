# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How large errors of a kind are on this arm, learned from normal equations by the evidence.

References
----------
.. [1] D. J. C. MacKay, "Bayesian interpolation", Neural Computation 4, 1992.
.. [2] M. E. Tipping, "Sparse Bayesian learning and the relevance vector machine", JMLR 1, 2001.

"""

from __future__ import annotations

from contextlib import suppress

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError

from ...arrays import Array
from ...errors import DataError
from ..negligible import FLAT, REWEIGHTED, ROUNDING, SLIGHT
from .definite import solved

JITTER = (ROUNDING, FLAT, SLIGHT, 1.0)
"""Shares added to a diagonal, the least that is enough: a few stations repeat their columns."""


def learned_precision(
    normal: Array,
    right: Array,
    rss: float,
    rows: int,
    labels: Array,
    scales: Array,
    believed: Array | None = None,
) -> tuple[Array, float]:
    """
    Return the prior precision (K,) that maximises the evidence, and the freedom that data determine.

    normal, right, rss, rows: normal equations with the nuisance frames projected out.
    labels, scales: as `groups` returns them, shape (K,).
    believed: precision of machines at large, (K,), if any: the spread learned starts there and is
    never wider, and what is fitted freely has it.
    """
    if not scales.size:
        return np.zeros(0), 0.0
    # In units of the typical size, so that one variance serves a whole family.
    normal = normal * np.outer(scales, scales)
    right = right * scales
    tied = labels >= 0
    usual = np.full(scales.size, np.inf)  # variance of machines at large in typical sizes
    if believed is not None:
        known = believed > 0.0
        usual[known] = 1.0 / (believed[known] * scales[known] ** 2)
    variance, most = _first_variances(labels, usual)
    members, count = labels[tied], variance.size
    learned_of = np.bincount(members, minlength=count) > 0
    noise, room = 1.0, np.empty_like(normal)
    for _ in range(REWEIGHTED):
        precision = _precision(tied, variance, labels, usual)
        mean, spread = _solved(normal, right, noise, precision, room)
        determined = np.clip(1.0 - precision * spread, 0.0, 1.0)
        left = rss - 2.0 * right @ mean + mean @ normal @ mean
        noise = max(left / max(rows - determined.sum(), 1.0), SLIGHT)
        share = np.maximum(np.bincount(members, determined[tied], count), SLIGHT)
        learned = np.bincount(members, mean[tied] ** 2, count) / share
        learned = np.minimum(np.maximum(learned, FLAT), most)
        variance = np.where(learned_of, learned, variance)
    precision = _precision(tied, variance, labels, usual) / scales**2
    # The fit works in whitened rows, so a prior counts against the noise actually there.
    return precision * noise, float(determined.sum())


def _first_variances(labels: Array, usual: Array) -> tuple[Array, Array]:
    """Return the variance that every group starts from, and the most that it may have, (G,)."""
    # A group too small to be tied keeps its number, without a member.
    variance = np.ones(labels.max() + 1)
    most = np.full(variance.size, np.inf)
    for k in np.unique(labels[labels >= 0]):
        most[k] = usual[labels == k].mean()
        if np.isfinite(most[k]):
            variance[k] = most[k]
    return variance, most


def _solved(
    normal: Array, right: Array, noise: float, precision: Array, room: Array
) -> tuple[Array, Array]:
    """Return mean and variance of the coordinates, (K,), under a prior about zero."""
    diagonal = room.reshape(-1)[:: len(room) + 1]
    for more in JITTER:
        np.divide(normal, noise, out=room)
        diagonal += precision
        size = np.abs(diagonal)
        diagonal += more * (size + more * size.max(initial=1.0))
        with suppress(LinAlgError):
            return solved(room, right / noise)
    raise DataError('the measurements say so little that no errors can be fitted together')


def _precision(tied: NDArray[np.bool_], variance: Array, labels: Array, usual: Array) -> Array:
    if not variance.size:
        return np.asarray(1.0 / usual)
    return np.asarray(np.where(tied, 1.0 / variance[np.maximum(labels, 0)], 1.0 / usual))


def projected(normal: Array, right: Array, rss: float, frames: int) -> tuple[Array, Array, float]:
    """Return normal equations and squares with their leading columns, frames, projected out."""
    if not frames:
        return normal, right, rss
    cross = normal[:frames, frames:]
    wanted = np.column_stack([cross, right[:frames]])
    solved = np.linalg.lstsq(normal[:frames, :frames], wanted, rcond=ROUNDING)[0]
    left = normal[frames:, frames:] - cross.T @ solved[:, :-1]
    pull = right[frames:] - cross.T @ solved[:, -1]
    return left, pull, rss - float(right[:frames] @ solved[:, -1])
