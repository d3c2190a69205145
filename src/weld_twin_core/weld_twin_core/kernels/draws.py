# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How far very many draws of the DH values move the tool along one seam, exactly.

A turn about the first axis keeps distances, so the first joint drops out. The rest is cut in two
pieces whose weights (see `weights`) are built for all draws of a block at once; one matrix product
each with the features of the points gives both, whatever the points are.

Along a smooth seam the features themselves are nearly dependent: as functions of the sample they
span a dozen dimensions to rounding. Positions of *any* draw are linear in them, hence known from
as many samples by one matrix product; for so few the tool point is carried down the chain. Those
samples and that matrix come from a pivoted QR factorisation of the features [1]_, whose remainder
bounds the error. Squared distances are linear in products of two features, which often span hardly
more: for the largest of them they too are worked out at a few samples only.

References
----------
.. [1] H. Cheng et al., "On the compression of low rank matrices", SIAM J. Sci. Comput. 26, 2005
   (the interpolative decomposition); of random mixtures: P.-G. Martinsson, V. Rokhlin, M. Tygert,
   "A randomized algorithm for the decomposition of matrices", ACHA 30, 2011.

"""

from __future__ import annotations

from collections.abc import Iterator
from math import prod
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr, solve_triangular

from ..arm.bulk.buffers import aligned, unbuffered
from ..arm.bulk.half_angle import sincos
from ..arm.robot import Robot
from ..arm.rotation import rotation_matrix
from ..arrays import Array
from ..errors import ModelError

_ROUNDING = 1e-14
"""Remainder of the features, relative to the strongest, that counts as none."""
_NEGLIGIBLE = 1e-13
"""Remainder up to which all samples are taken as determined by a few."""
_MIXTURES = 48
"""Mixtures that stand for all features; a motion with more independent ones is worked on whole."""
_BLOCK = 504
"""Draws whose weights are built at once."""
_POINTS = 8000
"""Draws times samples worked on at once; a few of such arrays fit the processor's cache..."""
_FOLLOWING = 16_000
"""... and twice as many where samples follow from others."""
_SPLIT = 3
"""Rows of the near piece, the first included, whose turn drops out."""


class DhDraws(NamedTuple):
    """Draws of the DH values of every row, shape (D, n) each [rad, m]."""

    theta: Array
    d: Array
    a: Array
    alpha: Array


