# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where joints have just turned around: there alone the laws of lost motion differ."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..recording import JointMotion

_TAKEN_UP = 1e-3
"""Way after a turn [rad or m] within which a joint takes up what it loses: play and the wind-up of
gears are some tenths of a milliradian."""
_BACK = 1e-5
"""Way back [rad or m] from which on it is a turn: more than an encoder's noise, less than any play."""


def just_turned(motion: JointMotion, at: Array) -> NDArray[np.bool_]:
    """
    Return whether joints turned around less than `_TAKEN_UP` ago, shape (M, n).

    at: stamps within it, shape (M,) [s]. Nothing has turned at rest at stations, or before a first
    turn.
    """
    out = np.zeros((at.size, motion.q.shape[1]), dtype=bool)
    if motion.static:
        return out
    q, _ = motion.at(at)
    for i, column in enumerate(motion.q.T):
        turns = _turns(column)
        if not turns.size:
            continue
        before = np.searchsorted(motion.t[turns], at, side='right') - 1
        since = np.abs(q[:, i] - column[turns[before]])
        out[:, i] = (before >= 0) & (since < _TAKEN_UP)
    return out


def _turns(q: Array) -> NDArray[np.int_]:
    """Return the samples at which a joint turned around, by more than `_BACK`."""
    # Only samples at which the step changes its sign can be turns: few of a long motion.
    steps = np.sign(np.diff(q))
    moved = np.flatnonzero(steps)
    if not moved.size:
        return moved
    corners = [0, *(moved[1:][np.diff(steps[moved]) != 0.0]).tolist(), q.size - 1]
    result: list[int] = []
    way, far = 0.0, 0
    for k in corners[1:]:
        gone = float(q[k] - q[far])
        if way == 0.0:
            if abs(gone) > _BACK:
                way, far = float(np.sign(gone)), k
        elif way * gone >= 0.0:
            far = k
        elif abs(gone) > _BACK:
            result.append(far)
            way, far = -way, k
    return np.array(result, dtype=int)
