# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The marker node: the seam coloured by deviation, and the deviations magnified."""

from collections import OrderedDict, deque
from functools import partial
from typing import Any, ClassVar

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_msgs_py.assembly import Role
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.to_messages import Lines
from weld_twin_msgs_py.messages.topics import DEVIATION, MARKERS, TWIN_BASE

from .cell_node import CellNode
from .robot_settings import (
    JOINT_SETTINGS,
    MEASURED_SETTINGS,
    ROBOT_SETTINGS,
    MeasuredInputs,
    measuring_frame,
    robot_of,
)
from .run_node import run
from .settings import Setting

WAITING = 2000
"""Measured positions that wait for their deviation."""
SEAM, STROKES = 'seam', 'deviation'
WIDE, NARROW = 0.004, 0.001
"""Widths of the lines [m]."""


class DeviationLines:
    """
    Keeps the way of the twin with the deviations on it, drawn larger than true.

    tolerance: deviation drawn in full red [m]; none is green.
    spacing: shortest way between two points kept [m]; of too many points the oldest go.
    """

    def __init__(
        self, magnification: float, tolerance: float, spacing: float, points: int
    ) -> None:
        self._magnification = magnification
        self._tolerance = tolerance
        self._spacing = spacing
        self._waiting: OrderedDict[int, Array] = OrderedDict()
        self._kept: deque[tuple[Array, Array]] = deque(maxlen=points)
        self.count = self.stamp = 0

    def measured(self, stamp: int, position: Array) -> None:
        """Take a measured position (3,) [m]."""
        self._waiting[stamp] = position
        if len(self._waiting) > WAITING:
            self._waiting.popitem(last=False)

    def deviation(self, stamp: int, vector: Array) -> None:
        """Take measured minus twin (3,) [m], in the frame of the measured positions."""
        position = self._waiting.pop(stamp, None)
        if position is None:
            return
        twin = position - vector
        if self._kept and np.linalg.norm(twin - self._kept[-1][0]) < self._spacing:
            return
        self._kept.append((twin, vector))
        self.count, self.stamp = self.count + 1, stamp

    def drawn(self) -> list[Lines]:
        """Return the seam where the twin says it is, and strokes towards the measured side."""
        twin, vector = (np.stack(column) for column in zip(*self._kept, strict=True))
        color = colors(np.linalg.norm(vector, axis=1) / self._tolerance)
        ends = twin + self._magnification * vector
        strokes = np.stack([twin, ends], axis=1).reshape(-1, 3)
        return [
            Lines(SEAM, twin, color, WIDE, True),
            Lines(STROKES, strokes, np.repeat(color, 2, axis=0), NARROW, False),
        ]


def colors(part: Array) -> Array:
    """Return green over yellow to red, shape (N, 3), for parts of the tolerance, shape (N,)."""
    part = np.clip(part, 0.0, 1.0)
    return np.stack(
        [np.minimum(2.0 * part, 1.0), np.minimum(2.0 - 2.0 * part, 1.0), 0.0 * part], axis=1
    )


class DeviationMarkers(CellNode):
    """Publishes pictures of the deviation for RViz and Foxglove, a few times a second."""

    settings: ClassVar[tuple[Setting, ...]] = (
        *ROBOT_SETTINGS,
        *JOINT_SETTINGS,
        *MEASURED_SETTINGS,
        Setting('magnification', 200.0, 'length of a deviation in the picture [1]', 1.0, 1e6),
        Setting('tolerance', 0.001, 'deviation that is drawn red [m]', 1e-9, 1.0),
        Setting('spacing', 0.001, 'shortest way between two points drawn [m]', 0.0, 1.0),
        Setting('points', 1000, 'points kept of the seam [1]', 2, 100_000),
        Setting('every', 0.5, 'time between two pictures [s]', 0.05, 60.0),
    )

    def __init__(self, **kwargs: Any) -> None:
        super().__init__('deviation_markers', **kwargs)
        self._rotation = robot_of(self).T_world_origin[:3, :3]
        self._frame = measuring_frame(self)
        self._markers = self.offer(MARKERS)
        self.time_went_back()
        self.listen(TWIN_BASE, self._on_base)
        self._measured_inputs = MeasuredInputs(self, self._on_measured)
        self.listen(DEVIATION, self._on_deviation, required=True)
        self.every(self.setting('every'), self._draw)

    def time_went_back(self) -> None:
        """Begin the picture anew."""
        names = ('magnification', 'tolerance', 'spacing', 'points')
        self._lines = DeviationLines(*map(self.setting, names))
        self._drawn = 0

    def _on_base(self, message: Any) -> None:
        self._rotation = from_messages.pose(message)[1]

    def _on_measured(self, _: Role, message: Any) -> None:
        self._lines.measured(from_messages.stamp_ns(message), from_messages.position(message))

    def _on_deviation(self, message: Any) -> None:
        vector = self._rotation @ from_messages.vector3(message)
        self._lines.deviation(from_messages.stamp_ns(message), vector)

    def _draw(self) -> None:
        if self._lines.count == self._drawn:
            return
        self._drawn = self._lines.count
        self._markers.publish(
            self.messages.markers(self._lines.stamp, self._lines.drawn(), self._frame)
        )


main = partial(run, DeviationMarkers)


if __name__ == '__main__':
    raise SystemExit(main())
