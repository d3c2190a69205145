# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""An arm worked out row by row, with joints that are off: the oracle of corrected programs."""

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation


def along(axis, length):
    out = np.eye(4)
    out[axis, 3] = length
    return out


def about(axis, angle):
    out = np.eye(4)
    out[:3, :3] = Rotation.from_euler('xyz'[axis], angle).as_matrix()
    return out


def tool_pose(robot, q, tool, offsets=0.0, longer=0.0):
    """Return the pose of the tool; ``offsets``: how much further each joint really stands."""
    out = np.eye(4)
    rows = zip(robot.a + longer, robot.alpha, robot.d, robot.theta + q + offsets, strict=True)
    for a, alpha, d, theta in rows:
        if robot.convention == 'standard':
            out = out @ about(2, theta) @ along(2, d) @ along(0, a) @ about(0, alpha)
        else:
            out = out @ about(0, alpha) @ along(0, a) @ about(2, theta) @ along(2, d)
    return out @ tool


def joints_for(robot, pose, tool, near):
    """Return what a controller, which knows no error, makes of a pose."""

    def off(q):
        gap = np.linalg.inv(pose) @ tool_pose(robot, q, tool)
        turn = Rotation.from_matrix(gap[:3, :3]).as_rotvec()
        return np.concatenate([gap[:3, 3], turn])

    found = least_squares(off, near, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert np.abs(found.fun).max() < 1e-7
    return found.x
