# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Measured minus twin: what the analyzer computes, live or over a finished run."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Iterator
from typing import NamedTuple

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.metrics.deviation import RunningMetrics

from .clock_watch import ClockWatch
from .pairing import Pair, Pairing

METRICS = 'deviation'
"""Name of the status that carries the metrics."""
RECENT = 50
"""Deviations whose median is held against what is plausible: single outliers are none of it."""


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
    base_told: whether the base is yet to be told. Until it is, pairs are held back, at most
    ``depth``: in other axes they would be other deviations.
    """

    def __init__(
        self,
        robot: Robot,
        path_length: float = 0.0,
        depth: int = 2000,
        max_gap: float = 0.5,
        *,
        base_told: bool = False,
    ) -> None:
        self._rotation_base_world = robot.T_world_origin[:3, :3].T
        self._pairing = Pairing(depth, max_gap)
        self._path_length = path_length
        self._metrics = RunningMetrics(path_length)
        self._clocks = ClockWatch()
        self._recent: deque[float] = deque(maxlen=RECENT)
        self._waits = base_told
        self._held: deque[Pair] = deque(maxlen=depth)

    @property
    def held(self) -> int:
        """Return how many pairs wait for the base."""
        return len(self._held)

    def take_base(self, rotation: Array | None = None) -> Iterator[Deviation]:
        """
        Take the axes of the base in the measuring frame; yield the deviations that waited for them.

        rotation: none for those of the robot: nobody tells them, shape (3, 3).
        """
        if rotation is not None:
            self._rotation_base_world = rotation.T
        held, self._held, self._waits = [*self._held], deque(maxlen=self._held.maxlen), False
        return self._each(held)

    def reset(self) -> None:
        """Begin anew, as after a jump of the clock."""
        self._pairing.reset()
        self._clocks.reset()
        self._recent.clear()
        self._held.clear()
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
        """Return what is to be told of the two clocks, empty where nothing is."""
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
            self._held.extend(pairs)
            return
        for stamp, measured, twin in pairs:
            vector = self._rotation_base_world @ (measured - twin)
            self._metrics.add(vector, twin)
            self._recent.append(math.sqrt(float(vector @ vector)))
            yield Deviation(stamp, vector)
