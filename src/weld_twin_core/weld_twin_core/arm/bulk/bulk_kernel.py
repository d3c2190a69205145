# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Poses, Jacobians and derivatives by DH values of many joint positions.

The chain is cut in two pieces. Each is a small matrix product of constant `weights` with products
of sines and cosines; nine multiplications for each vector put them together, where `regions` knows
no shorter way. All of it runs over blocks of poses that stay in the processor's cache, in memory
that is used again. `chain` says the same in plain form.

Sine and cosine come from half the angle, several times as fast as numpy's, which take one by one.
Two features do for everything that is linear in 1, sin x and cos x::

    u = sin(x/2) cos(x/2),  v = sin(x/2)^2,  sin x = 2 u,  cos x = 1 - 2 v

Where numpy has a vectorised tangent (AVX-512), t = tan(x/2) gives u = t / (1 + t^2) and v = t u.
Elsewhere an angle is counted in turns, reduced to r in [-1/2, 1/2], and sin(pi r) = r S(r^2) and
cos(pi r) = C(r^2) are polynomials of degree 8: Chebyshev series, cut where what is left is below
the last digit, written in powers, so that they are array products and one small matrix product.
Their products are the same for x + 2 pi, so that the sign lost in the reduction does not matter.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from math import prod
from threading import get_ident

import numpy as np

from ...arrays import Array
from ...errors import ModelError
from ..channels import Channel
from ..robot import Robot
from .weights import ROWS, Division, Region, on_half_angles

_CACHE_LINE = 64
"""Bytes; arrays begin at a multiple of it."""
_SHORT = 512
"""Numbers in numpy's buffer while rows are worked on."""


def aligned(*shape: int) -> Array:
    """
    Return memory, not yet filled, that begins on a cache line.

    numpy begins large arrays 16 bytes after one; every vector store then straddles two lines and
    costs twice as much. Rows stay aligned when their length is a multiple of 8.
    """
    size = prod(shape) * 8
    raw = np.empty(size + _CACHE_LINE, dtype=np.uint8)
    start = -raw.ctypes.data % _CACHE_LINE
    return raw[start : start + size].view(np.float64).reshape(shape)


@contextmanager
def unbuffered() -> Iterator[None]:
    """
    Have numpy work on rows of more than a few hundred numbers where they are.

    Where operands are not one contiguous run, numpy 2 copies rows shorter than half its buffer of
    8192 numbers into it and back, though nothing has to be converted: four times the work. With a
    buffer that is shorter than a row it does not.
    """
    usual = np.setbufsize(_SHORT)
    try:
        yield
    finally:
        np.setbufsize(usual)


_SINE = (
    3.141592653589793,
    -5.167712780049969,
    2.5501640398773007,
    -0.599264529318946,
    0.08214588657312355,
    -0.007370430506093225,
    0.00046629981702308817,
    -2.1903499125519212e-05,
    7.697847275590284e-07,
)
"""Coefficients of sin(pi x) / x in powers of x^2."""
_COSINE = (
    1.0,
    -4.934802200544676,
    4.058712126416498,
    -1.335262768843456,
    0.23533063012967062,
    -0.02580688873817758,
    0.001929556278037417,
    -0.00010456656706174584,
    4.149578027057121e-06,
)
"""Coefficients of cos(pi x) in powers of x^2."""
DEGREE = len(_COSINE) - 1
"""Of the polynomials, in the square of the angle."""
_POLYNOMIALS = np.array([_COSINE, _SINE])


def _tangent_is_vectorised() -> bool:
    """Tell whether this numpy, on this processor, takes many tangents at once."""
    introspect = getattr(np.lib, 'introspect', None)  # since numpy 2.1
    if introspect is None:
        return False
    result = introspect.opt_func_info(func_name='^tan$', signature='float64')
    kernel = result.get('tan', {}).get('dd', {}).get('current', '')
    return bool(kernel.startswith(('AVX512', 'X86_V4')))


_BY_TANGENT = _tangent_is_vectorised()


