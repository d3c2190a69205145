# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Tool pose: the tool is not mounted where the model says."""

from dataclasses import dataclass

import numpy as np

from ..arm.controller_lookup import controller_frames
from ..arm.robot import Robot
from .constant import FrameError
from .registry import register
from .view import Value
from .wording import frame


@register
@dataclass(frozen=True, eq=False)
class ToolPose(FrameError):
    """The tool point is displaced by xyz of the flange; the tool turns by rotvec of itself."""

    xyz: Value = (0.0, 0.0, 0.0)
    rotvec: Value = (0.0, 0.0, 0.0)

    name = 'tool_pose'
    depends_on = 'constant'
    place = 'tool'
    channel = 'tool'
    fitted_with = 'tool'

    def remedy(self, robot: Robot) -> str:
        """Return what to mend, in words; see `Hooks.remedy`."""
        flange = controller_frames(robot).flange[:3, :3]
        step = np.concatenate([flange.T @ self.vector()[:3], self.vector()[3:]])
        moved = frame(step, 'of the flange', 'of the tool')
        return f'Correct the tool centre point by {moved}; a bent torch looks like this too.'
