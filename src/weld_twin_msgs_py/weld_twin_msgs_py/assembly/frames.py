# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames as `/tf` tells them, with or without tf2, and what their names in headers mean."""

from bisect import bisect_left
from collections import deque
from collections.abc import Iterator
from math import hypot, isfinite
from os.path import commonprefix
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import (
    matrix_from_quaternion,
    rotation_matrix,
    rotation_vector,
    transform,
)
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from ..messages.from_messages import NANOSECONDS, time_ns

KEPT = 10.0
"""Seconds of a moving frame that are kept, as tf2 keeps them."""
UNIT = 0.009
"""By how much the length of a quaternion may differ from one and be taken unasked."""
GAP = 1.0
"""Longest step [s] between two places that is interpolated; in a longer one anything may go on."""


class NoTransform(DataError):
    """The way from one frame to another is not known at a stamp, and will not be."""


class NotYet(NoTransform):
    """It is not known yet: a frame on the way was published up to just before the stamp."""


class StampedPose(NamedTuple):
    """Where a frame is in its parent, in numbers as they came: most are never asked for."""

    stamp: int  # [ns]
    position: tuple[float, float, float]  # [m]
    quaternion: tuple[float, float, float, float]  # x y z w

    @property
    def T_parent_child(self) -> Array:
        """Return it as a matrix, shape (4, 4)."""
        return transform(matrix_from_quaternion(self.quaternion), np.array(self.position))


class Branch:
    """A frame and its parent; the newest places of a moving one."""

    def __init__(self, parent: str, *, static: bool) -> None:
        self.parent = parent
        self.static = static
        self.places: deque[StampedPose] = deque()

    def add(self, place: StampedPose) -> None:
        """Take a place; one that is not newer than the last counts as said before."""
        if self.static:
            self.places.clear()
        elif self.places and place.stamp <= self.places[-1].stamp:
            if self.places[-1].stamp - place.stamp < KEPT * NANOSECONDS:
                return
            self.places.clear()  # the clock begins anew
        self.places.append(place)
        while place.stamp - self.places[0].stamp > KEPT * NANOSECONDS:
            self.places.popleft()

    def at(self, stamp: int, child: str) -> Array:
        """Return T_parent_child (4, 4) at a stamp [ns], between two places where it moves."""
        if self.static:
            return self.places[-1].T_parent_child
        first, last = self.places[0].stamp, self.places[-1].stamp
        if stamp > last:
            late = (stamp - last) * 1e-9
            raise NotYet(
                f'the last transform of {child!r} in {self.parent!r} is {late:.3g} s older than '
                'the measurement'
            )
        if stamp < first:
            raise NoTransform(
                f'the first transform of {child!r} in {self.parent!r} is '
                f'{(first - stamp) * 1e-9:.3g} s newer than the measurement'
            )
        k = bisect_left(self.places, stamp, key=lambda place: place.stamp)
        after = self.places[k]
        if after.stamp == stamp:
            return after.T_parent_child
        if after.stamp - self.places[k - 1].stamp > GAP * NANOSECONDS:
            raise NoTransform(
                f'the transforms of {child!r} in {self.parent!r} have a hole of '
                f'{(after.stamp - self.places[k - 1].stamp) * 1e-9:.3g} s around the measurement'
            )
        return _between(self.places[k - 1], after, stamp)


def _between(before: StampedPose, after: StampedPose, stamp: int) -> Array:
    """Return the place at a stamp between two: a straight way, and a turn about one axis."""
    share = (stamp - before.stamp) / (after.stamp - before.stamp)
    A, B = before.T_parent_child, after.T_parent_child
    turn = rotation_vector(A[:3, :3].T @ B[:3, :3])
    position = A[:3, 3] + share * (B[:3, 3] - A[:3, 3])
    return transform(A[:3, :3] @ rotation_matrix(share * turn), position)


