# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Newton steps on the tool pose, over samples at once: no closed form needed, only a start."""

from __future__ import annotations

import numpy as np

from ...arm.chain import Frames, column, frames
from ...arm.robot import Robot
from ...arm.rotation import rotation_vector
from ...arrays import Array

_FLOOR = 1e-12
"""Damping that keeps a step finite exactly at a singularity and is invisible elsewhere."""


def pose_error(chain: Frames, poses: Array) -> Array:
    """Return what is missing to the poses, shape (..., 6) [m, rad], linear part first."""
    turn = rotation_vector(poses[..., :3, :3] @ np.swapaxes(chain.rotation, -1, -2))
    return np.concatenate([poses[..., :3, 3] - chain.position, turn], axis=-1)


def chain_jacobian(robot: Robot, chain: Frames) -> Array:
    """Return the Jacobian, shape (..., 6, n), of frames already at hand."""
    columns = [column(robot, chain, ('q', i)) for i in range(robot.n)]
    return np.moveaxis(np.stack(np.broadcast_arrays(*columns), axis=1), (0, 1), (-2, -1))


def least_step(jacobian: Array, error: Array, damping: Array | float = _FLOOR) -> Array:
    """
    Return the smallest joint steps (..., n) that take pose errors (..., 6) [m, rad] away.

    The damping (...) [m^2] keeps them finite near a singularity.
    """
    transposed = np.swapaxes(jacobian, -1, -2)
    square = jacobian @ transposed + np.asarray(damping)[..., None, None] * np.eye(6)
    return (transposed @ np.linalg.solve(square, error[..., None]))[..., 0]


def polish(robot: Robot, q: Array, poses: Array, rounds: int = 12) -> tuple[Array, Array]:
    """Return positions (N, n) closed onto poses (N, 4, 4) from near them, and the error (N, 6)."""
    chain = frames(robot, q)
    error = pose_error(chain, poses)
    for _ in range(rounds):
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
