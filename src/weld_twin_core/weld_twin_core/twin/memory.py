# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Effects with memory over the joint stream, in series: each runs on what the last one left.

What they displace on the joint clock is looked up at the measurements' stamps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..arm.channels import Shift
from ..arrays import Array
from ..effects.effect import Effect, MemoryEffect, Stage, View
from ..recording import JointMotion, backward_rates

Tangent = tuple[int, int, Shift]
"""Effect, component, and the derivative of the channels by it."""


def in_series(effects: Sequence[Effect]) -> list[tuple[int, MemoryEffect]]:
    """Return the effects with memory and their place in the list, in the order they act."""
    return [
        (k, effect)
        for stage in (Stage.SERVO, Stage.PLAY)
        for k, effect in enumerate(effects)
        if effect.stage == stage and isinstance(effect, MemoryEffect)
    ]


def run_all(
    effects: Sequence[Effect], view: View, want: bool
) -> tuple[Array | None, list[Tangent]]:
    """Return joints' displacements, shape (..., N, n) or None, and, if wanted, derivatives."""
    moved: Array | None = None
    tangents: list[Tangent] = []
    for k, effect in in_series(effects):
        now = view if moved is None else replace(view, q=view.q + moved)
        shift, _ = effect.run(now)
        if want:
            own = indexed(k, effect.gradient(now))
            tangents = [(a, b, _pushed(effect, now, s)) for a, b, s in tangents] + own
        moved = added(np.zeros(view.q.shape) if moved is None else moved, shift)
    return moved, tangents


def indexed(k: int, gradient: Sequence[Shift | None]) -> list[Tangent]:
    """Return the tangents of effect k: those components that have a derivative."""
    return [(k, c, shift) for c, shift in enumerate(gradient) if shift is not None]


def added(joints: Array, shift: Shift) -> Array:
    """Return joint values (..., N, n) with the ('q', i) displacements (..., N) on top."""
    samples = np.broadcast_shapes(joints.shape[:-1], *(np.shape(v) for v in shift.values()))
    out = np.array(np.broadcast_to(joints, samples + joints.shape[-1:]))
    for (_, i), value in shift.items():
        out[..., i] += value
    return out


def rates(motion: JointMotion, moved: Array) -> Array | float:
    """Return how fast displacements (..., N, n) change since the joint state before [1/s]."""
    return 0.0 if motion.static else backward_rates(motion.t, moved)


def _pushed(effect: MemoryEffect, view: View, shift: Shift) -> dict[Any, Array]:
    own = ('q', view.robot.index(str(effect.site)))
    return {key: effect.push(view, v) if key == own else v for key, v in shift.items()}


class Picker:
    """Straight lines from joint stamps to stamps (M,) or (D, M) [s]; at stations the nearest."""

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