class HalfAngle:
    """
    Takes the features (u, v) of many angles, in memory that is free between calls.

    powers: shape (DEGREE + 1, size). own: shape (3, size); the result is part of it.
    """

    def __init__(
        self,
        *shape: int,
        powers: Array | None = None,
        own: Array | None = None,
        by_tangent: bool = _BY_TANGENT,
    ) -> None:
        self.shape = shape
        size = int(np.prod(shape))
        self._powers = aligned(DEGREE + 1, size) if powers is None else powers
        self._own = aligned(3, size) if own is None else own
        self._fill = self._from_tangents if by_tangent else self._from_polynomials

    def __call__(self, angles: Array) -> Array:
        """Return u and v of angles [rad], shape (2, *shape); the next call overwrites them."""
        self._fill(angles)
        return self._own[1:].reshape(2, *self.shape)

    def _from_tangents(self, angles: Array) -> None:
        t, u, v = self._own
        np.multiply(angles, 0.5, out=t.reshape(self.shape))
        np.tan(t, out=t)
        np.multiply(t, t, out=v)
        v += 1.0
        np.divide(t, v, out=u)
        np.multiply(t, u, out=v)

    def _from_polynomials(self, angles: Array) -> None:
        power, (r, cosine, sine) = self._powers, self._own
        np.multiply(angles, 0.5 / np.pi, out=r.reshape(self.shape))
        power[0] = 1.0
        np.rint(r, out=power[1])
        np.subtract(r, power[1], out=r)
        np.multiply(r, r, out=power[1])
        np.multiply(power[1], power[1], out=power[2])
        np.multiply(power[1:3], power[2], out=power[3:5])
        np.multiply(power[1:5], power[4], out=power[5:9])
        np.matmul(_POLYNOMIALS, power, out=self._own[1:])
        np.multiply(sine, r, out=sine)
        np.multiply(cosine, sine, out=cosine)
        np.multiply(sine, sine, out=sine)


_BLOCK = 1504
"""Poses worked on at once; the working memory of a six-joint arm then fits a cache of 2 MB."""

_POSE = 12
"""Rows that make up the pose of a piece; in the far piece those of its screws come before."""
_LENGTHS = 4
"""Lengths of blocks whose working memory a kernel keeps."""


