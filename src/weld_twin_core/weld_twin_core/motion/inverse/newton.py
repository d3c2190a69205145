# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Inverse kinematics without a closed form: Newton from near a solution, or damped from many starts.

Any chain, on tool pose or point, over all samples or starts at once.

References
----------
.. [1] S. Chan, P. Lawrence, "General inverse kinematics with the error damped pseudoinverse",
   IEEE ICRA 1988.

"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...arm.chain import Frames, chain_jacobian, forward, frames, jacobian
from ...arm.robot import Robot
from ...arm.rotation import angle_between
from ...arrays import Array

_FLOOR = 1e-12
"""Damping that keeps a step finite exactly at a singularity and is invisible elsewhere."""
_CLOSING = 12
"""Steps onto a pose at the most; convergence is quadratic."""
_ROUNDS = 80
"""Steps to a point at the most: from a start at random they reach one within some thirty."""
_STRIDE = 0.2
"""Longest step of a joint to a point [rad, m]: longer ones jump to and fro near the edge of reach."""
STRETCHED = 1e-6
"""Damping of steps to a point [m^2]: an arm that is stretched has no step that leads outwards."""
_REACHED = 1e-9
"""Distance [m] from which on a point counts as reached."""


def pose_error(chain: Frames, poses: Array) -> Array:
    """Return what is missing to the poses, shape (..., 6) [m, rad], linear part first."""
    turn = angle_between(poses[..., :3, :3], chain.rotation)
    return np.concatenate([poses[..., :3, 3] - chain.position, turn], axis=-1)


def least_step(slope: Array, error: Array, damping: Array | float = _FLOOR) -> Array:
    """Return the smallest steps (..., n) that take errors (..., 6) [m, rad] away, damped (...) [m^2]."""
    transposed = np.swapaxes(slope, -1, -2)
    some = np.asarray(damping)[..., None, None] * np.eye(slope.shape[-2])
    square = slope @ transposed + some
    return (transposed @ np.linalg.solve(square, error[..., None]))[..., 0]


def polish(robot: Robot, q: Array, poses: Array) -> tuple[Array, Array]:
    """Return positions (N, n) closed onto poses (N, 4, 4) from near them, and the error (N, 6)."""
    chain = frames(robot, q)
    error = pose_error(chain, poses)
    for _ in range(_CLOSING):
        if np.abs(error).max(initial=0.0) < 1e-13:
            break
        step = least_step(chain_jacobian(robot, chain), error)
        trial = q + step
        trial_chain = frames(robot, trial)
        trial_error = pose_error(trial_chain, poses)
        better = np.abs(trial_error).max(axis=-1) < np.abs(error).max(axis=-1)
        if not better.any():
            break
        q = np.where(better[..., None], trial, q)
        error = np.where(better[..., None], trial_error, error)
        chain = frames(robot, q)
    return q, error


