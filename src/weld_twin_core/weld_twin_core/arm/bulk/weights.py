# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A piece of chain as constant matrices times products of its joints' sines and cosines.

A row is ``A = A0 + A1 c + A2 s`` with the cosine and sine of its joint (``A0 + A2 q`` if the joint
slides), so a product of g rows is linear in the 3^g products that take one of (1, c, s) from every
joint. One matrix product with these *features* then gives poses of the piece, and, with the
generator of a turn put at its place among the factors, the derivative by any DH value.

Where along a chain a DH value acts says how little is needed for its screw. Before the first joint
turns, a screw stands still in the world; after the last one, in the tool: both follow from the pose
by a constant matrix. Up to the cut between the two pieces of `bulk_kernel`, a screw is linear in
the features of the near piece. Only the rest has to be carried by it.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from itertools import groupby
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...errors import ModelError
from ..channels import AXIS, TURNS, Channel, row_factors
from ..robot import Robot
from ..rotation import skew

_HALF_ANGLE = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 2.0], [0.0, -2.0, 0.0]])
"""(1, c, s) = (1, u, v) @ _HALF_ANGLE, with u and v as in `bulk_kernel`."""


_TURNS = np.stack([skew(axis) for axis in np.eye(3)])
"""Generators of turns about the coordinate axes, shape (3, 3, 3)."""


class _Factor(NamedTuple):
    """One of the factors of a row: which DH values it holds, which axis, and its matrices."""

    kinds: tuple[str, ...]
    axis: int
    matrices: Array
    """Shape (k, 4, 4): one constant matrix, or three on the features of the joint."""


def _turn(axis: int, cosine: float, sine: float, rest: float = 1.0) -> Array:
    """Return the turn about a coordinate axis, of which a part may be left out."""
    out = rest * np.eye(4)
    j, k = (axis + 1) % 3, (axis + 2) % 3
    out[[j, k], [j, k]] = cosine
    out[j, k], out[k, j] = -sine, sine
    return out


def _slide(axis: int, length: float) -> Array:
    out = np.eye(4)
    out[axis, 3] = length
    return out


def _joint(robot: Robot, i: int) -> Array:
    """Return Rz Tz of a row on the features (1, c, s) of its joint, shape (3, 4, 4)."""
    fixed = _turn(2, np.cos(robot.theta[i]), np.sin(robot.theta[i])) @ _slide(2, robot.d[i])
    if robot.prismatic[i]:
        moved = np.zeros((4, 4))
        moved[2, 3] = 1.0
        return np.stack([fixed, np.zeros((4, 4)), moved])
    parts = [_turn(2, 0.0, 0.0), _turn(2, 1.0, 0.0, 0.0), _turn(2, 0.0, 1.0, 0.0)]
    return np.stack(parts) @ fixed


def _factors(robot: Robot, i: int) -> list[_Factor]:
    """Return the factors of a row, from the base outward."""
    out = []
    for kinds in row_factors(robot.convention):
        axis = AXIS[kinds[0]]
        out.append(_Factor(kinds, axis, _joint(robot, i) if axis == 2 else _link(robot, i, kinds)))
    return out


def _link(robot: Robot, i: int, kinds: tuple[str, ...]) -> Array:
    """Return a constant factor of a row, shape (1, 4, 4): a slide, a turn or both on one axis."""
    out = np.eye(4)
    for kind in kinds:
        value = getattr(robot, kind)[i]
        turn = kind in TURNS
        own = (
            _turn(AXIS[kind], np.cos(value), np.sin(value)) if turn else _slide(AXIS[kind], value)
        )
        out = out @ own
    return out[None]


def _product(first: Array, second: Array) -> Array:
    """Return the product of two stacks of matrices, every one with every one, the last fastest."""
    out: Array = first[:, None] @ second[None]
    return out.reshape(-1, *out.shape[2:])


def _generator(axis: int) -> Array:
    """Return the generator of a turn about a coordinate axis, shape (4, 4)."""
    out = np.zeros((4, 4))
    out[:3, :3] = _TURNS[axis]
    return out


def _adjoint(matrices: Array) -> Array:
    """Return how matrices (k, 4, 4) of one factor act on screws (moment, axis), (k, 6, 6)."""
    out = np.zeros((len(matrices), 6, 6))
    turn, shift = matrices[:, :3, :3], matrices[:, :3, 3]
    out[:, :3, :3] = out[:, 3:, 3:] = turn
    out[:, :3, 3:] = np.tensordot(shift[0], _TURNS, 1) @ turn
    # Only a sliding joint moves the origin, and it does not turn.
    out[1:, :3, 3:] += np.tensordot(shift[1:], _TURNS, 1) @ turn[0]
    return out


