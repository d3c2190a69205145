# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How far the clock of the measurements is from that of the joints, while they come.

Offsets of a second and more show in the stamps that arrive together. Smaller ones hide behind the
time a message takes on its way; they show in the motion: the measured way is that of the twin,
shifted in time.
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np

from weld_twin_core.arrays import Array

NANOSECOND = 1e-9
ALIVE = 1.5
"""Seconds within which a stream must have brought something to be compared."""
UNPAIRED = 2.0
"""Seconds without a pair after which it is told that nothing pairs."""
APART = 0.5
"""Difference [s] of stamps that arrive together that no way of a message explains."""
PACE = (0.7, 1.4)
"""Speed of the stamps against real time between which arrivals tell of clocks."""
SPAN = 8.0
"""Seconds of motion that are compared."""
RECENT = 4.0
"""Seconds that are compared where all of them show no one shift: a clock that was set just now."""
REACH = 1.0
"""Largest shift [s] that is looked for in the motion."""
STEP = 0.02
"""Step [s] of the first look for a shift; the motion of an arm is a curve over many of them."""
LEAST = 1.0
"""Seconds of measurements without which a shift is not looked for."""
TWIN_EVERY, MEASURED_EVERY = 0.004, 0.02
"""Seconds between two samples that are kept for the comparison."""
BLURRED = 3e-4
"""Deviation [m] below which no shift is looked for: it is the size of the gaps of good arms."""
EXPLAINED = 0.25
"""Share of the squared deviation that a shift may leave, to be told."""
SHIFTED = 0.012
"""Smallest shift [s] that is told: servo loops trail by less."""
STEADY = 0.01
"""Seconds within which two looks in a row must agree."""
DRIFT_SPAN = 20.0
"""Seconds over which a drift is judged."""
DRIFTED = 0.004
"""Smallest change [s] that is told as a drift."""


class Sample(NamedTuple):
    """A position (3,) [m] at a stamp [ns]."""

    stamp: int
    position: Array


class Stream:
    """The recent samples of one stream, and when they came."""

    def __init__(self, every: float) -> None:
        self._every = round(every / NANOSECOND)
        self.samples: deque[Sample] = deque()
        self._arrivals: deque[tuple[float, int]] = deque()

    def add(self, stamp: int, position: Array, now: float) -> None:
        """Take a sample [ns] that comes at a time [s]."""
        self._arrivals.append((now, stamp))
        while now - self._arrivals[0][0] > ALIVE:
            self._arrivals.popleft()
        if self.samples and stamp < self.samples[-1].stamp:
            self.samples.clear()
        if self.samples and stamp - self.samples[-1].stamp < self._every:
            return
        self.samples.append(Sample(stamp, position))
        while stamp - self.samples[0].stamp > SPAN / NANOSECOND:
            self.samples.popleft()

    def alive(self, now: float) -> bool:
        """Return whether something came just now."""
        return bool(self._arrivals) and now - self._arrivals[-1][0] < ALIVE

    @property
    def ahead(self) -> float:
        """Return the stamps less their arrival, of the sample that was quickest here [s]."""
        return max(stamp * NANOSECOND - now for now, stamp in self._arrivals)

    @property
    def newest(self) -> int:
        """Return the stamp of the last sample [ns]."""
        return self._arrivals[-1][1]

    @property
    def in_real_time(self) -> bool:
        """Return whether the stamps pass as fast as time does."""
        (first, begin), (last, end) = self._arrivals[0], self._arrivals[-1]
        if last - first < 0.5 * ALIVE:
            return False
        return PACE[0] < (end - begin) * NANOSECOND / (last - first) < PACE[1]


