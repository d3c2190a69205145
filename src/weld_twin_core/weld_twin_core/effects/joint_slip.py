# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Joint slip: a belt or a coupling jumps at an instant, and the joint stays off from then on."""

from __future__ import annotations

from dataclasses import dataclass

from ..arm.robot import Robot
from .joint_offset import JointOffset
from .registry import register
from .sudden import SuddenChannel
from .view import Parameter, Stage, Value
from .wording import radians


@register
@dataclass(frozen=True, eq=False)
class JointSlip(SuddenChannel):
    """The joint stands ``offset`` further than its reading from ``time`` [s] on."""

    joint: str
    offset: Value = 0.0
    time: float = 0.0

    name = 'joint_slip'
    of = 'joint'
    stage = Stage.JOINT
    channel = 'q'
    parameters = (Parameter('offset', 'rad', typical=5e-4),)

    def lasting(self) -> JointOffset:
        """Return the offset that the joint keeps."""
        return JointOffset(self.joint, self.offset)

    def remedy(self, robot: Robot) -> str:
        """Return what to mend, in words; see `Hooks.remedy`."""
        at = robot.index(str(self.site))
        size = self.plain('offset')
        far = f'{size * 1e3:+.3g} mm' if robot.prismatic[at] else radians(size)
        return (
            f'See to the belt, coupling and encoder of {self.site}: it slipped by {far} at '
            f't = {self.plain("time"):.4g}; then master it again.'
        )
