# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Measured minus twin, paired by header stamp: what the analyzer computes, live or afterwards."""

import math
import time
from collections import deque
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.metrics.deviation import RunningMetrics
from weld_twin_msgs_py.assembly.intake import Forward

from .stamp_watch import ClockWatch

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
        """Take a twin pose; return the pairs it completes."""
        if self._twin_order.restarted_at(stamp):
            self._twin.clear()
            self.restarts += 1
        self._twin.append((stamp, position))
        return self._complete()

    def add_measured(self, stamp: int, position: Array) -> list[Pair]:
        """Take a measurement; return the pairs it completes."""
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
        """Return the longest step up to a pose that is interpolated: 4 times the longest but two."""
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


METRICS = 'deviation'
"""Name of the status that carries the metrics."""
RECENT = 50
"""Deviations whose median is compared with what is plausible: single outliers are none of it."""


class Deviation(NamedTuple):
    """Measured minus twin in the base frame, shape (3,) [m], at a measurement's stamp [ns]."""

    stamp: int
    vector: Array


class Deviations:
    """
    Pairs measurements with twin poses and keeps the metrics of the pairs.

    robot: its base frame is the one deviations are given in.
    path_length: length of the seam [m]; 0 takes the way the twin has gone.
    depth, max_gap: see `Pairing`.
    awaits_base: whether the base is yet to come. Until it does, pairs are kept back, at most
    ``depth``: in other axes they would be other deviations.
    """

    def __init__(
        self,
        robot: Robot,
        path_length: float = 0.0,
        depth: int = 2000,
        max_gap: float = 0.5,
        *,
        awaits_base: bool = False,
    ) -> None:
        self._rotation_base_world = robot.T_world_origin[:3, :3].T
        self._pairing = Pairing(depth, max_gap)
        self._path_length = path_length
        self._metrics = RunningMetrics(path_length)
        self._clocks = ClockWatch()
        self._recent: deque[float] = deque(maxlen=RECENT)
        self._waits = awaits_base
        self._pending: deque[Pair] = deque(maxlen=depth)

    @property
    def waiting_for_base(self) -> int:
        """Return how many pairs wait for the base."""
        return len(self._pending)

    def take_base(self, rotation: Array | None = None) -> Iterator[Deviation]:
        """Take the base's axes in the measuring frame, if told; yield the deviations that waited."""
        if rotation is not None:
            self._rotation_base_world = rotation.T
        pairs, self._waits = [*self._pending], False
        self._pending.clear()
        return self._each(pairs)

    def reset(self) -> None:
        """Begin anew, as after a jump of the clock."""
        self._pairing.reset()
        self._clocks.reset()
        self._recent.clear()
        self._pending.clear()
        self._metrics = RunningMetrics(self._path_length)

    @property
    def samples(self) -> int:
        """Return how many measurements were paired so far."""
        return self._metrics.samples

    def add_measured(self, stamp: int, position: Array) -> Iterator[Deviation]:
        """Take a measured position (3,) [m]; yield the deviations that are known now."""
        self._clocks.measured.add(stamp, position, time.monotonic())
        return self._each(self._pairing.add_measured(stamp, position))

    def add_twin(self, stamp: int, position: Array) -> Iterator[Deviation]:
        """Take a twin position (3,) [m]; yield the deviations that are known now."""
        self._clocks.twin.add(stamp, position, time.monotonic())
        restarts = self._pairing.restarts
        pairs = self._pairing.add_twin(stamp, position)
        if self._pairing.restarts > restarts:
            self._metrics = RunningMetrics(self._path_length)
        return self._each(pairs)

    def clocks(self) -> str:
        """Return what to report about the two clocks, empty where nothing is."""
        return self._clocks.look(
            time.monotonic(), self._metrics.samples, self._pairing.waiting, self._pairing.dropped
        )

    @property
    def recent(self) -> float:
        """Return the median length of the last deviations [m]; 0 before there are any."""
        return sorted(self._recent)[len(self._recent) // 2] if self._recent else 0.0

    def metrics(self) -> dict[str, float | int]:
        """Return the metrics so far by their names on `/deviation/metrics`."""
        return {
            **self._metrics.as_dict(),
            'dropped': self._pairing.dropped,
            'waiting': self._pairing.waiting,
        }

    def _each(self, pairs: list[Pair]) -> Iterator[Deviation]:
        """Work one pair at a time, so that the metrics are those up to the deviation yielded."""
        if self._waits:
            self._pending.extend(pairs)
            return
        for stamp, measured, twin in pairs:
            vector = self._rotation_base_world @ (measured - twin)
            self._metrics.add(vector, twin)
            self._recent.append(math.sqrt(float(vector @ vector)))
            yield Deviation(stamp, vector)
