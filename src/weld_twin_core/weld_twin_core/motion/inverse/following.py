# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
One posture followed along a path, from a few of its poses: what most paths need, and quick.

Newton's method closes a few knots. Polynomials through them, of the joint positions and of the
matrix that turns a gap of the pose into a joint step, then serve all samples at once: a step of
that matrix takes away all but the square of what the polynomial misses. Where that does not
converge at once the path is halved, and in case of doubt nothing is returned.

References
----------
.. [1] J.-P. Berrut, L. N. Trefethen, "Barycentric Lagrange interpolation", SIAM Review 46, 2004.

"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ...arm.bulk import BulkKernel, kernel_of
from ...arm.robot import Robot
from ...arm.rotation import skew
from ...arrays import Array

LEAP = 0.5
"""Joint step [rad] between neighbours that calls for a second look."""
_KNOTS = 16
"""Knots of the polynomials through which the rest of a smooth seam is guessed."""
_SHORT = 2 * _KNOTS
"""Samples below which polynomials through knots would say nothing about those between them."""
_LONG = 2000
"""Samples worked on at once."""
_NEAR = 0.1
"""Distance [rad or m] from the seed up to which no other posture is looked for."""
_SMOOTH = 0.02
"""Correction [rad or m] beyond which the polynomial is not taken for the posture's own."""
_STIFF = 1e3
"""Joint motion per motion of the tool that is too near a singularity."""
_CLOSED = 1e-12
"""Gap [m, rad] that is rounding."""
_ROUGH = 1e-4
"""Gap of a knot [m, rad] after which one more step is enough."""
_ROUNDS = 8
"""Newton's steps at most; a seam that needs more is followed point by point."""


def follow(robot: Robot, poses: Array, seed: Array) -> Array | None:
    """
    Return joint positions (N, 6) that start near a seed (6,) and go on without a jump.

    None where they do not start there, reach a limit, come near a singularity, or leave any other
    doubt; also for few poses (N, 4, 4), or an arm that does not have six joints. The polynomials
    are over the samples, which are evenly spaced by and large.
    """
    if robot.n != 6 or len(poses) < _SHORT:
        return None
    kernel = kernel_of(robot, tuple(('theta', i) for i in range(6)))
    q = _piece(kernel, poses, seed)
    if q is None or (q < robot.lower).any() or (q > robot.upper).any():
        return None
    return q if np.abs(q[1:] - q[:-1]).max() < LEAP else None


def _piece(kernel: BulkKernel, poses: Array, start: Array) -> Array | None:
    """Follow a piece of the path, in halves where it does not go at once."""
    half = len(poses) // 2
    if len(poses) <= _LONG:
        index, spread = _knots(len(poses))
        result = _closed_knots(kernel, poses[index], start)
        q = None if result is None else _corrected(kernel, poses, spread, *result)
        if q is not None or half < _SHORT:
            return q
    before = _piece(kernel, poses[: half + 1], start)
    if before is None:
        return None
    after = _piece(kernel, poses[half:], before[-1])
    return None if after is None else np.concatenate([before, after[1:]])


@lru_cache(maxsize=16)
def _knots(count: int) -> tuple[NDArray[np.intp], Array]:
    """Return which samples are knots, nearest Chebyshev's, and the matrix (N, K) to all others [1]_."""
    part = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, _KNOTS))
    index = np.unique(np.rint(part * (count - 1)).astype(int))
    apart = (index[:, None] - index) * (4.0 / count)
    np.fill_diagonal(apart, 1.0)
    away = np.arange(float(count))[:, None] - index
    away[index, np.arange(len(index))] = 1.0
    spread = 1.0 / (away * apart.prod(axis=1))
    spread /= spread.sum(axis=1, keepdims=True)
    spread[index] = np.eye(len(index))
    return index, spread


def _closed_knots(kernel: BulkKernel, poses: Array, start: Array) -> tuple[Array, Array] | None:
    """Return joint positions (K, 6) at the knots and their gains (K, 6, 12), if they close."""
    q = np.zeros((len(poses), 6)) + start
    for _ in range(_ROUNDS):
        result, screws = kernel.screws(q)
        twists = (result.reshape(-1, 16) @ _TWISTS).reshape(-1, 6, 12)
        try:
            gain = np.linalg.solve(screws.transpose(2, 0, 1), twists)
        except np.linalg.LinAlgError:
            return None
        gap = _gap(result, poses)
        q += _step(gain, gap)
        if np.abs(gap).max() < _ROUGH:
            near = np.abs(q[0] - start).max() < _NEAR and np.abs(gain).max() < _STIFF
            return (q, gain) if near else None
    return None


def _corrected(
    kernel: BulkKernel, poses: Array, spread: Array, knots: Array, gains: Array
) -> Array | None:
    """Return joint positions (N, 6) closed onto the poses, from those at the knots."""
    guess = spread @ knots
    gain = (spread @ gains.reshape(len(knots), -1)).reshape(-1, 6, 12)
    q, remaining = guess, np.inf
    for _ in range(_ROUNDS):
        gap = _gap(kernel.poses(q), poses)
        size = np.abs(gap).max()
        if size < _CLOSED:
            return q
        if not size < 0.1 * remaining:
            return None
        remaining = size
        q = q + _step(gain, gap)
        if not np.abs(q - guess).max() < _SMOOTH:
            return None
    return None


def _gap(result: Array, poses: Array) -> Array:
    """Return what is missing to rotation and position, shape (N, 12)."""
    return (poses - result)[:, :3].reshape(-1, 12)


def _step(gain: Array, gap: Array) -> Array:
    return (gain @ gap[..., None])[..., 0]


def _twists() -> Array:
    """Return the matrix (16, 72) that, applied to a pose, turns small gaps of it into twists."""
    out = np.zeros((4, 4, 6, 3, 4))
    for k in range(3):
        out[3, 3, k, k, 3] = 1.0
        # A small turn is half the sum of the crosses of each column with its gap.
        out[:3, k, 3:, :, k] = 0.5 * skew(np.eye(3)).transpose(2, 0, 1)
    return out.reshape(16, 72)


_TWISTS = _twists()
