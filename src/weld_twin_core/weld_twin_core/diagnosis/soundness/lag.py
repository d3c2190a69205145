# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How late a stream of measured points is against a path, wherever the instrument stands."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arm.rotation import nearest_rotation
from ...arrays import Array, spread_over
from ..limits import ENOUGH, FEW, STEPS, WORTH

MOST_LAG = 2.0
"""Lags up to this [s] are looked at, and up to a tenth of the recording."""
WIDEST = 0.4
"""Share of the recording up to which lags are looked at where nothing else can be wrong."""
TRIED = 300
"""Lags tried first, and samples compared at each: enough for one number, and quick."""
KEPT = 1.0 - 2.0 * FEW
"""Share of the samples that count: the worst may be outliers."""


class Lag(NamedTuple):
    """How late measurements are [s] at an instant [s], and with every second; RMS gaps [m] with it."""

    late: float
    rate: float
    middle: float
    before: float = 0.0
    after: float = 0.0

    def at(self, t: Array) -> Array:
        return self.late + self.rate * (t - self.middle)


def lag(
    joints: Array, path: Array, t: Array, position: Array, *, wide: bool = False
) -> Lag | None:
    """
    Return how late measurements, (M,) [s] and (M, 3) [m], are against a path, (N,) and (N, 3).

    None when too few to tell. The path may be turned and shifted, so no base frame is needed. Where
    ``wide``, lags up to `WIDEST` of the recording are looked at.
    """
    span = float(np.ptp(t))
    most = WIDEST * span if wide else min(MOST_LAG, FEW * span)
    index = np.flatnonzero((t > joints[0] + most) & (t < joints[-1] - most))
    if index.size < ENOUGH:
        return None
    index = index[spread_over(index.size, TRIED)]
    stamps, seen = t[index], position[index]
    none = Lag(0.0, 0.0, float(stamps.mean()))
    grid = np.linspace(-most, most, TRIED + 1)
    costs = _misfits(seen, _along(path, joints, stamps - grid[:, None]))
    start = none._replace(late=_nearest(grid, costs))
    constant = _polished(start, joints, path, stamps, seen, free=1)
    drifting = _polished(constant, joints, path, stamps, seen, free=2)
    late = np.stack([trial.at(stamps) for trial in (none, constant, drifting)])
    before, after, apart = _misfits(seen, _along(path, joints, stamps - late)).tolist()
    if apart < WORTH * after:
        constant, after = drifting, apart
    return constant._replace(before=before, after=after)


def _along(path: Array, joints: Array, t: Array) -> Array:
    return np.stack([np.interp(t, joints, p) for p in path.T], axis=-1)


def _nearest(lags: Array, costs: Array) -> float:
    """Return the smallest lag among the best minima; a periodic motion has many."""
    padded = np.pad(costs, 1, constant_values=np.inf)
    low = costs <= (1.0 + 2.0 * FEW) * costs.min()
    good = lags[low & (costs <= padded[:-2]) & (costs <= padded[2:])]
    return float(good[np.abs(good).argmin()])


def _polished(start: Lag, joints: Array, path: Array, t: Array, seen: Array, free: int) -> Lag:
    """Return the lag after Gauss-Newton steps of its first one or two numbers."""
    now, velocity = start, np.gradient(path, joints, axis=0)
    for _ in range(STEPS):
        here = _along(path, joints, t - now.at(t))
        turn, keep = _aligned(seen, here)
        speed = -_along(velocity, joints, t - now.at(t)) @ turn.T
        columns = [speed, speed * (t - now.middle)[:, None]][:free]
        system = np.stack([_centred(c, keep)[keep].ravel() for c in columns], axis=1)
        gap = _off(_centred(seen, keep), _centred(here, keep), turn)
        step = np.linalg.lstsq(system, gap[keep].ravel(), rcond=None)[0]
        now = now._replace(late=now.late + step[0], rate=now.rate + (step[1] if free > 1 else 0.0))
    return now


def _misfits(seen: Array, paths: Array) -> Array:
    """Return the RMS gap of (M, 3) to paths, (L, M, 3), aligned, worst samples left out."""
    turn, keep = _aligned(seen, paths)
    square = (_off(_centred(seen, keep), _centred(paths, keep), turn) ** 2).sum(axis=-1)
    return np.asarray(np.sqrt((square * keep).sum(axis=-1) / keep.sum(axis=-1)))


def _aligned(seen: Array, path: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return turns from paths (..., M, 3) to measurements, and which samples agree best."""
    keep = np.ones(path.shape[:-1], dtype=bool)
    for _ in range(2):
        there, here = _centred(seen, keep), _centred(path, keep)
        turn = nearest_rotation(np.swapaxes(there, -1, -2) @ (here * keep[..., None]))
        off = np.linalg.norm(_off(there, here, turn), axis=-1)
        keep = off <= np.quantile(off, KEPT, axis=-1, keepdims=True)
    return turn, keep


def _off(seen: Array, path: Array, turn: Array) -> Array:
    return np.asarray(seen - path @ np.swapaxes(turn, -1, -2))


def _centred(points: Array, keep: NDArray[np.bool_]) -> Array:
    """Return points (..., M, 3) about the mean of those kept, (..., M)."""
    share = keep / keep.sum(axis=-1, keepdims=True)
    return np.asarray(points - share[..., None, :] @ points)
