# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""An arm worked out row by row, with joints that are off: the oracle of corrected programs."""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.robot import Robot


def along(axis: int, length: float) -> np.ndarray:
    """Return a shift along an axis, shape (4, 4)."""
    out = np.eye(4)
    out[axis, 3] = length
    return out


def about(axis: int, angle: float) -> np.ndarray:
    """Return a turn about an axis, shape (4, 4)."""
    out = np.eye(4)
    out[:3, :3] = Rotation.from_euler('xyz'[axis], angle).as_matrix()
    return out


def tool_pose(
    robot: Robot, q: np.ndarray, tool: np.ndarray, offsets: np.ndarray | float = 0.0
) -> np.ndarray:
    """Return the pose of the tool; ``offsets``: how much further each joint really stands."""
    out = np.eye(4)
    rows = zip(robot.a, robot.alpha, robot.d, robot.theta + q + offsets, strict=True)
    for a, alpha, d, theta in rows:
        if robot.convention == 'standard':
            out = out @ about(2, theta) @ along(2, d) @ along(0, a) @ about(0, alpha)
        else:
            out = out @ about(0, alpha) @ along(0, a) @ about(2, theta) @ along(2, d)
    return np.asarray(out @ tool)


def joints_for(robot: Robot, pose: np.ndarray, tool: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Return what a controller, which knows no error, makes of a pose."""

    def off(q: np.ndarray) -> np.ndarray:
        gap = np.linalg.inv(pose) @ tool_pose(robot, q, tool)
        turn = Rotation.from_matrix(gap[:3, :3]).as_rotvec()
        return np.concatenate([gap[:3, 3], turn])

    found = least_squares(off, near, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    if np.abs(found.fun).max() > 1e-7:
        raise ValueError(f'{robot.name} does not reach a pose from where it stands')
    return np.asarray(found.x)
