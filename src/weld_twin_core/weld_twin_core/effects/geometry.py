# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Constant errors: a joint's zero, the numbers of a Denavit-Hartenberg row, and where frames stand.

The formulas are those of the paper: theta -> theta + offset (eq. II.iii.a), a -> a + da (eq. II.iii.b),
alpha -> alpha + dalpha (eq. II.iii.c), d -> d + dd; beta is Hayati's turn about y for axes that are
nearly parallel (IEEE CDC 1983).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ..arm.known_arms import controller_frames
from ..arm.rotation import rotation_matrix, transform
from .effect import Hooked, LinearEffect, SearchHooks, register
from .view import Array, Parameter, Plausible, Robot, Shift, Stage, Value, View, single
from .wording import controller_pose, frame, metres, radians, stands, to_mend

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

    traits = replace(
        _LinkError.traits,
        title='link length error',
        meaning='a length in the model of the robot is wrong',
        formula='a → a + da',
        changes_in_use=True,
        changes_slowly=True,
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

    traits = replace(
        _LinkError.traits,
        title='link offset error',
        meaning='an offset along an axis in the model of the robot is wrong',
        formula='d → d + dd',
        apart={'link_offset': 'only their sum moves the tool, so mending either mends both'},
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


def frame_parameters(
    xyz: Plausible, rotvec: Plausible, typical: tuple[float, float] = (5e-4, 1e-3)
) -> tuple[Parameter, ...]:
    """Return the parameters of an error of a frame, with how large each may be."""
    return (
        Parameter('xyz', 'm', size=3, typical=typical[0], range=xyz),
        Parameter('rotvec', 'rad', size=3, typical=typical[1], range=rotvec),
    )


@dataclass(frozen=True, eq=False)
class FrameError(LinearEffect):
    """A constant error of the base or tool frame: a displacement and a turn."""

    xyz: Value = (0.0, 0.0, 0.0)
    rotvec: Value = (0.0, 0.0, 0.0)

    channel: ClassVar[str]
    of = 'robot'
    stage = Stage.LINK

    def per_unit(self, view: View) -> list[Shift]:
        return [single((self.channel, k), np.ones(()), view) for k in range(6)]

    def told(self, robot: Robot) -> Array:
        """
        Return the step as people are told it, shape (6,) [m, rad], along and about `_TOLD_ALONG`.

        The rows of a robot begin and end elsewhere than its controller has base and flange.
        """
        step, place = self.vector(), controller_frames(robot)
        if self.channel == 'tool':
            return np.concatenate([place.flange[:3, :3].T @ step[:3], step[3:]])
        if self.channel == 'root':
            foot = np.linalg.inv(robot.T_root_base)[:3, :3]
            return np.concatenate([robot.T_base_foot[:3, :3].T @ step[:3], foot.T @ step[3:]])
        rows = robot.T_world_base[:3, :3]
        base = np.eye(4) if robot.behind else place.base
        lever = rows @ base[:3, 3]
        swing = rotation_matrix(step[3:]) @ lever - lever
        return np.concatenate([step[:3] + swing, (rows @ base[:3, :3]).T @ step[3:]])

    def in_words(self, robot: Robot) -> str:
        """Return the step in mm and degrees, with whose axes they are."""
        return frame(self.told(robot), *_TOLD_ALONG[self.channel])


_TOLD_ALONG = {
    'base': ('of the measuring frame', 'of the base'),
    'root': ('of the base', 'of the positioner'),
    'tool': ('of the flange', 'of the tool'),
}
"""Along and about whose axes the step of a frame is told."""


@register
class BasePose(FrameError):
    """The base is displaced by xyz in the world and turned by rotvec about its own origin."""

    traits = replace(
        FrameError.traits,
        title='base pose error',
        meaning='the robot stands elsewhere than its base frame says',
        formula='R → exp(rotvec) R, origin → origin + xyz, world axes',
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
        if robot.behind:  # poses are measured in a frame that a positioner moves
            now, step = robot.T_world_base, self.vector()
            new = transform(rotation_matrix(step[3:]) @ now[:3, :3], now[:3, 3] + step[:3])
            before, after = (controller_pose(np.array(np.linalg.inv(pose))) for pose in (now, new))
            return (
                'Correct the frame on the workpiece: on the positioner it lies at '
                f'{after} in place of {before}. If it was right '
                'when it was measured, the fixture has moved, or another one is there.'
            )
        return (
            f'Correct the base frame by {self.in_words(robot)}. If it was right when it was '
            'measured, the arm has moved: check the bolts of its foot.'
        )


@register
class ToolPose(FrameError):
    """The tool point is displaced by xyz of the flange; the tool turns by rotvec of itself."""

    traits = replace(
        FrameError.traits,
        title='tool pose error',
        meaning='the tool is not where its tool frame says',
        formula='R → R exp(rotvec), origin → origin + xyz, flange axes',
        apart={'base_pose': 'measure the tool by itself'},
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
        moved = self.in_words(robot)
        return f'Correct the tool centre point by {moved}; a bent torch looks like this too.'


class _Search(SearchHooks):
    def fits(self, robot: Robot, joint: str | None) -> bool:
        return robot.behind > 0


@register
class RootPose(FrameError):
    """The positioner is displaced by xyz along the robot's base axes, and turned about its root."""

    traits = replace(
        FrameError.traits,
        title='root error of the positioner',
        meaning='the positioner stands elsewhere than its root frame says',
        formula="the positioner's foot in the robot's base: R → exp(rotvec) R, origin → origin "
        "+ xyz, axes of the base of the robot's rows; of a cell with a positioner",
        apart={
            'joint_offset': 'measure where the positioner stands beside the robot (points on both '
            'feet), or master the joint with its own gauge'
        },
        entered='root',
        depends_on='constant',
        place='base',
        lacking='is of a positioner, and robot {robot!r} has none; use base_pose',
    )
    channel = 'root'
    parameters = frame_parameters(
        Plausible.even(5e-3, 0.1, 'derived: a root that was measured by touch, or by hand'),
        Plausible.even(5e-3, 0.1, 'derived: five millimetres on a metre'),
    )
    search = Hooked(_Search)

    def stands(self, robot: Robot, base: Array) -> tuple[Array, Array]:
        """
        Return where the positioner's rows begin, as the robot file has it and as it is.

        In a base (4, 4), itself in the frame where the robot's own rows begin; ``T_base_root``,
        (4, 4) [m].
        """
        now, step = np.linalg.inv(robot.T_root_base), self.vector()
        new = now.copy()
        new[:3, :3] = rotation_matrix(step[3:]) @ now[:3, :3]
        new[:3, 3] += step[:3]
        there = np.linalg.inv(base)
        return np.asarray(there @ now), np.asarray(there @ new)

    def remedy(self, robot: Robot) -> str:
        now, new = self.stands(robot, robot.T_base_foot)
        return (
            f'Correct the root frame of the positioner by {self.in_words(robot)}: in the base '
            f'of the robot it stands at {controller_pose(new)} in place of {controller_pose(now)}.'
        )
