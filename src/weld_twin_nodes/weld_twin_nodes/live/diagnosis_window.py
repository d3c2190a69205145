# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The last minute of a running cell, ready to be diagnosed."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from itertools import dropwhile
from typing import Any

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.assembly import Intake, Role, Samples, assembled
from weld_twin_msgs_py.bags.images import Image
from weld_twin_msgs_py.messages.from_messages import NANOSECONDS, stamp_ns
from weld_twin_msgs_py.messages.image_points import points

LONGEST = 50_000
"""Samples of a stream kept at most, whatever its rate."""
MOTION = 0.02
"""Range [rad or m] some joint must have travelled before a diagnosis makes sense."""
FEWEST = 50
"""Samples below which a window is not diagnosed: half a second at 100 Hz."""

FEWEST_IMAGES = 20
"""The same of images: each is a whole pose, and a camera gives few of them in a second."""

Row = tuple[int, Array]
SIGNALS = (Role.WRENCH, Role.TEMPERATURE)
"""Streams whose last sample from before the window is still in force in it."""


class Window:
    """
    Streams of the cell over a sliding window, bounded in time and number.

    duration: [s]
    measuring_frame: what measurements must be given in; empty for the first frame that comes.
    joint_names: what the joint states call the joints, in the order of the robot.
    """

    def __init__(
        self,
        robot: Robot,
        duration: float,
        measuring_frame: str = '',
        joint_names: tuple[str, ...] | None = None,
    ) -> None:
        self._robot = robot
        self._duration = round(duration * NANOSECONDS)
        self.intake = Intake(
            robot, measuring_frame=measuring_frame, joint_names=joint_names, mend=True
        )
        self._streams: dict[Role, deque[Row]] = {}
        self._images: deque[Image] = deque(maxlen=LONGEST)

    def reset(self) -> None:
        """Forget everything, as after a jump of the clock."""
        self._streams.clear()
        self._images.clear()
        self.intake.reset()

    @property
    def last(self) -> int | None:
        """Return the stamp of the last measurement [ns]."""
        measured = self._measured()[1] or self._images
        return measured[-1][0] if measured else None

    @property
    def images(self) -> tuple[Image, ...]:
        """Return what cameras saw since the first joint state; nothing beside poses or points."""
        joints = self._streams.get(Role.JOINTS)
        if not joints or self._measured()[1]:
            return ()
        return tuple(image for image in self._images if image[0] >= joints[0][0])

    def take_image(self, message: Any) -> None:
        """
        Take the points that a camera found in an image.

        Raises DataError: it cannot be used; the window is as it was.
        """
        self._images.append((stamp_ns(message), message.header.frame_id, points(message)))
        while self._images[-1][0] - self._images[0][0] > self._duration:
            self._images.popleft()

    def take(self, role: Role, message: Any) -> None:
        """
        Take a message.

        Raises DataError: it cannot be used; the window is as it was.
        """
        taken = self.intake.take(role, message)
        if taken is None:
            return
        if taken.restarted:
            self._streams.clear()
        stream = self._streams.setdefault(role, deque(maxlen=LONGEST))
        stream.append((taken.stamp, taken.row))
        oldest = 1 if role in SIGNALS else 0
        while len(stream) > oldest and taken.stamp - stream[oldest][0] > self._duration:
            stream.popleft()

    def _measured(self) -> tuple[Role, deque[Row]]:
        role = Role.POSE if self._streams.get(Role.POSE) else Role.POINT
        return role, self._streams.get(role, deque())

    def recording(self, least: float) -> Recording | None:
        """
        Return what the window holds, or None while it is too little to be diagnosed.

        What images tell is for whoever has the time: `images`.

        least: shortest time that measurements and joint states must overlap [s].
        """
        joints = self._streams.get(Role.JOINTS)
        role, measured = self._measured()
        seen = self.images
        if not joints or len(joints) < FEWEST:
            return None
        if len(measured) < FEWEST and len(seen) < FEWEST_IMAGES:
            return None
        epoch = joints[0][0]
        first, last = (measured or seen)[0][0], (measured or seen)[-1][0]
        overlap = min(joints[-1][0], last) - max(epoch, first)
        motion = _samples(joints)
        if (
            overlap * 1e-9 < least
            or np.ptp(motion.rows[:, : self._robot.n], axis=0).max() < MOTION
        ):
            return None
        streams = {Role.JOINTS: motion}
        if measured:
            streams[role] = _samples(dropwhile(lambda row: row[0] < epoch, measured))
        for side in (Role.SIGMA, *SIGNALS):
            if self._streams.get(side):
                streams[side] = _samples(self._streams[side])
        return assembled(
            'live', self._robot, streams, wrench_frame=self.intake.wrench_frame.meaning
        )


def _samples(rows: Iterable[Row]) -> Samples:
    stamps, values = zip(*rows, strict=True)
    return Samples(np.array(stamps, dtype=np.int64), np.stack(values))
