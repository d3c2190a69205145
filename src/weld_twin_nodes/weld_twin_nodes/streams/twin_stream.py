# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Joint states in, stamped poses out: what the injector and the twin both do with a message."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.twin.poses import Poses
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.messages import from_messages

from .joint_assembly import JointStates
from .stamp_order import Forward


class Sample(NamedTuple):
    """
    The arm at one joint stamp.

    Attributes
    ----------
    stamp : int [ns]
        Of the joint state.
    pose_stamp : int [ns]
        Of a measurement that shows this pose; later by the delay of the measurement clock.
    q : array, shape (n,) [rad or m]
    poses : Poses
        One position (3,) and rotation (3, 3).

    """

    stamp: int
    pose_stamp: int
    q: Array
    poses: Poses


class JointStream:
    """A live twin fed with messages; wrench and temperature are held until the next one."""

    def __init__(self, twin: Twin) -> None:
        self._live = twin.live()
        self._delay = round(twin.delay * from_messages.NANOSECONDS)
        self.joints = JointStates(twin.robot)
        self._order = Forward()
        self._epoch: int | None = None
        self._before: tuple[int, Array] | None = None
        self._wrench: Array | None = None
        self._wrench_frame = 'tool'
        self._temperature: float | None = None

    @property
    def twin(self) -> Twin:
        """Return the robot with its effects."""
        return self._live.twin

    def change(self, twin: Twin) -> None:
        """Go on with other effects; those that stay keep their memory."""
        self._live.twin = twin
        self._delay = round(twin.delay * from_messages.NANOSECONDS)

    def reset(self) -> None:
        """Begin anew, as after a jump of the clock; wrench and temperature hold."""
        self._order.reset()
        self._forget()

    def _forget(self) -> None:
        self._live.reset()
        self._epoch = self._before = None

    def take_wrench(self, message: Any) -> None:
        """Take the load on the tool."""
        self._wrench = from_messages.wrench(message)
        self._wrench_frame = 'base' if 'base' in message.header.frame_id else 'tool'

    def take_temperature(self, message: Any) -> None:
        """Take the temperature."""
        self._temperature = from_messages.temperature(message)

    def step(self, message: Any) -> Sample | None:
        """
        Return the arm at a joint state, None while joints of other publishers are awaited.

        Raises
        ------
        DataError
            The message cannot be used; nothing has changed then.

        """
        sample = self.joints.take(message)
        if sample is None:
            return None
        stamp, q, qd = sample
        if self._order.restarted_at(stamp):
            self._forget()
        if self._epoch is None:
            self._epoch = stamp
        if qd is None:
            qd = self._difference(stamp, q)
        joints, poses = self._live.step(
            (stamp - self._epoch) * 1e-9,
            q,
            qd,
            self._wrench,
            self._temperature,
            self._wrench_frame,
        )
        self._before = (stamp, q)
        return Sample(stamp, stamp + self._delay, joints, poses)

    def _difference(self, stamp: int, q: Array) -> Array:
        """Return the velocity since the sample before, for controllers that do not tell it."""
        if self._before is None:
            return np.zeros_like(q)
        return (q - self._before[1]) * (from_messages.NANOSECONDS / (stamp - self._before[0]))
