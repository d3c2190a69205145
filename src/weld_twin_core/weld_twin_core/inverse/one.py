# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""All joint positions that bring the tool to one pose."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..errors import ReachError
from ..robot import Robot
from .closed_form import branches, family
from .newton import polish
from .search import CLOSED, search

TURN = 2.0 * np.pi


def solve(robot: Robot, pose: Array, seed: Array | None = None) -> Array:
    """
    Return every branch within the joint limits, shape (K, n) [rad or m].

    Each revolute joint is given once, on the turn nearest the middle of its range. A chain with
    more than six joints has no finite set; it gets a sample of postures.

    Parameters
    ----------
    robot : Robot
    pose : array, shape (4, 4)
        ``T_world_tool``.
    seed : array, shape (n,), optional
        A further start where the solution is searched for numerically.

    Raises
    ------
    ReachError
        No joint positions within the limits reach the pose.

    """
    if family(robot) is None:
        found, _ = search(robot, pose, seed)
    else:
        candidates = branches(robot, pose[None])[:, 0]
        candidates = candidates[np.isfinite(candidates).all(axis=-1)]
        poses = np.broadcast_to(pose, (len(candidates), 4, 4))
        found, error = polish(robot, candidates, poses)
        found = centred(robot, found)
        inside = ((found >= robot.lower) & (found <= robot.upper)).all(axis=-1)
        found = found[inside & (np.abs(error).max(axis=-1) < CLOSED)]
    if not len(found):
        raise ReachError(f'{robot.name} cannot reach {where(pose)}: {why_not(robot, pose)}')
    return found


def centred(robot: Robot, q: Array) -> Array:
    """Return the positions, shape (..., n), shifted by whole turns to the middle of the limits."""
    return q + TURN * turns_to_middle(robot, q, q)


def turns_to_middle(robot: Robot, low: Array, high: Array) -> Array:
    """Return how many turns, shape (..., n), bring the span low..high to the middle of the range."""
    finite = np.isfinite(robot.lower) & np.isfinite(robot.upper)
    middle = np.where(finite, 0.5 * (robot.lower + robot.upper), 0.0)
    return np.where(robot.prismatic, 0.0, np.round((middle - 0.5 * (low + high)) / TURN))


def where(pose: Array) -> str:
    """Return the position of a pose for a message."""
    x, y, z = pose[:3, 3]
    return f'({x:.3f}, {y:.3f}, {z:.3f}) m'


def why_not(robot: Robot, pose: Array) -> str:
    """Return why a pose is not reached: too far, or past a joint limit."""
    unlimited = _without_limits(robot)
    found, gap = search(unlimited, pose)
    if not len(found):
        return f'the closest the arm gets is {gap:.3g} m or rad away; move the seam or turn the torch'
    excess = np.maximum(robot.lower - found, found - robot.upper)
    best = int(np.argmin(excess.max(axis=-1)))
    joint = int(np.argmax(excess[best]))
    return (
        f'joint {robot.joint_names[joint]!r} would have to be at {found[best, joint]:.3f}, outside '
        f'[{robot.lower[joint]:.3f}, {robot.upper[joint]:.3f}]; move the seam or turn the torch'
    )


def _without_limits(robot: Robot) -> Robot:
    from dataclasses import replace

    wide = np.full(robot.n, np.inf)
    return replace(robot, lower=np.where(robot.prismatic, robot.lower, -wide),
                   upper=np.where(robot.prismatic, robot.upper, wide))