class BulkKernel:
    """
    The chain of one robot, prepared for many joint positions.

    channels: DH values whose screws `screws` gives: 'theta', 'alpha', 'beta' and 'a' are turns
    about the axis that 'theta' and 'd', 'alpha', 'beta' and 'a' act on. Quickest in the order in
    which they come along the chain.

    Notes
    -----
    A kernel owns its working memory, so one kernel serves one thread at a time.

    """

    def __init__(self, robot: Robot, channels: Sequence[Channel] = ()) -> None:
        self.robot = robot
        self.channels = tuple(channels)
        division = Division(robot, self.channels)
        outer = division.outer()
        self.sizes, self.turned = division.sizes, len(outer)
        self._runs, self._ends = division.runs(), division.ends()
        near, far = division.near, division.far
        self._near_pose = _on_features(self.sizes[0], _columns(near.poses()))
        inner = division.inner()
        near_screws = near.screws(list(inner.values()))
        self._near_screws = {
            k: _trimmed(_on_features(self.sizes[0], near_screws[:, t]))
            for t, k in enumerate(inner)
        }
        self._far = np.concatenate(
            [
                _on_features(self.sizes[1], far.velocities(outer)),
                _on_features(self.sizes[1], _columns(far.poses())),
            ]
        )
        self._memory: dict[int, _Memory] = {}

    def poses(self, q: Array, out: Array | None = None) -> Array:
        """Return tool poses (N, 4, 4) of joints (N, n), in ``out`` if given; ModelError for shapes."""
        out = self._poses_like(q, out)
        with unbuffered():
            for part in self._blocks(len(q)):
                self._pose_block(q[part], out[part])
        return out

    def screws(
        self, q: Array, poses: Array | None = None, out: Array | None = None
    ) -> tuple[Array, Array]:
        """
        Return tool poses and how the tool turns with each channel, shape (6, channels, N).

        Velocity of the tool point [m/rad] first, then the axis. A channel that slides moves the
        tool point
        along the axis of its screw: what `chain.column` gives for 'd' is rows 3 to 5 of the screw
        of 'theta', and 'a' goes with 'alpha' likewise in standard rows. Both are written to arrays
        that are given, of which that of the poses must be contiguous; raises ModelError where a
        shape is wrong.
        """
        poses = self._poses_like(q, poses)
        shape = 6, len(self.channels), len(q)
        out = aligned(*shape) if out is None else out
        if out.shape != shape:
            raise ModelError(f'screws need an array of shape {shape}, got {out.shape}')
        with unbuffered():
            for part in self._blocks(len(q)):
                memory = self._pose_block(q[part], poses[part], out[:, :, part])
                self._screw_block(memory, out[:, :, part])
        return poses, out

    def _poses_like(self, q: Array, out: Array | None) -> Array:
        if q.ndim != 2 or q.shape[1] != self.robot.n:
            raise ModelError(
                f'joint positions of robot {self.robot.name!r} are of shape (N, {self.robot.n}), '
                f'got {q.shape}'
            )
        if out is None:
            return aligned(len(q), 4, 4)
        if out.shape != (len(q), 4, 4) or not out.flags.c_contiguous:
            raise ModelError(
                f'poses of {len(q)} joint positions need a contiguous array of shape '
                f'({len(q)}, 4, 4) to be written to, got {out.shape}'
            )
        return out

    def _blocks(self, count: int) -> list[slice]:
        """Return blocks of one length; the last overlaps the one before rather than be short."""
        size = min(_BLOCK, count)
        starts = [*range(0, count - size + 1, size)] if count else []
        if count % max(size, 1):
            starts.append(count - size)
        return [slice(start, start + size) for start in starts]

    def _pose_block(self, q: Array, out: Array, screws: Array | None = None) -> _Memory:
        """Write poses; if wanted, leave screws in memory and, of near ones, moment and axis in place."""
        n = len(q)
        if n not in self._memory:
            if len(self._memory) == _LENGTHS:
                self._memory.pop(next(k for k in self._memory if k != _BLOCK))
            self._memory[n] = _Memory(self, n)
        memory = self._memory[n]
        memory.fill(q)
        features, (near_rows, far_rows) = memory.features, memory.pieces
        np.matmul(self._near_pose, features[0], out=near_rows)
        if screws is None:
            np.matmul(self._far[-_POSE:], features[1], out=far_rows[-_POSE:])
        else:
            np.matmul(self._far, features[1], out=far_rows)
            for k, weights in self._near_screws.items():
                np.matmul(weights, features[0][: weights.shape[1]], out=screws[:, k])
        near, far = near_rows.reshape(4, 3, n), far_rows[-_POSE:].reshape(4, 3, n)
        products = memory.products
        np.multiply(far.swapaxes(0, 1)[:, :, None], near[:3, None], products)
        pose = products[0]
        pose += products[1]
        pose += products[2]
        pose[3] += near[3]
        memory.pose[_POSE] = 1.0
        np.matmul(memory.pose.T, _SPREAD, out=out.reshape(n, 16))
        return memory

    def _screw_block(self, memory: _Memory, out: Array) -> None:
        near, far = memory.pieces
        n = near.shape[1]
        velocities = far[:-_POSE].reshape(self.turned, 2, 3, n).transpose(2, 1, 0, 3)
        turn = near[:9].reshape(3, 3, 1, 1, n)
        for region, channels, part in self._runs:
            wanted = out[:, channels].reshape(2, 3, -1, n)
            if region is Region.NEAR:
                spare = memory.spare(2, wanted.shape[2], n)
                _add_velocity(wanted[1], memory.pose[9:12], wanted[0], spare)
            elif region is Region.FAR:
                spare = memory.spare(2, 3, 2, wanted.shape[2], n)
                _turned(turn, velocities[:, :, part], wanted.swapaxes(0, 1), spare)
            else:
                for k in range(channels.start, channels.stop):
                    np.matmul(self._ends[k], memory.pose, out=out[:, k])


def kernel_of(robot: Robot, channels: tuple[Channel, ...] = ()) -> BulkKernel:
    """Return a kernel of this thread, the same when asked for again: they take time to prepare."""
    return _kept(robot, channels, get_ident())


@lru_cache(maxsize=8)
def _kept(robot: Robot, channels: tuple[Channel, ...], thread: int) -> BulkKernel:
    return BulkKernel(robot, channels)


