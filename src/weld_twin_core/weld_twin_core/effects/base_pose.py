# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Base pose: the robot stands elsewhere (paper IV.ii, initialization offset)."""

from dataclasses import dataclass

import numpy as np

from ..arm.controller_lookup import controller_frames
from ..arm.robot import Robot
from ..arm.rotation import rotation_matrix, transform
from ..arrays import Array
from .constant import FrameError
from .registry import register
from .view import Value
from .wording import base_frame, placed


@register
@dataclass(frozen=True, eq=False)
class BasePose(FrameError):
    """The base is displaced by xyz in the world and turned by rotvec about its own origin."""

    xyz: Value = (0.0, 0.0, 0.0)
    rotvec: Value = (0.0, 0.0, 0.0)

    name = 'base_pose'
    depends_on = 'constant'
    place = 'base'
    channel = 'base'
    fitted_with = 'base'

    def remedy(self, robot: Robot) -> str:
        """Return what to mend, in words; see `Hooks.remedy`."""
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
        return (
            'Correct the frame on the workpiece: on the positioner it lies at '
            f'{placed(np.linalg.inv(new))} in place of {placed(np.linalg.inv(now))}. If it was right '
            'when it was measured, the fixture has moved, or another one is there.'
        )


def _of_the_origin(step: Array, robot: Robot) -> Array:
    """Return the move of the base of the rows, (6,) [m, rad], as one of the controller's base."""
    lever = robot.T_world_base[:3, :3] @ controller_frames(robot).base[:3, 3]
    swing = rotation_matrix(step[3:]) @ lever - lever
    return np.concatenate([step[:3] + swing, step[3:]])
