# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Deviation analyzer: measured minus twin, paired by header stamp, and its metrics."""

import time
from collections.abc import Iterable
from functools import partial
from typing import Any, ClassVar

from weld_twin_msgs_py.assembly import Role
from weld_twin_msgs_py.assembly.frames import MeasuringFrame
from weld_twin_msgs_py.messages import from_messages, topics
from weld_twin_msgs_py.messages.cdr import Vector3Encoder

from ..streams.deviation_stream import METRICS, Deviation, Deviations
from .cell_node import CellNode
from .robot_settings import (
    JOINT_SETTINGS,
    MEASURED_SETTINGS,
    ROBOT_SETTINGS,
    MeasuredInputs,
    base_frame,
    robot_of,
)
from .run_node import run
from .settings import Setting

LOOK_EVERY = 0.5
"""Seconds between two looks at the clocks."""
BASE_EVERY = 0.1
"""Seconds between two looks at whether the base is published, until it is known."""
BASE_NOBODY = 0.5
"""Seconds that pairs wait while nobody is there to tell the base: discovery takes a tenth of it."""
BASE_SOMEBODY = 10.0
"""Seconds that pairs wait for one who is there: what was lost comes again within 3 s (Fast DDS)."""


class DeviationAnalyzer(CellNode):
    """Publishes the deviation of every measurement it can pair, and counts the others."""

    settings: ClassVar[tuple[Setting, ...]] = (
        *ROBOT_SETTINGS,
        *JOINT_SETTINGS,
        *MEASURED_SETTINGS,
        Setting(
            'path_length', 0.0, 'length of the seam [m]; 0: the way the twin has gone', 0.0, 1e4
        ),
        Setting('buffer', 2000, 'samples of each stream kept for pairing [1]', 10, 1_000_000),
        Setting(
            'max_gap',
            0.5,
            'longest step of the twin that is interpolated, if its usual step allows [s]',
            0.0,
            60.0,
        ),
        Setting(
            'implausible',
            0.02,
            'deviation above which frames, clocks or tool must be wrong [m]',
            1e-6,
            100.0,
        ),
        Setting('metrics_every', 50, 'deviations between two metrics messages [1]', 1, 100_000),
        Setting('metrics_idle', 1.0, 'wait for more before the last metrics [s]', 0.05, 60.0),
    )

    def __init__(self, **kwargs: Any) -> None:
        super().__init__('deviation_analyzer', **kwargs)
        self._deviations = Deviations(
            robot_of(self),
            self.setting('path_length'),
            self.setting('buffer'),
            self.setting('max_gap'),
            awaits_base=True,
        )
        self._waiting_since: float | None = None
        self._base_timer = self.every(BASE_EVERY, self._look_for_base)
        self._vector = self.offer(topics.DEVIATION)
        self._encode = Vector3Encoder(base_frame(self))
        self._frame = MeasuringFrame(self.setting('measuring_frame'))
        self._metrics = self.offer(topics.DEVIATION_METRICS, awaited=False)
        self._stamp = 0
        self._seen = self._published = 0
        self._every = self.setting('metrics_every')
        self.every(self.setting('metrics_idle'), self._on_idle)
        self.every(LOOK_EVERY, self._look_at_clocks)
        self.listen(topics.TWIN_BASE, self._on_base)
        self._measured_inputs = MeasuredInputs(self, self._on_measured)
        self.listen(topics.TWIN_POSE, self._on_twin, required=True)

    def time_went_back(self) -> None:
        """Forget what was not paired, and begin the metrics anew."""
        self._measured_inputs.clear()
        self._deviations.reset()
        self._seen = self._published = 0

    def _on_measured(self, _: Role, message: Any) -> None:
        position = from_messages.position(message)
        self._frame.take(message.header.frame_id)
        self.remark(self._frame.remark)
        self._publish(self._deviations.add_measured(from_messages.stamp_ns(message), position))

    def _on_base(self, message: Any) -> None:
        """Give deviations in the axes that the base has by the model of the twin."""
        self._base_timer.cancel()
        self._publish(self._deviations.take_base(from_messages.pose(message)[1]))

    @property
    def waiting_for_base(self) -> int:
        """Return how many pairs wait for the axes of the base."""
        return self._deviations.waiting_for_base

    def _look_for_base(self) -> None:
        """Take the robot's own base for pairs that have waited long enough for another."""
        if not self._deviations.waiting_for_base:
            return
        now = time.monotonic()
        if self._waiting_since is None:
            self._waiting_since = now
        topic = self.resolve_topic_name(topics.TWIN_BASE.relative)
        patience = BASE_SOMEBODY if self.count_publishers(topic) else BASE_NOBODY
        if now - self._waiting_since < patience:
            return
        self._base_timer.cancel()
        self.remark(f'{topic}: nothing heard; the base is taken to be where the robot has it')
        self._publish(self._deviations.take_base())

    def _on_twin(self, message: Any) -> None:
        position, _ = from_messages.pose(message)
        self._publish(self._deviations.add_twin(from_messages.stamp_ns(message), position))

    def _publish(self, deviations: Iterable[Deviation]) -> None:
        for stamp, vector in deviations:
            self._vector.publish(self._encode(stamp, vector))
            self._stamp = stamp
            if self._deviations.samples % self._every == 0:
                self._publish_metrics()

    def _on_idle(self) -> None:
        """Tell the last metrics of a run once nothing more comes."""
        samples = self._deviations.samples
        if samples == self._seen != self._published:
            self._publish_metrics()
        self._seen = samples

    def _look_at_clocks(self) -> None:
        """Warn, as long as it is so, of clocks that disagree and of deviations no arm has."""
        self.keep('clocks', self._deviations.clocks())
        recent, most = self._deviations.recent, self.setting('implausible')
        self.keep(
            'implausible',
            f'the deviation is {recent * 1e3:.3g} mm, more than any arm is off by '
            f'({most * 1e3:.3g} mm): compare frames, clocks, base and tool'
            if recent > most
            else '',
        )

    def _publish_metrics(self) -> None:
        self._published = self._deviations.samples
        self._metrics.publish(
            self.messages.diagnostics(
                self._stamp,
                METRICS,
                self._deviations.metrics(),
                hardware_id=self.health.hardware_id,
            )
        )


main = partial(run, DeviationAnalyzer)


if __name__ == '__main__':
    raise SystemExit(main())
