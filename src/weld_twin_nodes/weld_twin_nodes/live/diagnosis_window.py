# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The last minute of a running cell, ready to be diagnosed."""

from __future__ import annotations

from collections import deque
from itertools import dropwhile
from typing import Any

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.recording import JointMotion, Measurements, Recording, Signal
from weld_twin_msgs_py.messages import from_messages

from ..streams.joint_assembly import JointStates
from ..streams.stamp_order import Forward

LONGEST = 50_000
"""Samples of a stream kept at most, whatever its rate."""
MOTION = 0.02
"""Range [rad or m] some joint must have travelled before a diagnosis makes sense."""
FEWEST = 50

Row = tuple[int, Array]


class Window:
    """
    Streams of the cell over a sliding window, bounded in time and number.

    Parameters
    ----------
    robot : Robot
    duration : float [s]

    """

    def __init__(self, robot: Robot, duration: float) -> None:
        self._robot = robot
        self._duration = round(duration * from_messages.NANOSECONDS)
        self._wrench_frame = 'tool'
        self._joints = JointStates(robot)
        self._streams: dict[str, deque[Row]] = {}
        self._orders: dict[str, Forward] = {}

    def reset(self) -> None:
        """Forget everything, as after a jump of the clock."""
        self._streams.clear()
        for order in self._orders.values():
            order.reset()

    @property
    def last(self) -> int | None:
        """Return the stamp of the last measurement [ns]."""
        measured = self._measured()
        return measured[-1][0] if measured else None

    def take_joints(self, message: Any) -> None:
        """Take a joint state; a velocity that is not told stays open."""
        sample = self._joints.take(message)
        if sample is not None:
            stamp, q, qd = sample
            row = np.concatenate([q, np.full(q.size, np.nan) if qd is None else qd])
            self._add('joints', stamp, row)

    def take_pose(self, message: Any) -> None:
        """Take a measured pose."""
        position, rotation = from_messages.pose(message)
        self._add(
            'pose', from_messages.stamp_ns(message), np.concatenate([position, rotation.ravel()])
        )

    def take_point(self, message: Any) -> None:
        """Take a measured point."""
        self._add('point', from_messages.stamp_ns(message), from_messages.point(message))

    def take_wrench(self, message: Any) -> None:
        """Take the load on the tool."""
        self._wrench_frame = 'base' if 'base' in message.header.frame_id else 'tool'
        self._add('wrench', from_messages.stamp_ns(message), from_messages.wrench(message))

    def take_temperature(self, message: Any) -> None:
        """Take the temperature."""
        value = from_messages.temperature(message)
        self._add('temperature', from_messages.stamp_ns(message), np.array([value]))

    def _add(self, name: str, stamp: int, row: Array) -> None:
        if self._orders.setdefault(name, Forward()).restarted_at(stamp):
            self._streams.clear()
        stream = self._streams.setdefault(name, deque(maxlen=LONGEST))
        stream.append((stamp, row))
        while stamp - stream[0][0] > self._duration:
            stream.popleft()

    def _measured(self) -> deque[Row]:
        return self._streams.get('pose') or self._streams.get('point') or deque()

    def recording(self, least: float) -> Recording | None:
        """
        Return what the window holds, or None while it is too little to be diagnosed.

        Parameters
        ----------
        least : float [s]
            Shortest time that measurements and joint states must overlap.

        """
        joints, measured = self._streams.get('joints'), self._measured()
        if not joints or len(measured) < FEWEST or len(joints) < FEWEST:
            return None
        overlap = min(joints[-1][0], measured[-1][0]) - max(joints[0][0], measured[0][0])
        values = np.stack([row for _, row in joints])
        n = self._robot.n
        if overlap * 1e-9 < least or np.ptp(values[:, :n], axis=0).max() < MOTION:
            return None
        epoch = joints[0][0]
        qd = None if np.isnan(values[:, n:]).any() else values[:, n:]
        inside = list(dropwhile(lambda row: row[0] < epoch, measured))
        return Recording(
            'live',
            JointMotion(_seconds(joints, epoch), values[:, :n], qd),
            _measurements(inside, epoch),
            self._signal('wrench', epoch),
            self._wrench_frame,
            self._signal('temperature', epoch),
            epoch,
        )

    def _signal(self, name: str, epoch: int) -> Signal | None:
        stream = self._streams.get(name)
        if not stream:
            return None
        values = np.stack([row for _, row in stream])
        return Signal(_seconds(stream, epoch), values[:, 0] if values.shape[1] == 1 else values)


def _seconds(rows: Any, epoch: int) -> Array:
    return np.array([stamp - epoch for stamp, _ in rows], dtype=np.float64) * 1e-9


def _measurements(rows: list[Row], epoch: int) -> Measurements:
    values = np.stack([row for _, row in rows])
    rotation = values[:, 3:].reshape(-1, 3, 3) if values.shape[1] > 3 else None
    return Measurements(_seconds(rows, epoch), values[:, :3], rotation)
