# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Names of the frames in message headers, and which frame of ours each of them means."""

from os.path import commonprefix

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.errors import DataError

WORLD = 'world'
"""The measuring frame: measured and twin poses are given in it."""
BASE = 'base'
"""The robot's base: deviations are given in it."""

BASE_NAMES = ('base', 'base_link', 'base_link_inertia', 'robot_base')
MEASURING_NAMES = (WORLD, 'map', 'measuring', 'tracker')
TOOL_NAMES = ('', 'tool', 'tool0', 'tcp', 'tool_frame', 'tool_link', 'tool_center_point')


class OtherFrame(DataError):
    """A message is given in a frame that the messages before it were not given in."""


def plain_name(frame_id: str, robot: Robot) -> str:
    """Return a frame's name in lower case, without namespace and without the arm's prefix."""
    name = frame_id.strip().rpartition('/')[2].lower()
    shared = commonprefix(robot.joint_names)  # noqa: RUF071 - names, not paths
    prefix = shared.rpartition('_')[0].lower()
    return name.removeprefix(f'{prefix}_') if prefix else name


class MeasuringFrame:
    """The frame of a stream of measurements: the one expected, else the first that comes."""

    what, means = 'measurement', 'the measuring frame'
    named_by, other = 'measuring_frame', 'measuring_frame and T_measuring_base'

    def __init__(self, expected: str = '') -> None:
        self._expected = expected.strip('/')
        self._frame_id: str | None = None
        self.remark = ''

    def take(self, frame_id: str) -> None:
        """Take the frame of a measurement; raise OtherFrame where it is not that of the others."""
        if frame_id == self._frame_id:
            return
        name = frame_id.strip('/')
        if self._expected and name not in ('', self._expected):
            raise OtherFrame(
                f'the {self.what} is given in {frame_id!r}, but {self.named_by} is '
                f'{self._expected!r}; publish it in that frame, or set {self.other} for the other'
            )
        if self._frame_id is not None and name != self._frame_id.strip('/'):
            raise OtherFrame(
                f'the {self.what} is given in {frame_id!r}, those before it in '
                f'{self._frame_id!r}; publish one frame on one topic'
            )
        self._frame_id = frame_id
        self.remark = (
            f'{self.what}s are given in {frame_id!r}; it is taken for {self.means}'
            if name
            else f'{self.what}s name no frame; they are taken to be in {self.means}'
        )


class PlannedFrame(MeasuringFrame):
    """The frame of a stream of poses that a planner sends: that of the robot's base."""

    what, means = 'pose', "the robot's base"
    named_by = other = 'base_frame'


class WrenchFrame:
    """
    The frame of a stream of wrenches: 'tool' or 'base', by the name in the headers.

    One of `TOOL_NAMES` means the tool, one of `BASE_NAMES` the base, one of `MEASURING_NAMES` the
    base too where it is not turned against the measuring frame. A name that holds the word base
    but is none of these is refused, for it may be either; every other name is taken for the
    tool's, and `remark` tells it.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._frame_id: str | None = None
        self.meaning = 'tool'
        self.remark = ''

    def take(self, frame_id: str) -> None:
        """Take the frame of a wrench; raise OtherFrame where others had another."""
        if frame_id == self._frame_id:
            return
        meaning, remark = self._read(frame_id)
        if self._frame_id is not None and meaning != self.meaning:
            raise OtherFrame(
                f'the wrench is given in {frame_id!r}, those before it in {self._frame_id!r}; '
                'publish one frame on one topic'
            )
        self._frame_id, self.meaning, self.remark = frame_id, meaning, remark

    def _read(self, frame_id: str) -> tuple[str, str]:
        name = plain_name(frame_id, self._robot)
        if name in TOOL_NAMES:
            return 'tool', ''
        if name in BASE_NAMES:
            return 'base', ''
        if name in MEASURING_NAMES:
            turned = not np.allclose(self._robot.T_world_origin[:3, :3], np.eye(3), atol=1e-9)
            if turned or self._robot.behind:
                raise DataError(
                    f'the wrench is given in the measuring frame, {frame_id!r}, which is turned '
                    'against the base; publish it in the tool or base frame'
                )
            return 'base', ''
        if 'base' in name.split('_'):
            raise DataError(
                f"the wrench's frame {frame_id!r} may be the robot's base or part of the tool; "
                "publish it in 'base' or in 'tool'"
            )
        return 'tool', f"the wrench's frame {frame_id!r} is taken for the tool frame"
