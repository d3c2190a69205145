# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Root pose: a positioner stands elsewhere beside the robot than its root frame says."""

from __future__ import annotations

from dataclasses import dataclass

from ..arm.robot import Robot
from .constant import FrameError
from .registry import register
from .view import Value


@register
@dataclass(frozen=True, eq=False)
class RootPose(FrameError):
    """The positioner is displaced by xyz along the robot's base axes, and turned about its root."""

    xyz: Value = (0.0, 0.0, 0.0)
    rotvec: Value = (0.0, 0.0, 0.0)

    name = 'root_pose'
    depends_on = 'constant'
    place = 'base'
    channel = 'root'
    lacking = 'is of a positioner, and robot {robot!r} has none; use base_pose'

    @classmethod
    def fits(cls, robot: Robot, joint: str | None) -> bool:
        """Return whether there is a positioner."""
        return robot.behind > 0
