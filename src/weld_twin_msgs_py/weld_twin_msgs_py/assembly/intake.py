# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages to rows of numbers, each stream in the order of its stamps, which may begin anew."""

from collections.abc import Callable
from enum import Enum
from math import hypot, isfinite, nan
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import matrix_from_quaternion
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from ..messages import from_messages
from .foreign_types import SURE_POSE
from .frames import MeasuringFrame, WrenchFrame
from .joint_states import JointSample, JointStates

RESTART_AFTER = 10
"""Refusals in a row, in order among themselves, after which time has started anew."""


class Late(DataError):
    """The stamp of a sample is so far [ns] behind the last one of its stream; 0 if it repeats."""

    def __init__(self, sentence: str, behind: int = 0) -> None:
        super().__init__(sentence)
        self.behind = behind


class Forward:
    """Lets stamps [ns] through that increase; one bad stamp costs a sample, not the stream."""

    def __init__(self) -> None:
        self.last: int | None = None
        self._behind: list[int] = []
        self._ended: int | None = None
        self._late = 0

    def reset(self) -> None:
        """Begin anew, as after a jump of the clock; what was under way has stamps that go on."""
        self._ended = self._ended if self.last is None else self.last
        self.last = None
        self._behind.clear()
        self._late = 0

    def restarted_at(self, stamp: int) -> bool:
        """Take a stamp; return whether it begins a new run, as of a bag played again, or raise Late."""
        if self.last is None and self._ended is not None and stamp > self._ended:
            self._late += 1
            if self._late < RESTART_AFTER:
                raise Late(f'the stamp {stamp * 1e-9:.6f} s is of before the clock jumped')
        if self.last is None or stamp > self.last:
            self.last, self._ended = stamp, None
            self._behind.clear()
            return False
        if self._behind and stamp <= self._behind[-1]:
            self._behind.clear()
        self._behind.append(stamp)
        if len(self._behind) < RESTART_AFTER:
            raise Late(
                f'the stamp {stamp * 1e-9:.6f} s is not after the last one, '
                f'{self.last * 1e-9:.6f} s; the sample is left out',
                self.last - stamp,
            )
        self.last = stamp
        self._behind.clear()
        return True


UNIT = 0.009
"""By how much the length of a quaternion may differ from one without a closer look."""

PLAIN, COVARIANCE = 8, 36
"""Numbers of a pose with its sigma, and of its covariance."""


class Role(Enum):
    """What the messages of a topic tell."""

    JOINTS = 'joints'
    POSE = 'pose'
    POINT = 'point'
    SIGMA = 'sigma'
    WRENCH = 'wrench'
    TEMPERATURE = 'temperature'


class Taken(NamedTuple):
    """A message that has its place in its stream."""

    stamp: int  # [ns]
    row: Array
    """Joints: positions, then velocities, NaN where they are missing, then efforts where they
    were asked for, shape (width,). Pose: position, quaternion x y z w, sigma [m] or NaN, and its
    covariance where its type has one. Point, sigma: three numbers. Wrench: force and torque.
    Temperature: one number."""
    restarted: bool  # it begins a new run: the stamps before it lie in its future


class Intake:
    """
    Takes the messages of one cell; what it is given is explained in `JointStates`.

    measuring_frame: what poses and points must be given in; empty for the first frame that comes.
    """

    def __init__(
        self,
        robot: Robot,
        *,
        limits: bool = True,
        measuring_frame: str = '',
        joint_names: tuple[str, ...] | None = None,
        mend: bool = False,
        efforts: bool = False,
    ) -> None:
        self.measuring_frame = MeasuringFrame(measuring_frame)
        self.joints = JointStates(
            robot, limits=limits, joint_names=joint_names, mend=mend, efforts=efforts
        )
        self._runs = 2 + efforts
        self.wrench_frame = WrenchFrame(robot)
        self._orders = {role: Forward() for role in Role}
        self._rows: dict[Role, Callable[[Any], Array]] = {
            Role.POSE: _pose_row,
            Role.POINT: from_messages.point,
            Role.SIGMA: from_messages.vector3,
            Role.WRENCH: self._wrench_row,
            Role.TEMPERATURE: lambda message: np.array([from_messages.temperature(message)]),
        }

    @staticmethod
    def width(role: Role, robot: Robot, kind: str = '', *, efforts: bool = False) -> int:
        """Return how many numbers a row of messages of a type has."""
        pose = PLAIN + COVARIANCE * (kind == SURE_POSE)
        widths = {
            Role.POSE: pose,
            Role.POINT: 3,
            Role.SIGMA: 3,
            Role.WRENCH: 6,
            Role.TEMPERATURE: 1,
        }
        return widths.get(role, (2 + efforts) * robot.n)

    @property
    def remarks(self) -> list[str]:
        """Return what to report about names and frames that were taken for granted."""
        parts = (self.joints, self.measuring_frame, self.wrench_frame)
        joints = self.joints
        remarks = [
            *(each.remark for each in parts),
            joints.velocity_remark,
            joints.beside.remark,
        ]
        return [remark for remark in remarks if remark]

    def last(self, role: Role) -> int | None:
        """Return the stamp of the last sample of a stream [ns]."""
        return self._orders[role].last

    def reset(self) -> None:
        """Begin anew, as after a jump of the clock."""
        for order in self._orders.values():
            order.reset()

    def take(self, role: Role, message: Any) -> Taken | None:
        """
        Return the sample that a message gives, None if joints of other messages are awaited.

        After Unstamped, Late, Incomplete and OtherFrame the stream goes on without the sample.
        """
        if role is Role.JOINTS:
            return self._joints(message)
        stamp = from_messages.stamp_ns(message)
        row = self._rows[role](message)
        if role in (Role.POSE, Role.POINT):
            self.measuring_frame.take(message.header.frame_id)
        return Taken(stamp, row, self._orders[role].restarted_at(stamp))

    def joint_sample(self, message: Any) -> tuple[JointSample, bool] | None:
        """Return the sample of a joint state, and whether it begins a new run; as `take`."""
        sample = self.joints.take(message)
        if sample is None:
            return None
        return sample, self._orders[Role.JOINTS].restarted_at(sample.stamp)

    def _joints(self, message: Any) -> Taken | None:
        taken = self.joint_sample(message)
        if taken is None:
            return None
        (stamp, q, qd, effort), restarted = taken
        row = np.empty(self._runs * q.size)
        row[: q.size], row[q.size : 2 * q.size] = q, nan if qd is None else qd
        if effort is not None:
            row[2 * q.size :] = effort
        return Taken(stamp, row, restarted)

    def _wrench_row(self, message: Any) -> Array:
        row = from_messages.wrench(message)
        self.wrench_frame.take(message.header.frame_id)
        return row


def _pose_row(message: Any) -> Array:
    """Return position, quaternion, sigma (NaN when the message has none), and a covariance."""
    inner = getattr(message.pose, 'pose', message.pose)
    p, q = inner.position, inner.orientation
    plain = inner is message.pose
    sigma = None if plain else from_messages.position_sigma(message)
    row = [p.x, p.y, p.z, q.x, q.y, q.z, q.w, nan if sigma is None else sigma]
    if not (isfinite(sum(row[:3])) and abs(hypot(*row[3:7]) - 1.0) < UNIT):
        from_messages.pose(message)  # has the sentence, and the bound
    return np.array(row if plain else [*row, *message.pose.covariance])


def rotations(rows: Array) -> Array:
    """Return the rotation matrices, shape (N, 3, 3), of pose rows, shape (N, 8 or 44)."""
    return matrix_from_quaternion(rows[:, 3:7], 'orientation')
