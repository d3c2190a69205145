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
from numpy.typing import NDArray

from weld_twin_core.arrays import Array
from weld_twin_msgs_py.assembly.stamp_order import RESTART_AFTER

from .clock_watch import NANOSECOND

Flags = NDArray[np.bool_]
KEPT = 200
"""Steps of the stamps that are kept to judge their beat by: a second at 200 Hz."""
FEWEST = 20
"""Steps without which a stream has no beat that is known."""
ON_BEAT = 0.25
"""Part of a step by which another may differ and be on the beat: a driver that stamps what it
receives is off by an eighth of 8 ms."""
REGULAR = 0.8
"""Share of the steps that must be on the beat, or a whole number of them, for a gap to tell of
anything: steps that come as they like are so by half."""
GAP = 1.5
"""Steps from which on a message is missing in between."""
SILENT = 1.0
"""Seconds without a message that are silence, which health tells of: nothing was sent."""
JUMPED = 1.0
"""Seconds by which stamps run ahead of the time that passed, in a stream in real time, where a
clock was set: messages take milliseconds."""
JUMPED_ANYHOW = 100.0
"""The same where messages come faster than their stamps pass, as from a queue that overran or from
a recording: more than a queue of 5,000 loses at 50 Hz."""
RUSH = 0.5
"""Time that steps beside a gap take, against that between their stamps, below which they rush."""


class Seen(NamedTuple):
    """What a look at the stamps finds."""

    missing: int = 0
    """Messages, by the gaps of a stream on a beat."""
    step: float = 0.0
    """The beat, 0 where there is none [s]."""
    ahead: float = 0.0
    """How far the stamps jumped forwards, 0 where they did not [s]."""
    back: float = 0.0
    """How far behind the last ones the stamps begin anew, 0 where they do not [s]."""


class StampWatch:
    """Keeps the stamps of a stream and when they came, until somebody looks at them."""

    def __init__(self) -> None:
        self._stamps: list[int] = []
        self._arrivals: list[float] = []
        self._kept = np.empty(0, dtype=np.int64), np.empty(0)
        self._judged = 0
        self._behind = 0

    def add(self, stamp: int, now: float) -> None:
        """Take a stamp [ns] that comes at a time [s]."""
        self._stamps.append(stamp)
        self._arrivals.append(now)

    def look(self) -> Seen:
        """
        Return what was seen since the last look.

        The newest steps are judged by what comes after them, unless nothing does.
        """
        new = len(self._stamps)
        stamps = np.concatenate([self._kept[0], np.array(self._stamps, dtype=np.int64)])
        arrivals = np.concatenate([self._kept[1], np.array(self._arrivals)])
        self._stamps.clear()
        self._arrivals.clear()
        if stamps.size < 2:
            self._kept = stamps, arrivals
            return Seen()
        top = np.maximum.accumulate(stamps)
        back = self._back(stamps < top, new, int((top - stamps).max()))
        if back:
            self._kept, self._judged = (stamps[-1:], arrivals[-1:]), 0
            return Seen(back=back)
        ahead = np.concatenate([[True], np.diff(top) > 0])
        stamps, arrivals = stamps[ahead], arrivals[ahead]
        steps = stamps.size - 1
        until = max(self._judged, steps - FEWEST) if new else steps
        step, passed = np.diff(stamps) * NANOSECOND, np.diff(arrivals)
        seen = _seen(step, passed, self._judged, until)
        cut = max(steps - KEPT, 0)
        self._kept, self._judged = (stamps[cut:], arrivals[cut:]), max(until - cut, 0)
        return seen

    def _back(self, below: Flags, new: int, by: int) -> float:
        """Return how far the stamps have gone back for good [s]; one late stamp is no new run."""
        fresh = below[below.size - new :]
        trailing = new if fresh.all() else int(np.argmin(fresh[::-1]))
        self._behind = self._behind + new if trailing == new else trailing
        if self._behind < RESTART_AFTER:
            return 0.0
        self._behind = 0
        return float(by) * NANOSECOND


def _seen(step: Array, passed: Array, begin: int, end: int) -> Seen:
    """
    Return what steps of stamps show.

    step, passed: between stamps, and between their arrivals, shape (N,) [s].
    begin, end: of the steps that are judged; the others are there to judge them by.
    """
    if begin >= end:
        return Seen()
    beat = step.size >= FEWEST
    usual = float(np.median(step)) if beat else np.inf
    excess = step - passed
    # What was held up comes late, and is on time again later: no message comes before its stamp.
    early = np.concatenate([[0.0], np.cumsum(excess)])
    over = early[1:] - np.maximum.accumulate(early)[:-1]
    jumps: Flags = over > JUMPED_ANYHOW
    for k in np.flatnonzero(over > JUMPED).tolist() if beat else ():
        jumps[k] |= not _rushed(step, passed, k)
    judged = (np.arange(step.size) >= begin) & (np.arange(step.size) < end)
    ahead = float(over[jumps & judged].max(initial=0.0))
    whole = np.maximum(np.round(step / usual), 1.0)
    on_beat = abs(step / usual - whole) <= ON_BEAT
    if not beat or np.mean(on_beat) < REGULAR:
        return Seen(ahead=ahead)
    few = on_beat & (
        whole <= FEWEST
    )  # the middle of steps that vary is high where some are double
    usual = float(step[few].sum() / whole[few].sum())
    # A sender that is silent lets its stamps go on with the time; one that lacks a message does not.
    silence = (passed > max(SILENT, 5.0 * usual)) & (abs(excess) <= SILENT)
    gaps = (step > GAP * usual) & ~jumps & ~silence
    return Seen(_missing(step, gaps, usual, begin, end), usual, ahead)


def _rushed(step: Array, passed: Array, k: int) -> bool:
    """Return whether the messages before or after a step came faster than their stamps pass."""
    for span in (
        FEWEST,
        KEPT,
    ):  # a process that is held up for a moment spoils few steps, not many
        for side in (slice(max(k - span, 0), k), slice(k + 1, k + 1 + span)):
            time, stamps = float(passed[side].sum()), float(step[side].sum())
            if step[side].size >= FEWEST // 2 and time < RUSH * stamps:
                return True
    return False


def _missing(step: Array, gaps: Flags, usual: float, begin: int, end: int) -> int:
    """
    Return how many messages are missing in gaps.

    A gap is taken together with the steps beside it: a stamp that is late makes one step long and
    the next one short. Gaps side by side count when the last of them is judged.
    """
    beside = gaps.copy()
    beside[1:] |= gaps[:-1]
    beside[:-1] |= gaps[1:]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], beside, [False]])))
    total = 0
    for a, b in edges.reshape(-1, 2):
        last = a + int(np.flatnonzero(gaps[a:b])[-1])
        if begin <= last < end:
            total += max(round(float(step[a:b].sum()) / usual) - int(b - a), 0)
    return total
