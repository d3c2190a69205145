# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A piece of chain as constant matrices times products of its joints' sines and cosines.

A row is ``A = A0 + A1 c + A2 s`` with the cosine and sine of its joint (``A0 + A2 q`` if the joint
slides), so a product of g rows is linear in the 3^g products that take one of (1, c, s) from every
joint. One matrix product with these *features* then gives poses of the piece, and, with the
generator of a turn put at its place among the factors, the derivative by any DH value.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ..channels import AXIS, TURNS, row_factors
from ..robot import Robot
from ..rotation import skew

_HALF_ANGLE = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 2.0], [0.0, -2.0, 0.0]])
"""(1, c, s) = (1, u, v) @ _HALF_ANGLE, with u and v as in `half_angle`."""


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


def factors(robot: Robot, i: int) -> list[_Factor]:
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


def generator(axis: int) -> Array:
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


class Piece:
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
            turned = self._upto[k] @ generator(axis)
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
