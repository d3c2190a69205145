# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Joint offset: theta -> theta + offset (paper, eq. II.iii.a)."""

from dataclasses import dataclass

from ..arm.robot import Robot
from .constant import ChannelError
from .registry import register
from .view import Parameter, Plausible, Stage, Value
from .wording import stands, to_mend


@register
@dataclass(frozen=True, eq=False)
class JointOffset(ChannelError):
    """A constant encoder or mastering error of one joint."""

    joint: str
    offset: Value = 0.0

    name = 'joint_offset'
    title = 'zero offset'
    entered = 'zero'
    changes_in_use = True
    everywhere = True
    set_at_controller = True
    depends_on = 'constant'
    of = 'joint'
    stage = Stage.JOINT
    channel = 'q'
    parameters = (
        Parameter(
            'offset',
            'rad',
            typical=5e-4,
            range=Plausible.even(
                5e-3,
                0.13,
                'a mastering 16 degrees of the motor off is 0.2 degrees (3.5 mrad) of the joint; arms '
                'mastered on wrong marks were 5 to 7 degrees off (industrialmonitordirect.com, KR16 '
                'mastering deviation and KR3 mastering error)',
            ),
            sliding=Plausible.even(5e-3, 0.1, 'derived: a reference switch, by hand'),
        ),
    )

    def remedy(self, robot: Robot) -> str:
        """Return what to mend, in words; see `Hooks.remedy`."""
        joint, offset = str(self.site), self.plain('offset')
        sliding = bool(robot.prismatic[robot.index(joint)])
        return f'{stands(joint, offset, sliding=sliding)} {to_mend(offset, sliding=sliding)}'
