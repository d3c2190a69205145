# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Constant errors of a frame: the robot stands elsewhere, or the tool is mounted elsewhere."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arm.controller_lookup import controller_frames
from ..arm.robot import Robot
from ..arm.rotation import rotation_matrix, transform
from ..arrays import Array
from .constant import FrameError, frame_parameters
from .registry import register
from .view import Plausible, Value
from .wording import base_frame, frame, placed


@register
@dataclass(frozen=True, eq=False)
class BasePose(FrameError):
    """The base is displaced by xyz in the world and turned by rotvec about its own origin."""

    xyz: Value = (0.0, 0.0, 0.0)
    rotvec: Value = (0.0, 0.0, 0.0)

    name = 'base_pose'
    traits = replace(
        FrameError.traits,
        title='base pose error',
        meaning='the robot stands elsewhere than its base frame says',
        entered='base',
        place='base',
        fitted_with='base',
    )
    channel = 'base'
    parameters = frame_parameters(
        Plausible.even(5e-3, 0.5, 'derived: half a metre off is another place'),
        Plausible.even(1e-2, 0.2, 'derived: ten degrees are seen by the eye'),
    )

    def remedy(self, robot: Robot) -> str:
        if robot.behind:
            return self._on_the_workpiece(robot)
        moved = base_frame(_of_the_origin(self.vector(), robot))
        return (
            f'Correct the base frame by {moved}. If it was right when it was measured, the arm has '
            'moved: check the bolts of its foot.'
        )

    def _on_the_workpiece(self, robot: Robot) -> str:
        """Return the same of a cell, where poses are measured in a frame that a positioner moves."""
        now, step = robot.T_world_base, self.vector()
        new = transform(rotation_matrix(step[3:]) @ now[:3, :3], now[:3, 3] + step[:3])
        before, after = (placed(np.array(np.linalg.inv(pose))) for pose in (now, new))
        return (
            'Correct the frame on the workpiece: on the positioner it lies at '
            f'{after} in place of {before}. If it was right '
            'when it was measured, the fixture has moved, or another one is there.'
        )


def _of_the_origin(step: Array, robot: Robot) -> Array:
    """Return the move of the base of the rows, (6,) [m, rad], as one of the controller's base."""
    lever = robot.T_world_base[:3, :3] @ controller_frames(robot).base[:3, 3]
    swing = rotation_matrix(step[3:]) @ lever - lever
    return np.concatenate([step[:3] + swing, step[3:]])


@register
@dataclass(frozen=True, eq=False)
class ToolPose(FrameError):
    """The tool point is displaced by xyz of the flange; the tool turns by rotvec of itself."""

    xyz: Value = (0.0, 0.0, 0.0)
    rotvec: Value = (0.0, 0.0, 0.0)

    name = 'tool_pose'
    traits = replace(
        FrameError.traits,
        title='tool pose error',
        meaning='the tool is not where its tool frame says',
        entered='tool',
        place='tool',
        changes_in_use=True,
        fitted_with='tool',
    )
    channel = 'tool'
    parameters = frame_parameters(
        Plausible.even(
            5e-3,
            0.1,
            'tool centres found by hand were 8 to 15 mm off (industrialmonitordirect.com, KR3 '
            'mastering error)',
        ),
        Plausible.even(2e-2, 0.4, 'derived: twenty degrees are seen by the eye'),
    )

    def remedy(self, robot: Robot) -> str:
        flange = controller_frames(robot).flange[:3, :3]
        step = np.concatenate([flange.T @ self.vector()[:3], self.vector()[3:]])
        moved = frame(step, 'of the flange', 'of the tool')
        return f'Correct the tool centre point by {moved}; a bent torch looks like this too.'
