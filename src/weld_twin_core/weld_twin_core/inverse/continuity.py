# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What makes joint positions along a path one motion, and what is a jump between postures."""

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..chain import frames
from ..robot import Robot
from ..rotation import rotation_vector
from .newton import pose_error

Mask = NDArray[np.bool_]

_LEAP = 0.5
"""Joint step [rad] between neighbours that calls for a second look."""
_STEEP = 20.0
"""Joint motion per motion of the tool (both in rad, lengths over reach) beyond which it flips."""


def reach(robot: Robot) -> float:
    """Return the length of the stretched-out chain [m], an upper bound of the arm's reach."""
    return float(np.hypot(robot.a, robot.d).sum() + np.linalg.norm(robot.T_flange_tool[:3, 3]))


def travel(robot: Robot, poses: Array) -> Array:
    """Return a strictly increasing measure of the way along the poses, shape (N,) [rad]."""
    turns = rotation_vector(poses[1:, :3, :3] @ np.swapaxes(poses[:-1, :3, :3], -1, -2))
    steps = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1) / reach(robot)
    steps = steps + np.linalg.norm(turns, axis=1)
    return np.concatenate([[0.0], np.cumsum(steps + 1e-9)])


def joined(tracks: Array) -> Array:
    """
    Return branches, shape (K, N, n), continued across singularities.

    Where an arm passes a singularity, its motion goes on in what a closed form calls another
    branch; there the branches change places.
    """
    tracks = tracks.copy()
    steps = np.abs(_turned(np.diff(tracks, axis=1))).max(axis=-1)
    for i in np.flatnonzero((steps > _LEAP).any(axis=0)) + 1:
        apart = np.abs(_turned(tracks[:, i] - tracks[:, i - 1, None])).max(axis=-1)
        apart = np.where(np.isnan(apart), np.inf, apart)
        order = np.where(np.isinf(apart).all(axis=1), np.arange(len(tracks)), apart.argmin(axis=1))
        if len(set(order)) == len(order):
            tracks[:, i:] = tracks[order, i:]
    return tracks


def jumps(robot: Robot, q: Array, poses: Array) -> Mask:
    """
    Tell, shape (N - 1,), where the arm leaves the path between two samples.

    Half way between two joint positions of one motion the tool is near both; half way between
    two branches it is somewhere else, or the joints move much farther than the tool.
    """
    if len(q) < 2:
        return np.zeros(0, dtype=bool)
    chain = frames(robot, np.nan_to_num(0.5 * (q[1:] + q[:-1])))
    size = reach(robot)
    scale = np.array([1.0 / size] * 3 + [1.0] * 3)
    before = np.linalg.norm(pose_error(chain, poses[:-1]) * scale, axis=-1)
    after = np.linalg.norm(pose_error(chain, poses[1:]) * scale, axis=-1)
    tool = np.diff(travel(robot, poses))
    joints = np.abs(np.diff(q, axis=0)).max(axis=-1)
    away = before + after > 3.0 * tool + 1e-3
    return np.asarray(away | ((joints > _LEAP) & (joints > _STEEP * tool)))


def _turned(angle: Array) -> Array:
    """Return angles in [-pi, pi)."""
    return np.asarray((angle + np.pi) % (2.0 * np.pi) - np.pi)