def reaching(robot: Robot, points: Array, start: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return postures (M, n) near starts, tool points at (M, 3) [m], and which are there; no limits."""
    q = np.array(start)
    for _ in range(_ROUNDS):
        off = points - forward(robot, q)[:, :3, 3]
        if np.abs(off).max(initial=0.0) < _REACHED:
            break
        step = least_step(jacobian(robot, q)[:, :3], off, STRETCHED)
        q = q + np.clip(step, -_STRIDE, _STRIDE)
    off = points - forward(robot, q)[:, :3, 3]
    return q, np.linalg.norm(off, axis=1) < _REACHED


CLOSED = 1e-9
"""Largest error [m, rad] of a solution."""
_STARTS = 128
"""Positions that a search starts from; of an arm with eight postures each is met many times."""
_DESCENTS = 60
"""Newton's steps from a start at most; a start that needs more is given up."""
_SAME = 1e-4
"""Joint difference [rad or m] up to which two solutions are one."""


def search(robot: Robot, pose: Array, seed: Array | None = None) -> tuple[Array, Array]:
    """
    Return distinct solutions within the limits, shape (K, n), and the smallest error, shape (6,).

    The starts are the same for every call, after one that is given, so the answer is repeatable. A
    chain with more than six joints gets from each start the solution nearest the middle of its
    range.
    """
    lower, upper = _range(robot)
    rng = np.random.default_rng(0)
    starts = rng.uniform(lower, upper, size=(_STARTS, robot.n))
    if seed is not None:
        starts = np.concatenate([np.asarray(seed)[None], starts])
    poses = np.broadcast_to(pose, (len(starts), 4, 4))
    q, error = polish(robot, _descend(robot, starts, poses), poses)
    q = centred(robot, q)
    size = np.abs(error).max(axis=-1)
    inside = ((q >= robot.lower - CLOSED) & (q <= robot.upper + CLOSED)).all(axis=-1)
    return _distinct(robot, q[(size < CLOSED) & inside]), error[int(np.argmin(size))]


def _range(robot: Robot) -> tuple[Array, Array]:
    """Return where to look: the limits, cut to one turn about their middle."""
    half = np.where(robot.prismatic, 2.0, np.pi)
    centre = _middle(robot)
    return np.maximum(robot.lower, centre - half), np.minimum(robot.upper, centre + half)


def centring(robot: Robot, q: Array) -> Array:
    """Return the joint motion, shape (..., n), towards the middle of the range."""
    lower, upper = _range(robot)
    width = upper - lower
    return np.asarray((0.5 * (lower + upper) - q) / (width / width.max()) ** 2)


def null_space(jacobian: Array, motion: Array) -> Array:
    """Return the part of a joint motion, shape (..., n), that leaves the tool where it is."""
    return motion - least_step(jacobian, (jacobian @ motion[..., None])[..., 0])


def _descend(robot: Robot, q: Array, poses: Array) -> Array:
    """Damped steps; the damping follows the error, so far starts move carefully."""
    for _ in range(_DESCENTS):
        chain = frames(robot, q)
        error = pose_error(chain, poses)
        size = np.linalg.norm(error, axis=-1)
        jacobian = chain_jacobian(robot, chain)
        step = least_step(jacobian, error, 1e-2 * np.minimum(size, 1.0) ** 2 + 1e-10)
        if robot.n > 6:
            step = step + 0.2 * null_space(jacobian, centring(robot, q))
        largest = np.abs(step).max(axis=-1, keepdims=True)
        q = q + step / np.maximum(1.0, largest / 0.5)
        # A limit would only stall a turning joint, which may come round the other way; without a
        # choice of turns, or with freedom to use, staying inside is what finds a solution.
        bounded = robot.prismatic | (robot.n > 6)
        q = np.where(bounded, np.clip(q, robot.lower, robot.upper), q)
    return q


def _distinct(robot: Robot, q: Array) -> Array:
    """Drop solutions that are the same posture, whole turns apart or not."""
    kept: list[Array] = []
    for row in q:
        gaps = [np.where(robot.prismatic, row - k, np.angle(np.exp(1j * (row - k)))) for k in kept]
        if all(np.abs(gap).max() > _SAME for gap in gaps):
            kept.append(row)
    return np.array(kept).reshape(-1, robot.n)


TURN = 2.0 * np.pi
"""A whole turn [rad]."""


def _middle(robot: Robot) -> Array:
    """Return the middle of each joint's range, shape (n,); 0 where it has no limits."""
    finite = np.isfinite(robot.lower) & np.isfinite(robot.upper)
    total = np.where(finite, robot.lower, 0.0) + np.where(finite, robot.upper, 0.0)
    return np.asarray(0.5 * total)


def centred(robot: Robot, q: Array) -> Array:
    """Return the positions, shape (..., n), on the turn nearest the middle of the limits."""
    return q + TURN * turns_to_middle(robot, q, q)


def turns_to_middle(robot: Robot, low: Array, high: Array) -> Array:
    """Return how many turns bring ranges (..., n) to the middle of limits; 0 for slides."""
    turns = np.round((_middle(robot) - 0.5 * (low + high)) / TURN)
    return np.where(robot.prismatic, 0.0, turns)
