# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Measured positions beside the twin's at the same instant, by header stamp."""

from __future__ import annotations

from collections import deque
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_msgs_py.assembly.stamp_order import Forward

NANOSECOND = 1e-9
USUAL = 16
"""Twin poses from which the usual step between them is taken."""
FEW = 4
"""Steps up to which the longest is taken for usual."""
LONG = 4
"""Usual steps beyond which a step is a break: samples were lost, or the motion rested."""


class Pair(NamedTuple):
    """A measured position and the twin's at the same stamp, shape (3,) each [m]."""

    stamp: int
    measured: Array
    twin: Array


class Pairing:
    """
    Pairs two streams of positions whose stamps need not agree.

    The twin is interpolated by the parabola through the two poses around a measurement and the
    one before them, by a straight line where there is none before: at 100 Hz and 1 m/s^2 a
    straight line alone would be 12 um off. Nothing is interpolated across a break of the stream,
    a step of more than four times the usual. A measurement waits until the twin has passed it. One
    that can never be paired is counted in `dropped`.

    depth: how many samples of each stream are kept.
    max_gap: longest step between two twin poses that is still interpolated [s].
    """

    def __init__(self, depth: int = 2000, max_gap: float = 0.5) -> None:
        self._depth = depth
        self._max_gap = round(max_gap / NANOSECOND)
        self._twin: deque[tuple[int, Array]] = deque(maxlen=depth)
        self._measured: deque[tuple[int, Array]] = deque()
        self._twin_order = Forward()
        self._measured_order = Forward()
        self.dropped = 0
        self.restarts = 0

    def reset(self) -> None:
        """Begin anew, as after a jump of the clock."""
        self._twin.clear()
        self._measured.clear()
        self._twin_order.reset()
        self._measured_order.reset()
        self.dropped = 0

    @property
    def waiting(self) -> int:
        """Return how many measurements the twin has not passed yet."""
        return len(self._measured)

    def add_twin(self, stamp: int, position: Array) -> list[Pair]:
        """
        Take a twin pose; return the pairs it completes.

        Raises DataError: the stamp is not after the last one.
        """
        if self._twin_order.restarted_at(stamp):
            self._twin.clear()
            self.restarts += 1
        self._twin.append((stamp, position))
        return self._complete()

    def add_measured(self, stamp: int, position: Array) -> list[Pair]:
        """
        Take a measurement; return the pairs it completes.

        Raises DataError: the stamp is not after the last one.
        """
        if self._measured_order.restarted_at(stamp):
            self.dropped += len(self._measured)
            self._measured.clear()
        self._measured.append((stamp, position))
        if len(self._measured) > self._depth:
            self._measured.popleft()
            self.dropped += 1
        return self._complete()

    def _complete(self) -> list[Pair]:
        out: list[Pair] = []
        while self._twin and self._measured and self._measured[0][0] <= self._twin[-1][0]:
            stamp, measured = self._measured.popleft()
            twin = self._interpolated(stamp)
            if twin is None:
                self.dropped += 1
            else:
                out.append(Pair(stamp, measured, twin))
        return out

    def _interpolated(self, stamp: int) -> Array | None:
        """Return the twin's position at a stamp not after its last one, None where unknown."""
        high = len(self._twin) - 1
        while high > 0 and self._twin[high - 1][0] >= stamp:
            high -= 1
        if self._twin[high][0] == stamp:
            return self._twin[high][1]
        if high == 0 or self._twin[high][0] - self._twin[high - 1][0] > self._longest(high):
            return None
        support = [self._twin[k] for k in range(max(high - 2, 0), high + 1)]
        if len(support) == 3 and support[1][0] - support[0][0] > self._longest(high - 1):
            support = support[1:]
        return _through(support, stamp)

    def _longest(self, high: int) -> int:
        """
        Return the longest step up to a pose that is interpolated, by the steps before it.

        The usual step is the longest but two, so that poses may come in bursts and two breaks
        among those steps do not make a third one usual.
        """
        stamps = [self._twin[k][0] for k in range(max(high - USUAL, 0), high)]
        steps = sorted(after - before for before, after in pairwise(stamps))
        if not steps:
            return self._max_gap
        return min(self._max_gap, LONG * steps[-3 if len(steps) > FEW else -1])


def _through(support: list[tuple[int, Array]], stamp: int) -> Array:
    """Return the polynomial through two or three points at a stamp (Lagrange's form)."""
    t = np.array([s - stamp for s, _ in support], dtype=np.float64) * NANOSECOND
    total = np.zeros(3)
    for k, (_, position) in enumerate(support):
        others = np.delete(t, k)
        total += position * float(np.prod(others / (others - t[k])))
    return total
