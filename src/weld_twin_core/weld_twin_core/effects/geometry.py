# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Constant errors of the geometry: a joint's zero, and the numbers of a Denavit-Hartenberg row.

The formulas are those of the paper: theta -> theta + offset (eq. II.iii.a), a -> a + da (eq. II.iii.b),
alpha -> alpha + dalpha (eq. II.iii.c), d -> d + dd; beta is Hayati's turn about y for axes that are
nearly parallel (IEEE CDC 1983).
"""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from .effect import LinearEffect, register
from .view import Parameter, Robot, Shift, Stage, Value, View, single
from .wording import metres, radians, stands, to_mend

_URS = (
    'controller calibrations of a UR3 (github.com/MyRobotLab/pyrobotlab issue 145) and of a UR5 '
    '(github.com/UniversalRobots/Universal_Robots_ROS_Driver issue 457): rows between axes that '
    'are not parallel'
)
"""Where errors of links were read."""


class ChannelError(LinearEffect):
    """A constant error of one channel of one joint or row; the parameter displaces it."""

    channel: ClassVar[str]
    off: ClassVar[str] = 'it is off by'
    """How a robot file is wrong that lacks it."""

    def remedy(self, robot: Robot) -> str:
        """Return which number of the robot file to mend; see `Effect.remedy`."""
        error = self._plain(self.parameters[0].name)
        now = float(getattr(robot, self.channel)[robot.index(str(self.site))])
        if self.channel in ('a', 'd'):
            old, new = f'{now * 1e3:.3f} mm', f'{(now + error) * 1e3:.3f} mm'
        else:
            old, new = f'{np.degrees(now):.4f} deg', f'{np.degrees(now + error):.4f} deg'
        by = metres(error) if self.channel in ('a', 'd') else radians(error)
        return (
            f'Enter {self.channel} = {new} for {self.site} in the kinematic model in place of '
            f'{old}: {self.off} {by}.'
        )

    def per_unit(self, view: View) -> list[Shift]:
        return [single((self.channel, view.robot.index(str(self.site))), np.ones(()), view)]


@register
class JointOffset(ChannelError):
    """A constant encoder or mastering error of one joint."""

    joint: str
    offset: Value = 0.0

    name = 'joint_offset'
    traits = replace(
        ChannelError.traits,
        title='zero offset',
        meaning="a joint's zero is wrong by a constant angle",
        formula='θ → θ + offset',
        apart={
            'base_pose': 'measure where the base stands (points on its foot), or master the joint with '
            'its own gauge',
            'tool_pose': 'measure the tool by itself, or master the joint with its own gauge',
            'joint_offset': 'master one of the joints with its own gauge',
        },
        entered='zero',
        changes_in_use=True,
        set_at_controller=True,
        everywhere=True,
    )
    of = 'joint'
    stage = Stage.JOINT
    channel = 'q'
    parameters = (
        Parameter('offset', 'rad', typical=5e-4)
        .plausible(
            (5e-3, 0.13),
            'a mastering 16 degrees of the motor off is 0.2 degrees (3.5 mrad) of the joint; arms '
            'mastered on wrong marks were 5 to 7 degrees off (industrialmonitordirect.com, KR16 '
            'mastering deviation and KR3 mastering error)',
        )
        .plausible_sliding((5e-3, 0.1), 'derived: a reference switch, by hand'),
    )

    def remedy(self, robot: Robot) -> str:
        joint, offset = str(self.site), self._plain('offset')
        sliding = bool(robot.prismatic[robot.index(joint)])
        return f'{stands(joint, offset, sliding=sliding)} {to_mend(offset, sliding=sliding)}'


class _LinkError(ChannelError):
    traits = replace(ChannelError.traits, entered='model', everywhere=True)
    of = 'link'
    stage = Stage.LINK


@register
class LinkLength(_LinkError):
    """A wrong length of the common normal of one DH row."""

    joint: str
    da: Value = 0.0

    name = 'link_length'
    traits = replace(
        _LinkError.traits,
        title='link length error',
        meaning='a length in the model of the robot is wrong',
        formula='a → a + da',
        changes_in_use=True,
    )
    channel = 'a'
    parameters = (
        Parameter('da', 'm', typical=2e-4).plausible(
            (5e-4, 1e-2),
            f'{_URS}: 0.02 to 0.28 mm; range derived: beyond a centimetre it is another arm',
        ),
    )


@register
class LinkOffset(_LinkError):
    """A wrong offset along the axis of one DH row."""

    joint: str
    dd: Value = 0.0

    name = 'link_offset'
    traits = replace(
        _LinkError.traits,
        title='link offset error',
        meaning='an offset along an axis in the model of the robot is wrong',
        formula='d → d + dd',
        apart={
            'link_offset': 'only their sum moves the tool, so mending either mends both',
        },
    )
    channel = 'd'
    parameters = (
        Parameter('dd', 'm', typical=2e-4).plausible(
            (5e-4, 1e-2),
            f'{_URS}: 0.09 to 0.32 mm; range derived: beyond a centimetre it is another arm',
        ),
    )


@register
class LinkTwist(_LinkError):
    """A wrong angle between the axes of one DH row."""

    joint: str
    dalpha: Value = 0.0

    name = 'link_twist'
    traits = replace(
        _LinkError.traits,
        title='link twist error',
        meaning='an angle between two axes in the model of the robot is wrong',
        formula='α → α + dalpha',
    )
    channel = 'alpha'
    off = 'the axes are twisted by'
    parameters = (
        Parameter('dalpha', 'rad', typical=5e-4).plausible(
            (2e-3, 2e-2), f'{_URS}: 0.4 to 3.9 mrad'
        ),
    )


@register
class AxisParallelism(_LinkError):
    """The tilt that alpha cannot express where two axes are nearly parallel."""

    joint: str
    dbeta: Value = 0.0

    name = 'axis_parallelism'
    traits = replace(
        _LinkError.traits,
        title='axis parallelism error',
        meaning='two axes that should be parallel are tilted',
        formula='β → β + dbeta (Hayati)',
    )
    channel = 'beta'
    off = 'the axes are out of parallel by'
    parameters = (
        Parameter('dbeta', 'rad', typical=5e-4).plausible(
            (2e-3, 2e-2), 'derived: a tilt of the same kind as link_twist, of the same size'
        ),
    )