class SeamDraws:
    """
    A robot of revolute joints at samples (N, n) [rad] of a seam, ready for draws of its DH values.

    Raises ModelError: it has modified rows, Hayati angles, joints that slide or a positioner.
    """

    def __init__(self, robot: Robot, q: Array) -> None:
        plain = robot.convention == 'standard' and not robot.behind
        if not plain or robot.prismatic.any() or robot.beta.any():
            raise ModelError(
                f'robot {robot.name!r} must have standard rows, revolute joints, no beta and no '
                'positioner for fast draws of its DH values; the twin runs draws of any robot'
            )
        self.robot = robot
        features = _features(q[:, 1:_SPLIT]), _features(q[:, _SPLIT:])
        self._count = len(q)
        turn = rotation_matrix(q[:, :1] * np.array([0.0, 0.0, 1.0]))
        self._first = robot.T_world_base[:3, :3] @ turn
        self.samples: NDArray[np.int_] = np.arange(len(q))
        """Those at which draws are worked out."""
        self.spread: Array | None = None
        self.remainder = 0.0
        """What the other samples' features differ from those that these determine, relative to the
        largest; 0 when all samples are worked on."""
        self._of_squares: _Determining | None = None
        both = (features[0][:, None] * features[1][None]).reshape(-1, len(q))
        result = _determining(both)
        if result is not None:
            self.samples, self.spread, self.remainder = result
            self._of_squares = _determining(_products(both))
        self._near, self._far = (np.ascontiguousarray(f[:, self.samples]) for f in features)
        self._phases = np.exp(1j * q[self.samples].T)[..., None]
        nominal = DhDraws(*(getattr(robot, key)[None] for key in DhDraws._fields))
        if self.spread is None:
            self._nominal = self._points(*self._pieces(nominal), aligned(5, 3 * len(q)))
        else:
            self._nominal = self._carried(nominal)

    def largest(self, draws: DhDraws) -> Array:
        """Return the largest distance from the nominal tool point along the seam, shape (D,)."""
        out = np.empty(len(draws.theta))
        with unbuffered():
            for part, squares in self._squares(draws, self._of_squares):
                squares.max(axis=1, out=out[part])
        return np.sqrt(out, out=out)

    def distances(self, draws: DhDraws) -> Array:
        """Return distances from the nominal tool point, shape (D, N) [m]."""
        out = np.empty((len(draws.theta), self._count))
        with unbuffered():
            for part, squares in self._squares(draws, None):
                np.sqrt(squares, out=out[part])
        return out

    def deviations(self, draws: DhDraws) -> Array:
        """Return the tool point's deviations from nominal in the world, (D, N, 3) [m]."""
        out = np.empty((len(draws.theta), self._count, 3))
        with unbuffered():
            for start in range(0, len(out), _BLOCK):
                part = slice(start, start + _BLOCK)
                away = self._away(DhDraws(*(values[part] for values in draws)))
                out[part] = np.einsum('nij,jdn->dni', self._first, away, optimize=True)
        return out

    def _away(self, draws: DhDraws) -> Array:
        """Return deviations before the first joint's turn, shape (3, D, N), of a few draws."""
        if self.spread is None:
            near, far = self._pieces(draws)
            memory = aligned(5, 3 * len(draws.theta) * self._count)
            return self._points(near, far, memory) - self._nominal
        few = self._carried(draws) - self._nominal
        return np.asarray((self.spread @ few).transpose(0, 2, 1))

    def _squares(
        self, draws: DhDraws, determining: _Determining | None
    ) -> Iterator[tuple[slice, Array]]:
        """
        Yield which draws, and their squared distances (some, N), which the next overwrite.

        From those at some samples, which is exact to rounding of the largest, or each by itself.
        """
        for start in range(0, len(draws.theta), _BLOCK):
            block = DhDraws(*(values[start : start + _BLOCK] for values in draws))
            if self.spread is None:
                parts = self._of_all(block)
            elif determining is None:
                parts = self._of_few(block, self.spread)
            else:
                parts = self._of_fewer(block, self.spread[determining.samples], determining.spread)
            for squares in parts:
                yield slice(start, start + len(squares)), squares
                start += len(squares)

    def _of_all(self, draws: DhDraws) -> Iterator[Array]:
        pieces = self._pieces(draws)
        step = max(1, _POINTS // self._count)
        memory = aligned(5, 3 * step * self._count)
        for k in range(0, len(draws.theta), step):
            near, far = (piece[..., k : k + step] for piece in pieces)
            away = self._points(near, far, memory)
            away -= self._nominal
            yield _squared(away)

    def _of_few(self, draws: DhDraws, spread: Array) -> Iterator[Array]:
        few = self._carried(draws) - self._nominal
        step = max(1, _FOLLOWING // self._count)
        memory = aligned(3, self._count * step)
        for k in range(0, few.shape[2], step):
            some = few[..., k : k + step]
            away = memory[:, : self._count * some.shape[2]].reshape(3, self._count, -1)
            yield _squared(np.matmul(spread, some, out=away)).T

    def _of_fewer(self, draws: DhDraws, spread: Array, squares: Array) -> Iterator[Array]:
        few = self._carried(draws) - self._nominal
        step = max(1, _FOLLOWING // self._count)
        memory = aligned(self._count * step)
        for k in range(0, few.shape[2], step):
            some = _squared(spread @ few[..., k : k + step])
            every = memory[: self._count * some.shape[1]].reshape(self._count, -1)
            yield np.matmul(squares, some, out=every).T

    def _carried(self, draws: DhDraws) -> Array:
        """Return tool points carried down the chain, two coordinates in one number, (3, S, D)."""
        rows = _Rows(draws)
        turns, twists = rows.cosine + 1j * rows.sine, rows.alpha_cosine + 1j * rows.alpha_sine
        yz, xy, spin = np.empty((3, len(self._phases[0]), draws.theta.shape[0]), dtype=complex)
        x, yz.real, yz.imag = self.robot.T_flange_tool[:3, 3]
        for i in range(self.robot.n - 1, -1, -1):
            yz *= twists[i]
            np.add(x, rows.a[i], out=xy.real)
            xy.imag = yz.real
            xy *= np.multiply(self._phases[i], turns[i], out=spin) if i > 0 else turns[i]
            x = xy.real
            yz.real = xy.imag
            yz.imag += rows.d[i]
        return np.stack([x, yz.real, yz.imag])

    def _pieces(self, draws: DhDraws) -> tuple[Array, Array]:
        """Return the weights of both pieces: frames (3, F, 4, D) and tips (3, F, 1, D)."""
        count, n = draws.theta.shape
        rows = _Rows(draws)
        tool = self.robot.T_flange_tool[:3, 3]
        tip = np.repeat(tool[:, None, None, None], count, axis=3)
        far = rows.carried(tip, range(n - 1, _SPLIT - 1, -1))
        start = np.zeros((3, 1, 4, count))
        start[[0, 1, 2], 0, [0, 1, 2]] = 1.0
        return rows.linked(rows.carried(start, range(_SPLIT - 1, 0, -1)), 0), far

    def _points(self, near: Array, far: Array, memory: Array) -> Array:
        """Return tool points before the first joint's turn, (3, D, S), in a fifth of memory."""
        tip = _on_features(far, self._far, memory[4])[:, 0]
        frame = _on_features(near, self._near, memory[:4].reshape(-1))
        out = frame[:, 3]
        for k in range(3):
            frame[:, k] *= tip[k]
            out += frame[:, k]
        return out


def _squared(away: Array) -> Array:
    """Return squared lengths of vectors, components first, which are overwritten."""
    away *= away
    away[0] += away[1]
    away[0] += away[2]
    squares: Array = away[0]
    return squares


def _turn(first: Array, second: Array, cosine: Array, sine: Array) -> None:
    """Turn two components in their plane, in place."""
    to_second, to_first = sine * first, sine * second
    first *= cosine
    first -= to_first
    second *= cosine
    second += to_second


class _Rows:
    """Builds the weights of pieces for all draws: vectors carried toward the base, row by row."""

    def __init__(self, draws: DhDraws) -> None:
        sine, cosine = sincos(np.concatenate([draws.theta.T, draws.alpha.T]))
        self.sine, self.alpha_sine = np.split(sine, 2)
        self.cosine, self.alpha_cosine = np.split(cosine, 2)
        self.d, self.a = draws.d.T, draws.a.T

    def linked(self, vectors: Array, i: int) -> Array:
        """
        Apply Rz(theta) Tz(d) Tx(a) Rx(alpha) of row i, the joint at zero, in place.

        Vectors are (3, features, k, D); the last of the k is a point, the others are directions.
        """
        x, y, z = vectors
        _turn(y, z, self.alpha_cosine[i], self.alpha_sine[i])
        z[0, -1] += self.d[i]
        x[0, -1] += self.a[i]
        _turn(x, y, self.cosine[i], self.sine[i])
        return vectors

    def carried(self, vectors: Array, rows: range) -> Array:
        """Return vectors before some rows, on the features (1, c, s) of their joints."""
        for i in rows:
            x, y, z = self.linked(vectors, i)
            _, features, *rest = vectors.shape
            vectors = np.empty((3, 3, features, *rest))
            vectors[:2, 0] = vectors[2, 1:] = 0.0
            vectors[2, 0] = z
            vectors[0, 1], vectors[1, 1] = x, y
            np.negative(y, out=vectors[0, 2])
            vectors[1, 2] = x
            vectors = vectors.reshape(3, 3 * features, *rest)
        return vectors


class _Determining(NamedTuple):
    samples: NDArray[np.int_]
    spread: Array
    remainder: float


def _determining(features: Array) -> _Determining | None:
    """
    Return samples, and the matrix (N, S) that turns values there into values everywhere.

    The factorisation is of random mixtures of the features, which depend on each other as the
    features do; the remainder is that of the features themselves. None if the samples are half of
    all or more.
    """
    mixing = np.random.default_rng(0).random((_MIXTURES, len(features))) - 0.5
    mixtures = mixing @ features
    upper, order = qr(mixtures, mode='r', pivoting=True, check_finite=False)
    strength = np.abs(np.diagonal(upper))
    rank = int((strength > _ROUNDING * strength[0]).sum())
    if 2 * rank >= features.shape[1]:
        return None
    spread = np.empty((rank, features.shape[1]))
    spread[:, order[:rank]] = np.eye(rank)
    spread[:, order[rank:]] = solve_triangular(upper[:rank, :rank], upper[:rank, rank:])
    remaining = np.abs(features[:, order[:rank]] @ spread - features).max()
    remainder = float(remaining / np.abs(features).max())
    if remainder > _NEGLIGIBLE:
        return None
    return _Determining(order[:rank], np.ascontiguousarray(spread.T), remainder)


def _products(features: Array) -> Array:
    """Return products of two random mixtures of features, somewhat more than are factorised."""
    mixing = np.random.default_rng(1).random((2, _MIXTURES + _MIXTURES // 4, len(features))) - 0.5
    first, second = mixing @ features
    return np.asarray(first * second)


def _features(q: Array) -> Array:
    """Return products of (1, c, s), shape (3^joints, N), the last joint varying fastest."""
    out = np.ones((1, len(q)))
    for angle in q.T[::-1]:
        own = np.stack([np.ones_like(angle), np.cos(angle), np.sin(angle)])
        out = (own[:, None] * out[None]).reshape(-1, len(q))
    return out


def _on_features(weights: Array, features: Array, memory: Array) -> Array:
    """Return weights (3, F, k, D) applied to features (F, S), shape (3, k, D, S)."""
    flat = weights.reshape(*weights.shape[:2], -1)
    shape = 3, flat.shape[2], features.shape[1]
    result = memory[: prod(shape)].reshape(shape)
    np.matmul(flat.swapaxes(1, 2), features, out=result)
    return result.reshape(3, *weights.shape[2:], -1)
