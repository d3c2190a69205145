# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Tool pose: the tool is not mounted where the model says."""

from dataclasses import dataclass

from .constant import FrameError
from .registry import register
from .view import Value


@register
@dataclass(frozen=True, eq=False)
class ToolPose(FrameError):
    """The tool point is displaced by xyz of the flange; the tool turns by rotvec of itself."""

    xyz: Value = (0.0, 0.0, 0.0)
    rotvec: Value = (0.0, 0.0, 0.0)

    name = 'tool_pose'
    title = 'tool pose error'
    entered = 'tool'
    changes_in_use = True
    depends_on = 'constant'
    place = 'tool'
    channel = 'tool'
    fitted_with = 'tool'
