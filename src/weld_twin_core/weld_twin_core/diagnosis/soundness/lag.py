# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How late a stream of measured points is against a path, wherever the instrument stands."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ..alignment import nearest_rotation

MOST_LAG = 2.0
"""Lags up to this [s] are looked at, and up to a quarter of the recording."""
COARSE, FINE = 0.01, 0.001
SAMPLES = 200
EXPLAINED = 0.35
"""What the gap must fall to for a lag to be believed."""


def lag(joints: Array, path: Array, t: Array, position: Array) -> float | None:
    """
    Return how late measurements are against a path [s]; None when no lag explains much.

    Whatever lag, the path may be turned and shifted, so no base frame is needed.

    Parameters
    ----------
    joints, path : array, shape (N,) [s] and (N, 3) [m]
    t, position : array, shape (M,) [s] and (M, 3) [m]

    """
    most = min(MOST_LAG, 0.25 * (t[-1] - t[0]))
    inside = (t > joints[0] + most) & (t < joints[-1] - most)
    index = np.flatnonzero(inside)
    if index.size < 20:
        return None
    index = index[np.linspace(0, index.size - 1, min(SAMPLES, index.size)).round().astype(int)]
    chosen, points = t[index], position[index]

    def left(late: float) -> float:
        shifted = np.stack([np.interp(chosen - late, joints, p) for p in path.T], axis=1)
        return _misfit(points, shifted)

    coarse = np.arange(-most, most + COARSE, COARSE)
    costs = np.array([left(late) for late in coarse])
    centre = _nearest(coarse, costs)
    fine = centre + np.arange(-COARSE, COARSE + FINE, FINE)
    best = float(fine[np.argmin([left(late) for late in fine])])
    return best if left(best) < EXPLAINED * left(0.0) else None


def _nearest(lags: Array, costs: Array) -> float:
    """Return the smallest lag among the best; a periodic motion has many."""
    good = lags[costs < 1.2 * costs.min()]
    return float(good[np.abs(good).argmin()])


def _misfit(seen: Array, path: Array) -> float:
    """Return the RMS gap after the best turn and shift, without the worst fifth."""
    keep = np.ones(len(seen), dtype=bool)
    for _ in range(2):
        a, b = seen[keep] - seen[keep].mean(axis=0), path[keep] - path[keep].mean(axis=0)
        turn = nearest_rotation(a.T @ b)
        off = np.linalg.norm(
            seen - seen[keep].mean(axis=0) - (path - path[keep].mean(axis=0)) @ turn.T, axis=1
        )
        keep = off <= np.quantile(off, 0.8)
    return float(np.sqrt((off[keep] ** 2).mean()))
