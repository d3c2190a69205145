# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Displacements on the joint clock, looked up at the measurements' stamps."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..recording import JointMotion


class Picker:
    """
    Straight-line interpolation from joint stamps to measurement stamps, draws and all.

    t: where to look, shape (M,) or (D, M) [s]; static stations give the nearest in time.
    """

    def __init__(self, motion: JointMotion, t: Array) -> None:
        if motion.static or motion.t.size < 2:
            self._low = motion.nearest(t)
            self._high, self._weight = self._low, np.zeros(t.shape)
            self._rate = np.zeros(t.shape)
            return
        inside = np.clip(t, motion.t[0], motion.t[-1])
        self._low = np.clip(np.searchsorted(motion.t, inside) - 1, 0, motion.t.size - 2)
        self._high = self._low + 1
        span = motion.t[self._high] - motion.t[self._low]
        self._weight = (inside - motion.t[self._low]) / span
        self._rate = np.where(inside == t, 1.0 / span, 0.0)

    def _ends(self, values: Array) -> tuple[Array, Array]:
        """Return values (..., N) before and after every stamp, each (..., M)."""
        if self._low.ndim == 1:
            return values[..., self._low], values[..., self._high]
        shape = np.broadcast_shapes(values.shape[:-1], self._low.shape[:-1])
        wide = np.broadcast_to(values, shape + values.shape[-1:])
        low = np.broadcast_to(self._low, shape + self._low.shape[-1:])
        high = np.broadcast_to(self._high, low.shape)
        return np.take_along_axis(wide, low, -1), np.take_along_axis(wide, high, -1)

    def pick(self, values: Array) -> Array:
        """Return values (..., N) at the new stamps (..., M)."""
        low, high = self._ends(values)
        return low + self._weight * (high - low)

    def take(self, values: Array) -> Array:
        """Return values (..., N, n) at the new stamps (..., M, n)."""
        return np.stack([self.pick(joint) for joint in np.moveaxis(values, -1, 0)], axis=-1)

    def rates(self, values: Array) -> Array:
        """Return the slope of the straight lines through values (..., N, n), (..., M, n) [1/s]."""
        ends = [self._ends(joint) for joint in np.moveaxis(values, -1, 0)]
        return np.stack([self._rate * (high - low) for low, high in ends], axis=-1)
