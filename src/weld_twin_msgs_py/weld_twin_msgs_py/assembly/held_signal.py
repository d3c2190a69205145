# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A side signal while it comes: the sample in force at a stamp."""

from __future__ import annotations

from collections import deque

from weld_twin_core.arrays import Array

MOST = 10_000
"""Samples kept that are ahead of the joint states: 100 s of a sensor at 100 Hz."""


class HeldSignal:
    """
    Gives the last sample not after a stamp, as `Signal.at` does over a recording.

    Stamps that are asked for must not go back, but after `hold`.
    """

    def __init__(self) -> None:
        self._samples: deque[tuple[int, Array]] = deque(maxlen=MOST)

    def add(self, stamp: int, value: Array, *, restarted: bool = False) -> None:
        """Take a sample [ns]; stamps increase, unless time has started anew."""
        if restarted:
            self._samples.clear()
        self._samples.append((stamp, value))

    def hold(self) -> None:
        """Keep the last value as one from before all time: the clock begins anew."""
        if self._samples:
            value = self._samples[-1][1]
            self._samples.clear()
            self._samples.append((0, value))

    def at(self, stamp: int) -> Array | None:
        """Return the value in force at a stamp [ns]; None before the first."""
        while len(self._samples) > 1 and self._samples[1][0] <= stamp:
            self._samples.popleft()
        if not self._samples or self._samples[0][0] > stamp:
            return None
        return self._samples[0][1]