class ClockWatch:
    """Compares stamps and motion; a look costs 1 ms while they agree, else some 10 ms."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Begin anew, as after a jump of the clock."""
        self.measured = Stream(MEASURED_EVERY)
        self.twin = Stream(TWIN_EVERY)
        self._paired, self._paired_at = 0, -np.inf
        self._begun: float | None = None
        self._before: float | None = None
        self._set_at = -np.inf
        self._history: deque[tuple[float, float]] = deque(maxlen=300)

    def look(self, now: float, paired: int, waiting: int, dropped: int) -> str:
        """
        Return what is to be told of the clocks, empty where nothing is.

        now: [s]
        paired, waiting, dropped: measurements so far that met the twin, that wait for it, and that
        never will.
        """
        if not (self.measured.alive(now) and self.twin.alive(now)):
            self._begun = None
            return ''
        if self._begun is None:
            self._begun = now
        if paired != self._paired:
            self._paired, self._paired_at = paired, now
        offset = self._by_stamps()
        if now - max(self._paired_at, self._begun) > UNPAIRED:
            said = (
                f'no measurement meets a pose of the twin: {waiting} wait, {dropped} are dropped'
            )
            return f'{said}; {told(offset, 1)}' if abs(offset) > APART else said
        if abs(offset) > APART and self.measured.in_real_time and self.twin.in_real_time:
            return told(offset, 2)
        return self._by_motion(now)

    def _by_stamps(self) -> float:
        """Return how far measured stamps are ahead of the twin's that arrive with them [s]."""
        if self.measured.in_real_time and self.twin.in_real_time:
            return self.measured.ahead - self.twin.ahead
        return (self.measured.newest - self.twin.newest) * NANOSECOND

    def _by_motion(self, now: float) -> str:
        result = shift(self.measured.samples, self.twin.samples)
        if result is None:
            result = shift(_recent(self.measured.samples), _recent(self.twin.samples))
        before, self._before = self._before, result
        if result is None:
            return ''
        if before is None or abs(result - before) > STEADY:
            self._set_at = now
            self._history.clear()
        if now - self._set_at > SPAN:  # what is compared is all of after the clock was set
            self._history.append((now, result))
        drift = self._drift()
        if drift:
            return drift
        if before is None or abs(result - before) > STEADY or abs(result) < SHIFTED:
            return ''
        trailing = ', or every joint trails by as much' if result > 0.0 else ''
        return told(result, 3) + trailing

    def _drift(self) -> str:
        """Return what is to be told of a shift that grows with time."""
        if not self._history or self._history[-1][0] - self._history[0][0] < DRIFT_SPAN:
            return ''
        t, offset = np.array(self._history).T
        rate, start = np.polyfit(t - t[0], offset, 1)
        change = rate * (t[-1] - t[0])
        scatter = float(np.std(offset - start - rate * (t - t[0])))
        if abs(change) < max(DRIFTED, 4.0 * scatter):
            return ''
        return (
            f'the clock of the measurements drifts by {rate * 1e6:+.0f} ppm against the joints, '
            f'{change * 1e3:+.1f} ms in {t[-1] - t[0]:.0f} s'
        )


def told(offset: float, digits: int) -> str:
    """Return an offset [s] in words."""
    where = 'ahead of' if offset > 0.0 else 'behind'
    return f'measurements are {abs(offset):.{digits}f} s {where} the joints'


def _recent(samples: deque[Sample]) -> deque[Sample]:
    """Return the last `RECENT` seconds of a stream."""
    if not samples:
        return samples
    return deque(s for s in samples if samples[-1].stamp - s.stamp < RECENT / NANOSECOND)


def shift(measured: deque[Sample], twin: deque[Sample]) -> float | None:
    """
    Return how far the stamps of a measured way are ahead of the twin's [s].

    None where the two agree, where nothing moves, or where no shift explains their difference.
    """
    if len(measured) < 2 or len(twin) < 2:
        return None
    epoch = twin[0].stamp
    t, way = _arrays(twin, epoch)
    at, seen = _arrays(measured, epoch)
    inside = (at >= t[0] + REACH) & (at <= t[-1] - REACH)
    if not inside.any() or np.ptp(at[inside]) < LEAST:
        return None
    at, seen = at[inside], seen[inside]
    none = _left(at, seen, t, way)
    if none < BLURRED**2:
        return None
    shifts = np.arange(-REACH, REACH + 0.5 * STEP, STEP)
    remaining = np.array([_left(at - s, seen, t, way) for s in shifts])
    # A weave is like itself again one period on; the shift nearest to none is the one meant.
    good = np.flatnonzero(remaining <= 1.2 * remaining.min() + 1e-10)
    k = int(good[np.argmin(np.abs(shifts[good]))])
    result = float(shifts[k]) + STEP * _vertex(remaining, k)
    return result if _left(at - result, seen, t, way) < EXPLAINED * none else None


def _arrays(samples: deque[Sample], epoch: int) -> tuple[Array, Array]:
    stamps, positions = zip(*samples, strict=True)
    return np.array([s - epoch for s in stamps]) * NANOSECOND, np.stack(positions)


def _left(at: Array, seen: Array, t: Array, way: Array) -> float:
    """Return the mean squared difference, a constant one apart [m^2]."""
    off = seen - np.stack([np.interp(at, t, axis) for axis in way.T], axis=1)
    return float(((off - off.mean(axis=0)) ** 2).sum(axis=1).mean())


def _vertex(remaining: Array, k: int) -> float:
    """Return where between its neighbours the parabola through a least value has its vertex."""
    if not 0 < k < remaining.size - 1:
        return 0.0
    before, here, after = remaining[k - 1 : k + 2]
    bend = before - 2.0 * here + after
    return 0.0 if bend <= 0.0 else float(np.clip(0.5 * (before - after) / bend, -1.0, 1.0))
