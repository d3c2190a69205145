# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Poses, Jacobians and derivatives by DH values of many joint positions.

The chain is cut in two pieces. Each is a small matrix product of constant `weights` with products
of sines and cosines; nine multiplications for each output vector put them together. All of it
runs over blocks of poses that stay in the processor's cache, in memory that is used again.
`chain` says the same in plain form.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from threading import get_ident

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..chain import Channel
from ..errors import ModelError
from ..robot import Robot
from .buffers import aligned
from .half_angle import DEGREE, HalfAngle
from .weights import Piece, on_half_angles

BLOCK = 1000
"""Poses worked on at once; the working memory of a six-joint arm then fits a cache of 2 MB."""

POSE = 12
"""Outputs that make up a pose; those of the channels follow."""
LENGTHS = 4
"""Lengths of blocks whose working memory a kernel keeps."""


class BulkKernel:
    """
    The chain of one robot, prepared for many joint positions.

    Parameters
    ----------
    robot : Robot
    channels : sequence of Channel
        DH values whose screws `screws` gives, in the order of the rows: 'theta', 'alpha', 'beta'
        and 'a' are turns about the axis that 'theta' and 'd', 'alpha', 'beta' and 'a' act on.
    block : int
        Poses worked on at once; a multiple of 8 is best.

    Raises
    ------
    ModelError
        The channels are not in the order of the rows.

    Notes
    -----
    A kernel owns its working memory, so one kernel serves one thread at a time.

    """

    def __init__(self, robot: Robot, channels: Sequence[Channel] = (), block: int = BLOCK) -> None:
        self.robot = robot
        self.channels = tuple(channels)
        self.block = block
        cut = (robot.n + 1) // 2
        self.sizes = (cut, robot.n - cut)
        near = Piece(robot, range(cut), robot.T_world_base, np.eye(4))
        far = Piece(robot, range(cut, robot.n), np.eye(4), robot.T_flange_tool)
        inner = [c for c in self.channels if c[1] < cut]
        outer = [c for c in self.channels if c[1] >= cut]
        if inner + outer != list(self.channels):
            raise ModelError(f'channels must be in the order of the rows, got {self.channels}')
        self.counts = (len(inner), len(outer))
        self._weights = (
            self._rows(_columns(near.poses()), *near.screws(inner), joints=cut),
            self._rows(_columns(far.poses()), *far.velocities(outer), joints=robot.n - cut),
        )
        self._memory: dict[int, _Memory] = {}

    @staticmethod
    def _rows(*weights: Array, joints: int) -> Array:
        """Return weights with one row for every output, shape (outputs, features)."""
        flat = [w.reshape(len(w), w[0].size) for w in weights if w.size]
        return np.ascontiguousarray(on_half_angles(np.concatenate(flat, axis=1), joints).T)

    def poses(self, q: Array, out: Array | None = None) -> Array:
        """
        Return tool poses ``T_world_tool``, shape (N, 4, 4), of joint positions (N, n).

        Parameters
        ----------
        q : array, shape (N, n) [rad or m]
        out : array, shape (N, 4, 4), optional
            Where they are written to; contiguous.

        Raises
        ------
        ModelError
            ``out`` is of another shape or not contiguous.

        """
        out = _poses_like(q, out)
        for part in self._blocks(len(q)):
            self._pose_block(q[part], out[part], POSE)
        return out

    def screws(
        self, q: Array, poses: Array | None = None, out: Array | None = None
    ) -> tuple[Array, Array]:
        """
        Return tool poses and how the tool turns with each channel, shape (6, channels, N).

        Velocity of the tool point [m/rad] first, then the axis. A channel that slides moves the
        tool point along the axis of its screw: what `chain.column` gives for 'd' is rows 3 to 5
        of the screw of 'theta', and 'a' goes with 'alpha' likewise. ``poses`` and ``out`` are
        where both are written to, as in `poses`.
        """
        poses = _poses_like(q, poses)
        out = aligned(6, len(self.channels), len(q)) if out is None else out
        for part in self._blocks(len(q)):
            memory = self._pose_block(q[part], poses[part], None)
            self._screw_block(memory, out[:, :, part])
        return poses, out

    def _blocks(self, count: int) -> list[slice]:
        """Return blocks of one length; the last overlaps the one before rather than be short."""
        size = min(self.block, count)
        starts = [*range(0, count - size + 1, size)] if count else []
        if count % max(size, 1):
            starts.append(count - size)
        return [slice(start, start + size) for start in starts]

    def _pose_block(self, q: Array, out: Array, rows: int | None) -> _Memory:
        """Write poses; of the weights only so many rows are used."""
        n = len(q)
        if n not in self._memory:
            if len(self._memory) == LENGTHS:
                self._memory.pop(next(k for k in self._memory if k != self.block))
            self._memory[n] = _Memory(self, n)
        memory = self._memory[n]
        memory.fill(q, self.robot.prismatic)
        for weights, features, piece in zip(
            self._weights, memory.features, memory.pieces, strict=True
        ):
            np.matmul(weights[:rows], features, out=piece[:rows])
        near, far = (piece[:POSE].reshape(4, 3, n) for piece in memory.pieces)
        sums = memory.sums
        np.multiply(far.swapaxes(0, 1)[:, :, None], near[:3, None], sums[:36].reshape(3, 4, 3, n))
        sums[36:39] = near[3]
        sums[39] = 1.0
        np.matmul(sums.T, _GATHER, out=out.reshape(n, 16))
        return memory

    def _screw_block(self, memory: _Memory, out: Array) -> None:
        near, far = memory.pieces
        inner, outer = self.counts
        n = near.shape[1]
        if inner:
            tip = memory.sums[9:12] + memory.sums[21:24]
            tip += memory.sums[33:36]
            tip += memory.sums[36:39]
            moment, axis = near[POSE:].reshape(2, 3, inner, n)
            _velocity(moment, axis, tip, out[:3, :inner], memory.spares(inner, n))
            out[3:, :inner] = axis
        if outer:
            turn = near[:9].reshape(3, 3, 1, n)
            total, part = memory.spares(3 * outer, n).reshape(2, 3, outer, n)
            vectors = far[POSE:].reshape(2, 3, outer, n)
            for vector, target in zip(vectors, (out[:3, inner:], out[3:, inner:]), strict=True):
                np.multiply(turn[0], vector[0], total)
                np.multiply(turn[1], vector[1], part)
                np.add(total, part, total)
                np.multiply(turn[2], vector[2], part)
                np.add(total, part, target)


