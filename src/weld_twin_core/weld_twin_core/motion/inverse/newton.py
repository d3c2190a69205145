# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Newton steps on tool pose or point, over samples at once: no closed form, only a start."""

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