def _stamped_pose(each: Any) -> StampedPose:
    p, q, child = each.transform.translation, each.transform.rotation, each.child_frame_id
    if not isfinite(p.x + p.y + p.z):
        raise DataError(f'the transform of {child!r} is not finite')
    quaternion = q.x, q.y, q.z, q.w
    if not abs(hypot(*quaternion) - 1.0) < UNIT:
        matrix_from_quaternion(quaternion, f'rotation of {child!r}')  # has the sentence, the bound
    return StampedPose(time_ns(each.header.stamp), (p.x, p.y, p.z), quaternion)


class TransformTree:
    """The frames of a cell; each has one parent."""

    def __init__(self) -> None:
        self._branches: dict[str, Branch] = {}

    def clear(self) -> None:
        """Forget the frames that move, as after a jump of the clock; fixed ones stay."""
        self._branches = {k: each for k, each in self._branches.items() if each.static}

    def take(self, message: Any, *, static: bool = False) -> None:
        """Take the transforms of a message; refuse one that is none only when the others are taken."""
        wrong: DataError | None = None
        for each in message.transforms:
            parent, child = each.header.frame_id.strip('/'), each.child_frame_id.strip('/')
            try:
                self._add(parent, child, _stamped_pose(each), static=static)
            except DataError as error:
                wrong = error
        if wrong is not None:
            raise wrong

    def _add(self, parent: str, child: str, place: StampedPose, *, static: bool) -> None:
        branch = self._branches.get(child)
        if branch is None or branch.parent != parent or branch.static != static:
            above = [parent, *self._above(parent)]
            if child in above:
                ring = ' in '.join(repr(name) for name in above[: above.index(child) + 1])
                raise DataError(f'the transform of {child!r} makes a loop: {child!r} in {ring}')
            branch = self._branches[child] = Branch(parent, static=static)
        branch.add(place)

    def _above(self, frame: str) -> Iterator[str]:
        """Yield the frames above one, the nearest first."""
        while frame in self._branches:
            frame = self._branches[frame].parent
            yield frame

    def parent(self, frame: str) -> str:
        """Return the parent frame of another, empty where nobody published it."""
        branch = self._branches.get(frame)
        return '' if branch is None else branch.parent

    def moves(self, target: str, source: str) -> bool:
        """Return whether the way between two frames may change with time."""
        way = {target, *self._above(target)} ^ {source, *self._above(source)}
        return any(not self._branches[name].static for name in way if name in self._branches)

    def between(self, target: str, source: str, stamp: int) -> Array:
        """
        Return T_target_source, shape (4, 4), at a stamp [ns].

        Raises NotYet: a frame on the way was not published up to the stamp. Raises
        NoTransform: no transforms join the two, or none of the time of the stamp is left.
        """
        up = [target, *self._above(target)]
        down = [source, *self._above(source)]
        common = next((name for name in down if name in up), None)
        if common is None:
            unknown = [name for name in (source, target) if name not in self._known()]
            reason = f'{unknown[0]!r} is not in /tf' if unknown else 'nothing in /tf joins them'
            raise NoTransform(f'the way from {source!r} to {target!r} is not known: {reason}')
        to_common = self._product(down[: down.index(common)], stamp)
        return self._inverse(self._product(up[: up.index(common)], stamp)) @ to_common

    def latest(self, target: str, source: str) -> Array:
        """Return T_target_source, shape (4, 4), at the last time that all of the way is known."""
        way = {target, *self._above(target)} ^ {source, *self._above(source)}
        branches = [self._branches[name] for name in way if name in self._branches]
        last = [branch.places[-1].stamp for branch in branches if not branch.static]
        return self.between(target, source, min(last, default=0))

    def _known(self) -> set[str]:
        return {*self._branches, *(branch.parent for branch in self._branches.values())}

    def _product(self, frames: list[str], stamp: int) -> Array:
        """Return the first frame's place in the parent of the last one."""
        out = np.eye(4)
        for name in frames:
            out = self._branches[name].at(stamp, name) @ out
        return out

    @staticmethod
    def _inverse(T: Array) -> Array:
        return transform(T[:3, :3].T, -T[:3, :3].T @ T[:3, 3])


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
