# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What the stamps of streams tell: messages that are missing, a clock that jumped, a new run, two clocks.

Of two clocks, offsets of a second and more show in the stamps that arrive together. Smaller ones hide
behind the time a message takes on its way; they show in the motion: the measured way is that of the
twin, shifted in time.
"""

from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from weld_twin_core.arrays import Array
from weld_twin_msgs_py.assembly.intake import RESTART_AFTER

NANOSECOND = 1e-9
ALIVE = 1.5
"""Seconds within which a stream must have brought something to be compared."""
UNPAIRED = 2.0
"""Seconds without a pair after which it is reported that nothing pairs."""
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
"""Share of the squared deviation that a shift may leave, to be reported."""
SHIFTED = 0.012
"""Smallest shift [s] that is reported: servo loops trail by less."""
STEADY = 0.01
"""Seconds within which two looks in a row must agree."""
DRIFT_SPAN = 20.0
"""Seconds over which a drift is judged."""
DRIFTED = 0.004
"""Smallest change [s] that is reported as a drift."""


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
        """Return what to report about the clocks, by measurements that met the twin, wait, won't."""
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
            return f'{said}; {offset_words(offset, 1)}' if abs(offset) > APART else said
        if abs(offset) > APART and self.measured.in_real_time and self.twin.in_real_time:
            return offset_words(offset, 2)
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
        return offset_words(result, 3) + trailing

    def _drift(self) -> str:
        """Return what to report about a shift that grows with time."""
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


def offset_words(offset: float, digits: int) -> str:
    """Return an offset [s] in words."""
    where = 'ahead of' if offset > 0.0 else 'behind'
    return f'measurements are {abs(offset):.{digits}f} s {where} the joints'


def _recent(samples: deque[Sample]) -> deque[Sample]:
    if not samples:
        return samples
    return deque(s for s in samples if samples[-1].stamp - s.stamp < RECENT / NANOSECOND)


def shift(measured: deque[Sample], twin: deque[Sample]) -> float | None:
    """Return how far stamps of a measured way are ahead of the twin's [s]; None if none fits."""
    if len(measured) < 2 or len(twin) < 2:
        return None
    epoch = twin[0].stamp
    t, way = _arrays(twin, epoch)
    at, seen = _arrays(measured, epoch)
    inside = (at >= t[0] + REACH) & (at <= t[-1] - REACH)
    if not inside.any() or np.ptp(at[inside]) < LEAST:
        return None
    at, seen = at[inside], seen[inside]
    none = _mismatch(at, seen, t, way)
    if none < BLURRED**2:
        return None
    shifts = np.arange(-REACH, REACH + 0.5 * STEP, STEP)
    remaining = np.array([_mismatch(at - s, seen, t, way) for s in shifts])
    # A weave is like itself again one period on; the shift nearest to none is the one meant.
    good = np.flatnonzero(remaining <= 1.2 * remaining.min() + 1e-10)
    k = int(good[np.argmin(np.abs(shifts[good]))])
    result = float(shifts[k]) + STEP * _vertex(remaining, k)
    return result if _mismatch(at - result, seen, t, way) < EXPLAINED * none else None


def _arrays(samples: deque[Sample], epoch: int) -> tuple[Array, Array]:
    stamps, positions = zip(*samples, strict=True)
    return np.array([s - epoch for s in stamps]) * NANOSECOND, np.stack(positions)


def _mismatch(at: Array, seen: Array, t: Array, way: Array) -> float:
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

    missing: int = 0  # messages, by the gaps of a stream on a beat
    step: float = 0.0  # the beat, 0 where there is none [s]
    ahead: float = 0.0  # how far the stamps jumped forwards, 0 where they did not [s]
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
        """Return what was seen since the last look; newest steps wait for those after them."""
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
    """Return what steps (N,) [s] of stamps show, those from begin to end judged by all."""
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
