# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Joint offset: theta -> theta + offset (paper, eq. II.iii.a)."""

from dataclasses import dataclass

from ..arm.robot import Robot
from .constant import ChannelError
from .registry import register
from .view import Parameter, Stage, Value
from .wording import stands, to_mend


@register
@dataclass(frozen=True, eq=False)
class JointOffset(ChannelError):
    """A constant encoder or mastering error of one joint."""

    joint: str
    offset: Value = 0.0

    name = 'joint_offset'
    everywhere = True
    set_at_controller = True
    depends_on = 'constant'
    of = 'joint'
    stage = Stage.JOINT
    channel = 'q'
    parameters = (Parameter('offset', 'rad', typical=5e-4),)

    def remedy(self, robot: Robot) -> str:
        """Return what to mend, in words; see `Hooks.remedy`."""
        joint, offset = str(self.site), self.plain('offset')
        sliding = bool(robot.prismatic[robot.index(joint)])
        return f'{stands(joint, offset, sliding=sliding)} {to_mend(offset, sliding=sliding)}'
