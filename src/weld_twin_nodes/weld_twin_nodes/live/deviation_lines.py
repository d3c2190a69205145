# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Deviations as lines to look at: the seam by colour, and a stroke for each of its points."""

from __future__ import annotations

from collections import OrderedDict, deque

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_msgs_py.messages.to_messages import Lines

WAITING = 2000
"""Measured positions that wait for their deviation."""
SEAM, STROKES = 'seam', 'deviation'
WIDE, NARROW = 0.004, 0.001
"""Widths of the lines [m]."""


class DeviationLines:
    """
    Keeps the way of the twin with the deviations on it.

    magnification: how much longer than true a deviation is drawn.
    tolerance: deviation drawn in full red [m]; none is green.
    spacing: shortest way between two points kept [m].
    points: how many are kept; the oldest go.
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
