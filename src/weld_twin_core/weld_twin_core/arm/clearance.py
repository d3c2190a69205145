# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Does the arm hit itself, the floor, or the walls of its cell? Links as simple capsules.

The lines that the robot's table draws from joint to joint are made as thick as links of such an arm
usually are. Real links are not capsules: what is let through still has to be looked at.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from ..arrays import Array
from .chain import Frames, frames, rising, up
from .robot import Robot

_THICK = 0.05
"""Radius of a link over the arm's whole length: of a UR5, 1.2 m long, 0.06 m, of a KR 16 0.12 m."""
_TORCH = 0.03
"""Radius of what hangs on the flange [m]: a torch is about 60 mm thick."""
_SHORT = 1e-3
"""Shorter lines [m] are no link."""
_ALIKE = 1e-3
"""Distance [m] within which two postures are as near: links that cannot meet differ by rounding."""
_UPRIGHT = 0.99
"""Cosine of the angle to the vertical [1] from which an arm stands upright, within 8 degrees."""
_GROUND = -1
"""Stands for the line from a positioner's foot to the robot's, where nothing is."""
_PLACES = 5
"""Places along each of two lines between which their distance is looked at."""


class _Body(NamedTuple):
    """Capsules: ends, shape (..., S, 3) each [m], radius (S,) [m], and the link of each (S,)."""

    start: Array
    end: Array
    radius: Array
    link: Array

    @property
    def long(self) -> Array:
        """Return which capsules have a length in any posture, shape (S,), bool."""
        span = np.linalg.norm((self.end - self.start).reshape(-1, self.link.size, 3), axis=2)
        return np.asarray(span.max(axis=0, initial=0.0) > _SHORT)

    def of(self, which: Array) -> _Body:
        """Return some of the capsules; ``which`` has shape (S,), bool."""
        ends = self.start[..., which, :], self.end[..., which, :]
        return _Body(*ends, self.radius[which], self.link[which])


def body(robot: Robot, q: Array) -> _Body:
    """Return the arm's capsules in the measuring frame at positions (..., n) [rad or m]."""
    whole = _whole(robot, q)
    return whole.of(whole.long)


def _whole(robot: Robot, q: Array) -> _Body:
    """Return every line from base to tool as a capsule, those without a length too."""
    points, link = _line(robot, frames(robot, np.asarray(q, dtype=float)))
    whole = float(np.abs(robot.a).sum() + np.abs(robot.d).sum())
    radius = np.where(link == robot.n, _TORCH, _THICK * whole)
    return _Body(points[..., :-1, :], points[..., 1:, :], radius, link).of(link != _GROUND)


def _line(robot: Robot, chain: Frames) -> tuple[Array, Array]:
    """Return the points from base to tool, shape (..., S + 1, 3), and the link of every line."""
    points, link = [chain.base_point], []
    for k, row in enumerate(chain.rows):
        if 0 < k == robot.behind:
            points.append(chain.root_point)
            link.append(_GROUND)
        x, at, turned = (np.moveaxis(v, 0, -1) for v in (row.x, row.x_point, row.z_point))
        if robot.convention == 'standard':
            ends = [at - robot.a[k] * x, at]
            points += ends[::-1] if k < robot.behind else ends
            link += [k, k]
        else:
            # Its own z begins where its x ended; what lies before still belongs to the row before.
            points += [at, turned]
            link += [max(k - 1, 0), k]
    points += [chain.flange_point, chain.position]
    link += [robot.n - 1, robot.n]
    return np.stack(np.broadcast_arrays(*points), axis=-2), np.array(link)


def _clearances(shape: _Body) -> Array:
    """Return the gaps of links that are no neighbours, (..., pairs) [m]; below 0 they overlap."""
    share = np.linspace(0.0, 1.0, _PLACES)[:, None]
    along = shape.start[..., None, :] * (1.0 - share) + shape.end[..., None, :] * share
    out = []
    for i, j in combinations(range(shape.link.size), 2):
        if abs(int(shape.link[i]) - int(shape.link[j])) < 2:
            continue
        gap = along[..., i, :, None, :] - along[..., j, None, :, :]
        square = np.einsum('...i,...i->...', gap, gap).min(axis=(-1, -2))
        out.append(np.sqrt(square) - shape.radius[i] - shape.radius[j])
    empty = np.zeros((*shape.start.shape[:-2], 0))
    return np.stack(out, axis=-1) if out else empty


class Space:
    """
    Where an arm has room, asked again and again.

    seen: postures (K, n) [rad or m] that the arm was in: whatever is near there is no collision.
    box: corners in the measuring frame that the arm stays between, shape (2, 3) [m]. Without it an
    arm that stands upright stays above its foot, or above the lowest place that it was at.
    """

    def __init__(self, robot: Robot, seen: Array, box: Array | None = None) -> None:
        self._robot, self._box = robot, box
        self._known = _whole(robot, seen)
        self._usual: dict[bytes, Array] = {}
        self._up = robot.T_world_base[:3, :3] @ up(robot)
        # The floor tilts with a workpiece that the positioner moves.
        self._upright = not robot.behind and rising(robot) * up(robot)[2] > _UPRIGHT
        known = self._known.of(self._known.long)
        standing = float(robot.T_world_base[:3, 3] @ self._up)
        self._foot = min(standing, _lowest(known.end @ self._up).min())

    def free(self, q: Array) -> Array:
        """Return which postures (N, n) [rad or m] are free, shape (N,), bool."""
        whole = _whole(self._robot, q)
        long = np.logical_or(whole.long, self._known.long)
        asked = whole.of(long)
        # How near these capsules came in the postures that were seen.
        key = long.tobytes()
        if key not in self._usual:
            self._usual[key] = _clearances(self._known.of(long)).min(axis=0)
        near = np.minimum(self._usual[key], 0.0) - _ALIKE
        good = (_clearances(asked) >= near).all(axis=-1)
        ends = np.concatenate([asked.start[:, asked.link > 0], asked.end], axis=1)
        if self._box is not None:
            inside = (ends >= self._box[0]) & (ends <= self._box[1])
            return np.asarray(good & inside.all(axis=(1, 2)))
        if not self._upright:
            return np.asarray(good)
        return np.asarray(good & (_lowest(ends @ self._up) >= self._foot))


def _lowest(heights: Array) -> Array:
    """Return the least along the last axis; an arm whose links have no length is nowhere low."""
    return np.asarray(heights.min(axis=-1, initial=np.inf))
