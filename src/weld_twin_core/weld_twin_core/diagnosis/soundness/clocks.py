# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Do joint and measurement stamps belong to one clock?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...arrays import Array
from ...recording import Recording
from ..alignment import nearest_rotation
from .case import Case, Finding, measured

MOST_LAG = 2.0
"""Lags up to this [s] are looked at, and up to a quarter of the recording."""
COARSE, FINE = 0.01, 0.001
SAMPLES = 200
FEW = 3.0
"""A lag of fewer samples is left to the fit."""
LATE = 0.1
"""A lag [s] from which it is a warning."""
EXPLAINED = 0.35
"""What the gap must fall to for a lag to be believed."""


def clocks(case: Case) -> Sequence[Finding]:
    """Return how late the measurements of a moving arm are, where that explains the gap."""
    out: list[Finding] = []
    for k, recording in enumerate(case.recordings):
        t = measured(recording).t
        if recording.joints.static or t.size < 30 or recording.joints.t.size < 30:
            continue
        step = max(float(np.median(np.diff(s))) for s in (t, recording.joints.t))
        out += _recording(case, k, recording, FEW * step)
    return out


def _recording(case: Case, k: int, recording: Recording, few: float) -> Iterator[Finding]:
    joints = recording.joints.t
    path = case.model.twin(k).poses(recording, joints).position
    seen = measured(recording)
    late = lag(joints, path, seen.t, seen.position)
    if late is not None and abs(late) > few:
        yield Finding(
            'warning' if abs(late) > LATE else 'note',
            f'The measurements of {recording.name} are {abs(late) * 1e3:.0f} ms '
            f'{"late" if late > 0.0 else "early"} against the joint states: the clocks are not '
            'synchronised'
            + (', or commanded joints were recorded and the arm lags behind.' if late > 0.0
               else '.'),
        )  # fmt: skip
    third = (seen.t[-1] - seen.t[0]) / 3.0
    first, last = seen.t < seen.t[0] + third, seen.t > seen.t[-1] - third
    ends = [lag(joints, path, seen.t[part], seen.position[part]) for part in (first, last)]
    if ends[0] is not None and ends[1] is not None and abs(ends[1] - ends[0]) > few:
        rate = (ends[1] - ends[0]) / (2.0 * third)
        yield Finding(
            'warning',
            f'The clocks of {recording.name} run apart: the measurements are '
            f'{ends[0] * 1e3:.0f} ms late in the first third and {ends[1] * 1e3:.0f} ms in the '
            f'last ({rate * 1e6:.0f} ppm).',
        )


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
