# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A piece of chain as constant matrices times products of its joints' sines and cosines.

A row is ``A = A0 + A1 c + A2 s`` with the cosine and sine of its joint (``A0 + A2 q`` if the joint
slides), so a product of g rows is linear in the 3^g products that take one of (1, c, s) from every
joint. One matrix product with these *features* then gives poses of the piece, and, with the
generator of a turn put at its place among the factors, the derivative by any DH value.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..arrays import Array
from ..chain import Channel
from ..robot import Robot
from ..rotation import skew

HALF_ANGLE = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 2.0], [0.0, -2.0, 0.0]])
"""(1, c, s) = (1, u, v) @ HALF_ANGLE, with u and v as in `half_angle`."""


class Factor(NamedTuple):
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


def factors(robot: Robot, i: int) -> list[Factor]:
    """Return the factors of a row, from the base outward."""
    beta = _turn(1, np.cos(robot.beta[i]), np.sin(robot.beta[i]))
    alpha = _turn(0, np.cos(robot.alpha[i]), np.sin(robot.alpha[i]))
    joint = Factor(('theta', 'd'), 2, _joint(robot, i))
    if robot.convention == 'standard':
        link = Factor(('a', 'alpha'), 0, (_slide(0, robot.a[i]) @ alpha)[None])
        return [joint, link, Factor(('beta',), 1, beta[None])]
    twist, turn = Factor(('alpha',), 0, alpha[None]), Factor(('beta',), 1, beta[None])
    return [twist, turn, Factor(('a',), 0, _slide(0, robot.a[i])[None]), joint]


def product(matrices: list[Array]) -> Array:
    """Return the product of factors, shape (features, 4, 4), the last joint varying fastest."""
    out = np.eye(4)[None]
    for matrix in matrices:
        out = np.einsum('aij,bjk->abik', out, matrix).reshape(-1, *matrix.shape[1:])
    return out


def generator(axis: int) -> Array:
    """Return the generator of a turn about a coordinate axis, shape (4, 4)."""
    out = np.zeros((4, 4))
    out[:3, :3] = skew(np.eye(3)[axis])
    return out


def adjoint(matrices: Array) -> Array:
    """Return how matrices (k, 4, 4) of one factor act on screws (moment, axis), (k, 6, 6)."""
    out = np.zeros((len(matrices), 6, 6))
    turn, shift = matrices[:, :3, :3], matrices[:, :3, 3].copy()
    out[:, :3, :3] = out[:, 3:, 3:] = turn
    out[:, :3, 3:] = skew(shift[0]) @ turn
    shift[0] = 0.0  # only a sliding joint moves the origin, and it does not turn
    out[:, :3, 3:] += skew(shift) @ turn[0]
    return out


class Piece:
    """
    A run of rows with what stands before and after them.

    Parameters
    ----------
    robot : Robot
    rows : range
    before, after : array, shape (4, 4)
        Base or tool frame, where the piece begins or ends the chain.

    """

    def __init__(self, robot: Robot, rows: range, before: Array, after: Array) -> None:
        fixed = [Factor((), 0, before[None])]
        moving = [(i, factor) for i in rows for factor in factors(robot, i)]
        self.factors = [(-1, fixed[0]), *moving, (-1, Factor((), 0, after[None]))]

    def _place(self, channel: Channel) -> int:
        kind, row = channel
        return next(k for k, (i, f) in enumerate(self.factors) if i == row and kind in f.kinds)

    def poses(self) -> Array:
        """Return the weights of the pose, shape (features, 4, 4)."""
        return product([factor.matrices for _, factor in self.factors])

    def velocities(self, channels: list[Channel]) -> tuple[Array, Array]:
        """Return weights of the tip's velocity and of the axis, in the frame before the piece.

        Shape (features, 3, channels) both.
        """
        moved, axes = [], []
        for channel in channels:
            k = self._place(channel)
            matrices = [factor.matrices for _, factor in self.factors]
            axis = self.factors[k][1].axis
            moved.append(product([*matrices[:k], generator(axis)[None], *matrices[k:]])[:, :3, 3])
            axes.append(self._screw(k)[:, 3:])
        return _stack(moved), _stack(axes)

    def screws(self, channels: list[Channel]) -> tuple[Array, Array]:
        """Return weights of the moment about the origin and of the axis; shapes as above."""
        found = [self._screw(self._place(channel)) for channel in channels]
        return _stack([screw[:, :3] for screw in found]), _stack([s[:, 3:] for s in found])

    def _screw(self, place: int) -> Array:
        """Return the weights of the screw of a factor, shape (features, 6)."""
        unit = np.zeros((1, 6, 1))
        unit[0, 3 + self.factors[place][1].axis] = 1.0
        out = unit
        for k in range(len(self.factors) - 1, -1, -1):
            matrix = adjoint(self.factors[k][1].matrices)
            if k >= place:
                matrix = np.eye(6)[None] * (np.arange(len(matrix)) == 0)[:, None, None]
            out = np.einsum('aij,bjk->abik', matrix, out).reshape(-1, 6, 1)
        return out[..., 0]


def _stack(parts: list[Array]) -> Array:
    return np.stack(parts, axis=-1) if parts else np.zeros((0, 3, 0))


def on_half_angles(weights: Array, joints: int) -> Array:
    """Return weights of (1, c, s) features turned into weights of (1, u, v) features."""
    shape = weights.shape
    out = weights.reshape((3,) * joints + shape[1:])
    for axis in range(joints):
        out = np.moveaxis(np.tensordot(HALF_ANGLE, out, axes=(1, axis)), 0, axis)
    return out.reshape(shape)
