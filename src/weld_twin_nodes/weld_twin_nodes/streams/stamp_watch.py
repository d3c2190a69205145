# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What the stamps of a stream tell of it: messages that are missing, a clock that jumped, a new run.

A middleware that drops a message says nothing of it. A publisher of somebody else tells no counts
either, but what has a beat has stamps on that beat, and a gap between two of them is told here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_msgs_py.assembly.stamp_order import RESTART_AFTER

from .clock_watch import NANOSECOND, PACE

KEPT = 200
"""Steps of the stamps over which their beat is judged: a second at 200 Hz."""
FEWEST = 20
"""Steps without which a stream has no beat that is known."""
ON_BEAT = 0.25
"""Part of a step by which another may differ and be on the beat: a driver that stamps what it
receives is off by an eighth of 8 ms."""
REGULAR = 0.9
"""Share of the steps that must be on the beat, for a gap to tell of anything."""
GAP = 1.5
"""Steps from which on a message is missing in between."""
SILENT = 1.0
"""Seconds without a message that are silence, which health tells of: nothing was sent."""
JUMPED = 1.0
"""Seconds by which stamps run ahead of the time that passed, in a stream in real time, where a
clock was set: messages take milliseconds."""
JUMPED_ANYHOW = 100.0
"""The same where stamps do not pass as time does: more than a queue of 5,000 loses at 50 Hz."""


class Seen(NamedTuple):
    """
    What a look at the stamps finds.

    Attributes
    ----------
    missing : int
        Messages, by the gaps of a stream on a beat.
    step : float [s]
        The beat, 0 where there is none.
    ahead : float [s]
        How far the stamps jumped forwards, 0 where they did not.
    back : float [s]
        How far behind the last ones the stamps begin anew, 0 where they do not.

    """

    missing: int = 0
    step: float = 0.0
    ahead: float = 0.0
    back: float = 0.0


class StampWatch:
    """Keeps the stamps of a stream and when they came, until somebody looks at them."""

    def __init__(self) -> None:
        self._stamps: list[int] = []
        self._arrivals: list[float] = []
        self._top: tuple[int, float] | None = None
        self._behind = 0
        self._steps = np.empty(0)

    def add(self, stamp: int, now: float) -> None:
        """Take a stamp [ns] that comes at a time [s]."""
        self._stamps.append(stamp)
        self._arrivals.append(now)

    def look(self) -> Seen:
        """Return what has come since the last look."""
        if not self._stamps:
            return Seen()
        stamps, arrivals = np.array(self._stamps), np.array(self._arrivals)
        self._stamps.clear()
        self._arrivals.clear()
        if self._top is not None:
            stamps = np.concatenate([[self._top[0]], stamps])
            arrivals = np.concatenate([[self._top[1]], arrivals])
        top = np.maximum.accumulate(stamps)
        back = self._back(stamps < top, stamps, top)
        if back:
            self._top = int(stamps[-1]), float(arrivals[-1])
            return Seen(back=back)
        ahead = np.concatenate([[True], np.diff(top) > 0])
        self._top = int(top[-1]), float(arrivals[ahead][-1])
        step = np.diff(stamps[ahead]) * NANOSECOND
        return self._gaps(step, np.diff(arrivals[ahead]))

    def _back(self, below: Array, stamps: Array, top: Array) -> float:
        """Return how far the stamps have gone back for good [s]; one late stamp is no new run."""
        trailing = int(np.argmin(below[::-1])) if not below.all() else below.size
        # The first of them is the highest one before, which is never below itself.
        self._behind = trailing if trailing < below.size - 1 else self._behind + trailing
        if self._behind < RESTART_AFTER:
            return 0.0
        self._behind = 0
        return float(top[-1] - stamps[-1]) * NANOSECOND

    def _gaps(self, step: Array, passed: Array) -> Seen:
        """Return what the steps between stamps [s] show, held against the time between them [s]."""
        recent = np.concatenate([self._steps, step])[-KEPT:]
        self._steps = recent
        beat = step if step.size >= FEWEST else recent
        if step.size == 0 or beat.size < FEWEST:
            return Seen()
        usual = float(np.median(beat))
        jumps = step - passed > self._most(step, passed, usual)
        ahead = float((step - passed)[jumps].max(initial=0.0))
        if np.mean(abs(recent - usual) <= ON_BEAT * usual) < REGULAR:
            return Seen(ahead=ahead)
        silence = passed > max(SILENT, 5.0 * usual)
        gaps = (step > GAP * usual) & ~jumps & ~silence
        return Seen(_missing(step, gaps, usual), usual, ahead)

    @staticmethod
    def _most(step: Array, passed: Array, usual: float) -> float:
        """Return by how much stamps may run ahead of time [s]."""
        small = step <= 4.0 * usual
        time = float(passed[small].sum())
        pace = float(step[small].sum()) / time if time > 0.0 else 0.0
        return JUMPED if PACE[0] < pace < PACE[1] else JUMPED_ANYHOW


def _missing(step: Array, gaps: Array, usual: float) -> int:
    """
    Return how many messages are missing in gaps.

    A gap is taken together with the steps beside it: a stamp that is late makes one step long and
    the next one short.
    """
    beside = gaps.copy()
    beside[1:] |= gaps[:-1]
    beside[:-1] |= gaps[1:]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], beside, [False]])))
    return sum(
        max(round(float(step[a:b].sum()) / usual) - int(b - a), 0) for a, b in edges.reshape(-1, 2)
    )