def _columns(poses: Array) -> Array:
    """Return the columns x, y, z and origin of weights of poses, shape (features, 4, 3)."""
    columns: Array = poses[:, :3].swapaxes(1, 2)
    return columns


def _on_features(joints: int, weights: Array) -> Array:
    """Return weights, a row for every output; features with the last joints at 1 come first."""
    flat = on_half_angles(weights.reshape(len(weights), -1), joints).T
    every = flat.reshape(-1, *[3] * joints)
    reverse = (0, *range(joints, 0, -1))
    return np.ascontiguousarray(every.transpose(reverse).reshape(flat.shape))


def _trimmed(weights: Array) -> Array:
    """Return weights without the features behind the last they need."""
    used = int(np.flatnonzero(weights.any(axis=0))[-1]) + 1
    return np.ascontiguousarray(weights[:, :used])


def _add_velocity(axis: Array, tip: Array, out: Array, spare: Array) -> None:
    """Add axis x tip to moments; shapes (3, channels, N), tip (3, N), spare (2, channels, N)."""
    plus, minus = spare
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        np.multiply(axis[i], tip[j], plus)
        np.multiply(axis[j], tip[i], minus)
        np.subtract(plus, minus, plus)
        np.add(out[k], plus, out[k])


def _turned(turn: Array, vectors: Array, out: Array, spare: Array) -> None:
    """Write the turn, columns first, of vectors (3, 2, channels, N); spare has two such arrays."""
    total, part = spare
    np.multiply(turn[0], vectors[0], total)
    np.multiply(turn[1], vectors[1], part)
    np.add(total, part, total)
    np.multiply(turn[2], vectors[2], part)
    np.add(total, part, out)


def _spread() -> Array:
    """Return the matrix that puts the rows of a pose into a 4 x 4 matrix, shape (ROWS, 16)."""
    out: Array = np.zeros((ROWS, 4, 4))
    for i in range(3):
        for j in range(4):
            out[3 * j + i, i, j] = 1.0
    out[_POSE, 3, 3] = 1.0
    return out.reshape(ROWS, 16)


_SPREAD = _spread()


class _Memory:
    """
    Working memory for blocks of one length.

    What is needed one after the other shares memory, since what fits the cache counts for more
    than what is computed: the powers of the angles, the features made of them and the products of
    the pieces; sines and cosines, and the pieces.
    """

    def __init__(self, kernel: BulkKernel, n: int) -> None:
        joints = kernel.robot.n
        self.sizes = kernel.sizes
        self.sliding = [int(i) for i in np.flatnonzero(kernel.robot.prismatic)]
        rows = [3**size for size in kernel.sizes]
        outputs = _POSE, len(kernel._far)
        near = len(kernel._near_screws)
        spare = max(2 * near, 12 * kernel.turned)
        first = max((DEGREE + 1) * joints, sum(rows), 3 * _POSE, ROWS + spare)
        memory = aligned(first + max(3 * joints, sum(outputs)), n)
        shared, rest = memory[:first], memory[first:]
        powers = shared[: (DEGREE + 1) * joints].reshape(DEGREE + 1, joints * n)
        own = rest[: 3 * joints].reshape(3, joints * n)
        self.half = HalfAngle(joints, n, powers=powers, own=own)
        self.features = (shared[: rows[0]], shared[rows[0] : sum(rows)])
        self.pieces = (rest[: outputs[0]], rest[outputs[0] : sum(outputs)])
        self.products = shared[: 3 * _POSE].reshape(3, 4, 3, n)
        self.pose = shared[:ROWS]
        self._spare = shared[ROWS:].reshape(-1)

    def spare(self, *shape: int) -> Array:
        """Return memory that is free once the pose is there."""
        return self._spare[: prod(shape)].reshape(shape)

    def fill(self, q: Array) -> None:
        """Compute the products of (1, u, v) of the joints of each piece."""
        own = self.half(q.T)
        for i in self.sliding:
            own[:, i] = 0.5 * q[:, i], np.zeros(len(q))  # stands in for sin x = 2 u
        first = 0
        for size, features in zip(self.sizes, self.features, strict=True):
            features[0] = 1.0
            width = 1
            for i in range(first, first + size):
                wide = features[width : 3 * width].reshape(2, width, -1)
                np.multiply(own[:, i, None], features[:width], wide)
                width *= 3
            first += size
