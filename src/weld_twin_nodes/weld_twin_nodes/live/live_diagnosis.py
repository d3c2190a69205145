# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Live diagnosis: the verdict over the last minute of the cell, once there is evidence for one."""

import time
from collections import deque
from collections.abc import Iterable, Sequence
from functools import partial
from itertools import dropwhile
from typing import Any, ClassVar

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.algebra.problem import frames_named
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.assembly import Intake, Role, Samples, assembled
from weld_twin_msgs_py.bags.images import Image
from weld_twin_msgs_py.messages import topics
from weld_twin_msgs_py.messages.from_messages import NANOSECONDS, stamp_ns
from weld_twin_msgs_py.messages.image_points import points

from ..offline.given_twin import build_twin, given_cameras
from .diagnosis_worker import Finding, Job, Worker
from .managed_node import ManagedNode
from .robot_settings import (
    JOINT_SETTINGS,
    MEASURED_SETTINGS,
    ROBOT_SETTINGS,
    MeasuredInputs,
    place_twin,
    robot_of,
)
from .run_node import run
from .settings import Setting

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
    """Streams of the cell over a sliding window, bounded in time [s] and number."""

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
        """Take the points that a camera found in an image; nothing where they are of no use."""
        self._images.append((stamp_ns(message), message.header.frame_id, points(message)))
        while self._images[-1][0] - self._images[0][0] > self._duration:
            self._images.popleft()

    def take(self, role: Role, message: Any) -> None:
        """Take a message; nothing of one that cannot be used."""
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
        Return what the window holds, or None while it overlaps too short [s] to be diagnosed.

        What images tell is for whoever has the time: `images`.
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


LOOK_EVERY = 0.2
"""Seconds between two looks at whether the worker has finished."""
LEVELS = {'none': 0, 'identified': 1, 'ambiguous': 1, 'unknown': 1, 'unsound': 2}
"""Of the diagnostic message: ok, a warning, or an error where data or set-up are wrong."""
INPUTS = {
    topics.TOOL_WRENCH: Role.WRENCH,
    topics.TEMPERATURE: Role.TEMPERATURE,
    topics.MEASURED_SIGMA: Role.SIGMA,
    topics.JOINT_STATES: Role.JOINTS,
}


class LiveDiagnosis(ManagedNode):
    """
    Diagnoses a sliding window again and again, in another process.

    From the first gap on every verdict is published, so that its end is reported too.
    """

    settings: ClassVar[tuple[Setting, ...]] = (
        *ManagedNode.settings,
        *ROBOT_SETTINGS,
        *JOINT_SETTINGS,
        *MEASURED_SETTINGS,
        Setting('model', '', 'what the twin knows: an effects file or diagnosis.json'),
        Setting('align', '', 'frames fitted along: base, tool, or base,tool'),
        Setting('cameras', '', 'camera_info of each camera: NAME=FILE, with commas between'),
        Setting('targets', '', 'what they look at: NAME=FILE, with commas between'),
        Setting('window', 60.0, 'length of the window [s]', 1.0, 600.0),
        Setting('least', 5.0, 'shortest stretch that is diagnosed [s]', 0.5, 600.0),
        Setting('every', 15.0, 'shortest time from one diagnosis to the next [s]', 0.0, 3600.0),
    )

    def __init__(self, **kwargs: Any) -> None:
        super().__init__('live_diagnosis', **kwargs)
        self._twin = place_twin(self, build_twin(robot_of(self), self.setting('model')))
        self._align = frames_named(self.setting('align'))
        texts = (
            [part for part in self.setting(name).split(',') if part]
            for name in ('cameras', 'targets')
        )
        cameras, targets = given_cameras(*texts)
        self._names = topics.TopicNames(cameras=cameras, targets=targets)
        self._window = self._empty_window()
        self._worker = Worker(self.get_logger().warning)
        self._begun = -float('inf')
        self._seen: int | None = None
        self._speaking = False
        self._printed = ''
        self._verdict = self.offer(topics.DIAGNOSIS)
        self._measured: MeasuredInputs | None = None
        self._looking: Any = None
        self.start()

    def prepare(self) -> None:
        """Nothing is left to look at: robot and model were read when the node started."""

    def begin(self) -> None:
        """Listen, and diagnose from time to time."""
        for topic, role in INPUTS.items():
            required, hold_last = role is Role.JOINTS, role in SIGNALS
            self.listen(topic, partial(self._take, role), required=required, hold_last=hold_last)
        if self._names.cameras:
            self.listen(topics.IMAGE_POINTS, self._window.take_image)
        self._measured = MeasuredInputs(self, self._take)
        self._looking = self.every(LOOK_EVERY, self._look)

    def finish(self) -> None:
        """Listen no more; forget the window and the diagnosis under way."""
        self.stop_listening()
        if self._looking is not None:
            self.destroy_timer(self._looking)
        self._worker.stop()
        self._worker = Worker(self.get_logger().warning)
        self._measured, self._seen = None, None
        self._window = self._empty_window()
        self._begun = -float('inf')

    def _empty_window(self) -> Window:
        """Return a window that has heard nothing; after a jump of the clock one is reset instead."""
        return Window(
            self._twin.robot,
            self.setting('window'),
            self.setting('measuring_frame'),
            self.joint_names,
        )

    def destroy_node(self) -> None:
        """End the diagnosis under way."""
        self._worker.stop()
        super().destroy_node()

    def intakes(self) -> Sequence[Intake]:
        return (self._window.intake,)

    def _take(self, role: Role, message: Any) -> None:
        self._window.take(role, message)

    def time_went_back(self) -> None:
        if self._measured is not None:
            self._measured.clear()
        self._window.reset()
        self._seen = None

    def _look(self) -> None:
        """Publish what has been found, and begin anew where there is something new."""
        if self._worker.busy:
            return
        self._tell(self._worker.take())
        now = time.monotonic()
        if now - self._begun < self.setting('every') or self._window.last == self._seen:
            return
        recording = self._window.recording(self.setting('least'))
        if recording is not None:
            self._begun, self._seen = now, self._window.last
            twin = self._twin
            self._worker.start(
                Job(
                    recording,
                    twin.robot,
                    tuple(twin.effects),
                    self._align,
                    images=self._window.images if self._names.cameras else (),
                    names=self._names,
                )
            )

    def _tell(self, result: Finding | str | None) -> None:
        if isinstance(result, str):
            self.refuse('window', result)
        elif result is not None and (self._speaking or result.status != 'none'):
            self._speaking = True
            if result.sentence != self._printed:
                self._printed = result.sentence
                self.get_logger().info(result.sentence)
            self.health.fault = result.sentence if result.status == 'unsound' else ''
            self._verdict.publish(
                self.messages.diagnostics(
                    result.stamp,
                    'weld_twin: diagnosis',
                    result.values,
                    LEVELS[result.status],
                    result.sentence,
                    self.health.hardware_id,
                )
            )


main = partial(run, LiveDiagnosis)


if __name__ == '__main__':
    raise SystemExit(main())
