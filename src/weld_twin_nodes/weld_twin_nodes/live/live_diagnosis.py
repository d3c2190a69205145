# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Live diagnosis: the verdict over the last minute of the cell, once there is evidence for one."""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import partial
from typing import Any, ClassVar

from weld_twin_core.diagnosis.algebra.problem import frames_named
from weld_twin_msgs_py.assembly import Intake, Role
from weld_twin_msgs_py.messages.topics import (
    DIAGNOSIS,
    IMAGE_POINTS,
    JOINT_STATES,
    MEASURED_SIGMA,
    TEMPERATURE,
    TOOL_WRENCH,
    TopicNames,
)

from ..offline.told_twin import build_twin, told_cameras
from .cell_frames import placed_twin
from .diagnosis_window import SIGNALS, Window
from .diagnosis_worker import Finding, Job, Worker
from .input_settings import JOINT_SETTINGS, MEASURED_SETTINGS
from .managed_node import ManagedNode
from .robot_settings import ROBOT_SETTINGS, robot_of
from .run_node import run
from .settings import Setting
from .tf_frames import MeasuredInputs

LOOK_EVERY = 0.2
"""Seconds between two looks at whether the worker has finished."""
LEVELS = {'none': 0, 'identified': 1, 'ambiguous': 1, 'unknown': 1, 'unsound': 2}
"""Of the diagnostic message: ok, a warning, or an error where data or set-up are wrong."""
INPUTS = {
    TOOL_WRENCH: Role.WRENCH,
    TEMPERATURE: Role.TEMPERATURE,
    MEASURED_SIGMA: Role.SIGMA,
    JOINT_STATES: Role.JOINTS,
}


class LiveDiagnosis(ManagedNode):
    """
    Diagnoses a sliding window again and again, in another process.

    Nothing is published before a gap was found; from then on every verdict is, so that its end
    is told too.
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
        self._twin = placed_twin(self, build_twin(robot_of(self), self.setting('model')))
        self._align = frames_named(self.setting('align'))
        self._names = self._looked_with()
        self._window = self._empty_window()
        self._worker = Worker(self.get_logger().warning)
        self._begun = -float('inf')
        self._seen: int | None = None
        self._speaking = False
        self._printed = ''
        self._verdict = self.offer(DIAGNOSIS)
        self._measured: MeasuredInputs | None = None
        self._looking: Any = None
        self.start()

    def _looked_with(self) -> TopicNames:
        """Return what is known of the cameras and of what they look at."""
        texts = (
            [part for part in self.setting(name).split(',') if part]
            for name in ('cameras', 'targets')
        )
        cameras, targets = told_cameras(*texts)
        return TopicNames(cameras=cameras, targets=targets)

    def prepare(self) -> None:
        """Nothing is left to look at: robot and model were read when the node started."""

    def begin(self) -> None:
        """Listen, and diagnose from time to time."""
        for topic, role in INPUTS.items():
            required, held = role is Role.JOINTS, role in SIGNALS
            self.listen(topic, partial(self._take, role), required=required, held=held)
        if self._names.cameras:
            self.listen(IMAGE_POINTS, self._window.take_image)
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
        """Return what takes its messages in."""
        return (self._window.intake,)

    def _take(self, role: Role, message: Any) -> None:
        self._window.take(role, message)

    def time_went_back(self) -> None:
        """Forget the window."""
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
"""Run the node with arguments, or with those of the program; return the exit code."""


if __name__ == '__main__':
    raise SystemExit(main())
