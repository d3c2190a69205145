# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What makes joint positions along a path one motion, and what is a jump between postures."""

import numpy as np
from numpy.typing import NDArray

from ...arm.chain import forward
from ...arm.robot import Robot
from ...arm.rotation import wrapped
from ...arrays import Array

Mask = NDArray[np.bool_]

LEAP = 0.5
"""Joint step [rad] between neighbours that calls for a second look."""
_STEEP = 20.0
"""Joint motion per motion of the tool (both in rad, lengths over reach) beyond which it flips."""

_SUMS = np.array([[[0.0, 1.0]] * 3 + [[1.0, 0.0]]] * 3 + [[[0.0, 0.0]] * 4]).reshape(16, 2)
"""Adds up the squares of a pose's position and of its rotation."""


def reach(robot: Robot) -> float:
    """Return the length of the stretched-out chain [m], an upper bound of the arm's reach."""
    return float(np.hypot(robot.a, robot.d).sum() + np.linalg.norm(robot.T_flange_tool[:3, 3]))


def travel(robot: Robot, poses: Array) -> Array:
    """Return a strictly increasing measure of the way along the poses, shape (N,) [rad]."""
    moved, turned = distances(poses[1:], poses[:-1])
    return np.concatenate([[0.0], np.cumsum(moved / reach(robot) + turned + 1e-9)])


def distances(first: Array, second: Array) -> tuple[Array, Array]:
    """Return how far poses (..., 4, 4) are apart, shape (...) each [m, rad]."""
    gap = first - second
    gap = gap.reshape(*gap.shape[:-2], 16)
    gap *= gap
    moved, turned = np.moveaxis(np.sqrt(gap @ _SUMS), -1, 0)
    # The chord between rotations, as long as 2 sqrt(2) sin(angle / 2).
    return moved, 2.0 * np.arcsin(np.minimum(turned / np.sqrt(8.0), 1.0))


def joined(tracks: Array) -> Array:
    """Return branches (K, N, n) that change places where an arm passes a singularity onto another."""
    tracks = tracks.copy()
    steps = np.abs(wrapped(np.diff(tracks, axis=1))).max(axis=-1)
    for i in np.flatnonzero((steps > LEAP).any(axis=0)) + 1:
        apart = np.abs(wrapped(tracks[:, i] - tracks[:, i - 1, None])).max(axis=-1)
        apart = np.where(np.isnan(apart), np.inf, apart)
        order = np.where(np.isinf(apart).all(axis=1), np.arange(len(tracks)), apart.argmin(axis=1))
        if len(set(order)) == len(order):
            tracks[:, i:] = tracks[order, i:]
    return tracks


def jumps(robot: Robot, q: Array, poses: Array) -> Mask:
    """
    Tell, (..., N - 1), where joints (..., N, n) leave the path of poses (N, 4, 4) between samples.

    Half way between two joint positions of one motion the tool is near both; half way between two
    branches it is somewhere else, or the joints move much farther than the tool.
    """
    if len(poses) < 2:
        return np.zeros((*q.shape[:-2], 0), dtype=bool)
    halfway = forward(robot, np.nan_to_num(0.5 * (q[..., 1:, :] + q[..., :-1, :])))
    tool = np.diff(travel(robot, poses))
    size, away = reach(robot), -3.0 * tool
    for ends in (poses[:-1], poses[1:]):
        moved, turned = distances(halfway, ends)
        away = away + np.hypot(moved / size, turned)
    joints = np.abs(np.diff(q, axis=-2)).max(axis=-1)
    return np.asarray((away > 1e-3) | ((joints > LEAP) & (joints > _STEEP * tool)))