class _Piece:
    """A run of factors, and the base or tool frame before and after them, (4, 4) each."""

    def __init__(self, run: Sequence[_Factor], before: Array, after: Array) -> None:
        self._factors = list(run)
        self._before = before[None]
        self._upto = [self._before]
        for factor in self._factors:
            self._upto.append(_product(self._upto[-1], factor.matrices))
        self._onward = [after[None]]
        for factor in reversed(self._factors):
            self._onward.append(_product(factor.matrices, self._onward[-1]))
        self._onward.reverse()

    def poses(self) -> Array:
        """Return the weights of the pose, shape (features, 4, 4)."""
        return _product(self._upto[-1], self._onward[-1])

    def velocities(self, turns: Sequence[tuple[int, int]]) -> Array:
        """Return weights of velocity and axis by turns before factors, (features, turns, 2, 3)."""
        out = np.zeros((len(self._upto[-1]), len(turns), 2, 3))
        for t, (k, axis) in enumerate(turns):
            turned = self._upto[k] @ _generator(axis)
            out[:, t, 0] = _product(turned, self._onward[k][:, :, 3:])[:, :3, 0]
            out[:, t, 1] = self._axis(k, axis)
        return out

    def screws(self, turns: Sequence[tuple[int, int]]) -> Array:
        """Return weights of moment about the origin and axis, shape (features, turns, 2, 3)."""
        acting = [_adjoint(self._before)]
        for factor in self._factors:
            acting.append(_product(acting[-1], _adjoint(factor.matrices)))
        out = np.zeros((len(self._upto[-1]), len(turns), 2, 3))
        for t, (k, axis) in enumerate(turns):
            out[:, t, 0] = self._all_features(acting[k][:, :3, 3 + axis])
            out[:, t, 1] = self._axis(k, axis)
        return out

    def _axis(self, place: int, axis: int) -> Array:
        return self._all_features(self._upto[place][:, :3, axis])

    def _all_features(self, weights: Array) -> Array:
        """Return weights on the features of all joints: the joints not yet met are left at 1."""
        out = np.zeros((len(weights), len(self._upto[-1]) // len(weights), weights.shape[1]))
        out[:, 0] = weights
        return out.reshape(-1, weights.shape[1])


def on_half_angles(weights: Array, joints: int) -> Array:
    """Return weights of (1, c, s) features turned into weights of (1, u, v) features."""
    out = weights
    for axis in range(joints):
        out = _HALF_ANGLE @ out.reshape(3**axis, 3, -1)
    return out.reshape(weights.shape)


ROWS = 13
"""Rows that hold a pose: columns x, y, z and origin, three components each, and 1."""
_ORIGIN = slice(9, 12)
"""Rows of a frame that hold its origin; the nine before hold its axes."""


class Region(Enum):
    """Stretches of the chain, from the base outward."""

    FIRST, NEAR, FAR, LAST = range(4)


class _Place(NamedTuple):
    """A DH value acts before some factor of the chain, about one of its coordinate axes."""

    before: int
    axis: int
    region: Region


class _Run(NamedTuple):
    """Channels of one region that follow each other; ``part`` counts them within the region."""

    region: Region
    channels: slice
    part: slice


class Division:
    """A robot's chain of factors, divided in two pieces at a joint, for some channels."""

    def __init__(self, robot: Robot, channels: Sequence[Channel]) -> None:
        self._robot = robot
        self._rows = [(i, factor) for i in range(robot.n) for factor in _factors(robot, i)]
        self._factors = [factor for _, factor in self._rows]
        self._moving = [k for k, f in enumerate(self._factors) if len(f.matrices) > 1]
        half = (robot.n + 1) // 2
        self.sizes = (half, robot.n - half)
        """Joints of either piece."""
        self._cut = self._moving[half] if half < robot.n else len(self._factors)
        self.near = _Piece(self._factors[: self._cut], robot.T_world_base, np.eye(4))
        self.far = _Piece(self._factors[self._cut :], np.eye(4), robot.T_flange_tool)
        self.places = [self._place(channel) for channel in channels]

    def _place(self, channel: Channel) -> _Place:
        kind, row = channel
        for before, (i, factor) in enumerate(self._rows):
            if i == row and kind in factor.kinds:
                return _Place(before, factor.axis, self._region(before))
        raise ModelError(
            f'channel {channel} is no DH value of robot {self._robot.name!r}, whose rows are 0 to '
            f'{self._robot.n - 1}'
        )

    def _region(self, before: int) -> Region:
        if before <= self._moving[0]:
            return Region.FIRST
        if before >= self._moving[-1]:
            return Region.LAST
        return Region.NEAR if before <= self._cut else Region.FAR

    def inner(self) -> dict[int, tuple[int, int]]:
        """Return where in the near piece channels act, and about which axes, by their number."""
        return {
            k: (p.before, p.axis) for k, p in enumerate(self.places) if p.region is Region.NEAR
        }

    def outer(self) -> list[tuple[int, int]]:
        """Return the same of the far piece, in the order of its channels."""
        return [(p.before - self._cut, p.axis) for p in self.places if p.region is Region.FAR]

    def runs(self) -> list[_Run]:
        """Return the channels as runs of one region each."""
        out, first, met = [], 0, dict.fromkeys(Region, 0)
        for region, places in groupby(place.region for place in self.places):
            count = len(list(places))
            part = slice(met[region], met[region] + count)
            out.append(_Run(region, slice(first, first + count), part))
            first += count
            met[region] += count
        return out

    def ends(self) -> dict[int, Array]:
        """Return, per channel at either end, the matrix (6, ROWS) from a pose to its screw."""
        of = {Region.FIRST: self._in_world, Region.LAST: self._in_tool}
        return {k: of[p.region](p) for k, p in enumerate(self.places) if p.region in of}

    def _in_world(self, place: _Place) -> Array:
        """Return the matrix of a screw that stands still in the world: m + axis x origin."""
        moment, axis = self.near.screws([(place.before, place.axis)])[0, 0]
        out = np.zeros((6, ROWS))
        out[:3, _ORIGIN] = np.cross(axis, np.eye(3)).T
        out[:3, 12], out[3:, 12] = moment, axis
        return out

    def _in_tool(self, place: _Place) -> Array:
        """Return the matrix of a screw still in the tool: it may as well act behind the joint."""
        after = np.eye(4)
        for factor in self._factors[max(place.before, self._moving[-1] + 1) :]:
            after = after @ factor.matrices[0]
        after = after @ self._robot.T_flange_tool
        twist = np.linalg.solve(after, _generator(place.axis) @ after)
        out = np.zeros((6, ROWS))
        out[:3, :9] = np.kron(twist[:3, 3], np.eye(3))
        out[3:, :9] = np.kron(after[place.axis, :3], np.eye(3))
        return out
