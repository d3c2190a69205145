# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""All joint positions that bring the tool to one pose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...arm.robot import Robot
from ...arrays import Array
from ...errors import ReachError
from .closed_form import branches, family
from .newton import CLOSED, centred, polish, search

OTHER_POSTURE = (
    'the arm would have to change its posture on the way; '
    'move the seam, turn the torch or sample the path more densely'
)


def solve(robot: Robot, pose: Array, seed: Array | None = None) -> Array:
    """
    Return every branch within the joint limits, shape (K, n) [rad or m].

    Each revolute joint is given once, on the turn nearest the middle of its range. A chain with
    more than six joints has no finite set; it gets a sample of postures.

    Parameters
    ----------
    pose : array, shape (4, 4)
        ``T_world_tool``.
    seed : array, shape (n,), optional
        A further start where the solution is searched for numerically.

    Raises
    ------
    ReachError
        No joint positions within the limits reach the pose.
    ModelError
        The robot has a positioner.

    Examples
    --------
    >>> import numpy as np
    >>> import weld_twin_core as wt
    >>> robot = wt.load('ur5')
    >>> pose = wt.forward(robot, [0.3, -1.2, 1.5, -1.8, -1.5, 0.2])
    >>> branches = wt.solve(robot, pose)
    >>> len(branches), np.allclose(wt.forward(robot, branches), pose, atol=1e-9)
    (8, True)

    """
    robot.refuse_positioner('inverse kinematics')
    if family(robot) is None:
        result, _ = search(robot, pose, seed)
    else:
        candidates = branches(robot, pose[None])[:, 0]
        candidates = candidates[np.isfinite(candidates).all(axis=-1)]
        poses = np.broadcast_to(pose, (len(candidates), 4, 4))
        result, error = polish(robot, candidates, poses)
        result = centred(robot, result)
        inside = ((result >= robot.lower) & (result <= robot.upper)).all(axis=-1)
        result = result[inside & (np.abs(error).max(axis=-1) < CLOSED)]
    if not len(result):
        raise ReachError(f'{robot.name} cannot reach {where(pose)}: {why_not(robot, pose)}')
    return result


def where(pose: Array) -> str:
    """Return the position of a pose for a message."""
    x, y, z = pose[:3, 3]
    return f'({x:.3f}, {y:.3f}, {z:.3f}) m'


def gap(missing: Array) -> str:
    """Return how far a pose error, shape (6,), is for a message."""
    away, turned = np.linalg.norm(missing[:3]), np.linalg.norm(missing[3:])
    return f'{away:.3g} m and {np.degrees(turned):.3g} degrees away'


def why_not(robot: Robot, pose: Array) -> str:
    """Return why a pose is not reached: too far, or past a joint limit."""
    result, missing = search(_without_limits(robot), pose)
    if not len(result):
        return f'the nearest the tool gets is {gap(missing)}; move the seam or turn the torch'
    excess = np.maximum(robot.lower - result, result - robot.upper)
    best = int(np.argmin(excess.max(axis=-1)))
    if excess[best].max() <= 0.0:
        return OTHER_POSTURE
    joint = int(np.argmax(excess[best]))
    return past_limit(robot, joint, result[best, joint])


def past_limit(robot: Robot, joint: int, value: float) -> str:
    """Return for a message that joint number ``joint`` would need a position [rad or m]."""
    return (
        f'joint {robot.joint_names[joint]!r} would have to be at {value:.3f}, outside '
        f'[{robot.lower[joint]:.3f}, {robot.upper[joint]:.3f}]; move the seam or turn the torch'
    )


def _without_limits(robot: Robot) -> Robot:
    lower = np.where(robot.prismatic, robot.lower, -np.inf)
    return replace(robot, lower=lower, upper=np.where(robot.prismatic, robot.upper, np.inf))