def kernel_of(robot: Robot, channels: tuple[Channel, ...] = ()) -> BulkKernel:
    """Return a kernel of this thread, the same when asked for again: they take time to prepare."""
    return _kept(robot, channels, get_ident())


@lru_cache(maxsize=8)
def _kept(robot: Robot, channels: tuple[Channel, ...], thread: int) -> BulkKernel:
    return BulkKernel(robot, channels)


def _poses_like(q: Array, out: Array | None) -> Array:
    if out is None:
        return np.empty((len(q), 4, 4))
    if out.shape != (len(q), 4, 4) or not out.flags.c_contiguous:
        raise ModelError(
            f'poses of {len(q)} joint positions need a contiguous array of shape '
            f'({len(q)}, 4, 4) to be written to, got {out.shape}'
        )
    return out


def _columns(poses: Array) -> Array:
    """Return the columns x, y, z and origin of weights of poses, shape (features, 4, 3)."""
    columns: Array = poses[:, :3].swapaxes(1, 2)
    return columns


def _velocity(moment: Array, axis: Array, tip: Array, out: Array, spare: Array) -> None:
    """Write moment + axis x tip; shapes (3, channels, N), tip (3, N), spare (2, channels, N)."""
    plus, minus = spare
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        np.multiply(axis[i], tip[j], plus)
        np.multiply(axis[j], tip[i], minus)
        np.subtract(plus, minus, plus)
        np.add(moment[k], plus, out[k])


def _gather() -> Array:
    """Return the matrix that adds the products up to rows of a 4 x 4 matrix, shape (40, 16)."""
    out: Array = np.zeros((40, 4, 4))
    for i in range(3):
        for j in range(4):
            out[[12 * k + 3 * j + i for k in range(3)], i, j] = 1.0
        out[36 + i, i, 3] = 1.0
    out[39, 3, 3] = 1.0
    return out.reshape(40, 16)


_GATHER = _gather()


class _Memory:
    """
    Working memory for blocks of one length.

    The powers of the angles, the features made of them and the products of the pieces are needed
    one after the other, so they share the same memory: what fits the cache counts for more than
    what is computed.
    """

    def __init__(self, kernel: BulkKernel, n: int) -> None:
        joints = kernel.robot.n
        self.sizes = kernel.sizes
        rows = [3**size for size in kernel.sizes]
        spare = 6 * max(kernel.counts)
        shared = aligned(max((DEGREE + 1) * joints, sum(rows), 40, spare), n)
        powers = shared[: (DEGREE + 1) * joints].reshape(DEGREE + 1, joints * n)
        self.half = HalfAngle(joints, n, powers=powers)
        self.own = aligned(2, joints, n)
        self.features = (shared[: rows[0]], shared[rows[0] : sum(rows)])
        self.pieces = tuple(aligned(len(w), n) for w in kernel._weights)
        self.sums = shared[:40]
        self._shared = shared

    def spares(self, rows: int, n: int) -> Array:
        """Return shared memory as two arrays of some rows, shape (2, rows, n)."""
        return self._shared[: 2 * rows].reshape(2, rows, n)

    def fill(self, q: Array, prismatic: NDArray[np.bool_]) -> None:
        """Compute the products of (1, u, v) of the joints of each piece."""
        sine, cosine = self.half(q.T)
        np.multiply(cosine, sine, self.own[0])
        np.multiply(sine, sine, self.own[1])
        if prismatic.any():
            self.own[0, prismatic] = 0.5 * q.T[prismatic]  # stands in for sin x = 2 u
            self.own[1, prismatic] = 0.0
        first = 0
        for size, features in zip(self.sizes, self.features, strict=True):
            features[0] = 1.0
            width = 1
            for i in range(first + size - 1, first - 1, -1):
                wide = features[width : 3 * width].reshape(2, width, -1)
                np.multiply(self.own[:, i, None], features[:width], wide)
                width *= 3
            first += size
