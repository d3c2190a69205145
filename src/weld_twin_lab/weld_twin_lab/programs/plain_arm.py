# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""An arm worked out row by row, with joints that are off: the oracle of corrected programs."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.robot import Robot

CLOSED, REACHED = 1e-11, 1e-7
"""Gap [m, rad] at which there is no further round, and up to which a pose counts as reached."""
ROUNDS = 50
"""Most rounds of Newton; from one place to the next it takes three."""
LONGEST = 0.3
"""Most that any joint turns in a round [rad]: farther away the tangent tells nothing."""


def along(axis: int, length: float) -> np.ndarray:
    """Return a shift along an axis, shape (4, 4)."""
    out = np.eye(4)
    out[axis, 3] = length
    return out


def about(axis: int, angle: float) -> np.ndarray:
    """Return a turn about an axis, shape (4, 4)."""
    out = np.eye(4)
    one, two = (axis + 1) % 3, (axis + 2) % 3
    out[one, one] = out[two, two] = np.cos(angle)
    out[two, one] = np.sin(angle)
    out[one, two] = -out[two, one]
    return out


@dataclass(frozen=True, eq=False)
class ScrewArm:
    """An arm as axes in its base at joint position zero, and its flange there."""

    name: str
    axes: np.ndarray
    points: np.ndarray
    """Direction of every axis, which its joint turns about by the right hand, and a point on it,
    shape (n, 3) [1, m]."""
    flange: np.ndarray
    T_flange_tool: np.ndarray = field(default_factory=lambda: np.eye(4))
    """Shape (4, 4) [m]."""

    def frames(self, q: np.ndarray) -> list[np.ndarray]:
        """Return a frame on every axis, z along it, and the flange, each of shape (4, 4)."""
        done, out = np.eye(4), []
        for axis, point, angle in zip(self.axes, self.points, q, strict=True):
            on = np.eye(4)
            on[:3, 2], on[:3, 3] = axis, point
            out.append(done @ on)  # only z and the place of it are asked for
            turn = np.eye(4)
            turn[:3, :3] = Rotation.from_rotvec(angle * axis).as_matrix()
            turn[:3, 3] = point - turn[:3, :3] @ point
            done = done @ turn
        return [*out, done @ self.flange]


Arm = Robot | ScrewArm


def tool_pose(
    robot: Arm, q: np.ndarray, tool: np.ndarray, offsets: np.ndarray | float = 0.0
) -> np.ndarray:
    """Return the pose of the tool; ``offsets``: how much further each joint really stands."""
    return np.asarray(_frames(robot, q + offsets)[-1] @ tool)


def _frames(robot: Arm, q: np.ndarray) -> list[np.ndarray]:
    """Return the frame that each joint turns in, and the last frame, each of shape (4, 4)."""
    if isinstance(robot, ScrewArm):
        return robot.frames(q)
    at, out = np.eye(4), []
    rows = zip(robot.a, robot.alpha, robot.d, robot.theta + q, strict=True)
    for a, alpha, d, theta in rows:
        if robot.convention == 'standard':
            out.append(at)
            at = at @ about(2, theta) @ along(2, d) @ along(0, a) @ about(0, alpha)
        else:
            out.append(at @ about(0, alpha) @ along(0, a))
            at = out[-1] @ about(2, theta) @ along(2, d)
    return [*out, at]


def joints_for(robot: Arm, pose: np.ndarray, tool: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Return what a controller, which knows no error, makes of a pose."""
    q = np.array(near, dtype=float)
    for _ in range(ROUNDS):
        *axes, last = _frames(robot, q)
        got = last @ tool
        turn = Rotation.from_matrix(pose[:3, :3] @ got[:3, :3].T).as_rotvec()
        gap = np.concatenate([pose[:3, 3] - got[:3, 3], turn])
        if np.abs(gap).max() < CLOSED:
            break
        z = np.array([frame[:3, 2] for frame in axes])
        arms = np.array([got[:3, 3] - frame[:3, 3] for frame in axes])
        moves = np.concatenate([np.cross(z, arms), z], axis=1).T
        step = np.linalg.lstsq(moves, gap, rcond=1e-9)[0]
        q = q + step * min(1.0, LONGEST / max(float(np.abs(step).max()), 1e-12))
    if np.abs(gap).max() > REACHED:
        raise ValueError(f'{robot.name} does not reach a pose from where it stands')
    return q
