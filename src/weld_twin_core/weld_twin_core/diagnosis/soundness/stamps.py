# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Do the streams belong to one clock, with stamps and velocities that can be?"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...bursts import ONE_CLOCK, Bursts, bursts, evenly
from ...effects.plausible import plausible
from ...recording import Recording
from ..algebra.independent_rows import robust_spread
from ..algebra.problem import FRAMES
from ..frames.aligned import aligned
from ..limits import CLEAR, ENOUGH, FEW, HALVED, LATE, MOVED, NOISE, TINY, WORTH
from .evidence import Case, Finding, mistake, note, warning
from .lag import KEPT, Lag
from .lengths import falls, listed
from .mending import Given, Mend, stamped_evenly, stamps_as, velocities_left_out


def streams(given: Given) -> list[Finding]:
    """Return velocities that cannot be, and clocks that have nothing in common."""
    out: list[Finding] = []
    for k, recording in enumerate(given.recordings):
        if recording.measured is None or recording.joints.static:
            continue
        out += _velocities(recording, k, given.robot.joint_names)
        apart = list(_apart(recording, k))
        out += apart or _in_bursts(given, k)
    return out


def velocities_checked(recording: Recording) -> Recording:
    if not _still(recording).any():
        return recording
    return replace(recording, joints=replace(recording.joints, qd=None))


def _velocities(recording: Recording, k: int, names: tuple[str, ...]) -> Iterator[Finding]:
    still, moving = _still(recording), np.ptp(recording.joints.q, axis=0) > MOVED
    if still.any():
        at = tuple(names[i] for i in np.flatnonzero(still))
        whose = 'every moving joint' if still.sum() == moving.sum() else listed(at)
        yield mistake(
            f'The joint states of {recording.name} give velocity zero for {whose} while the '
            'positions move.',
            'zero_velocities',
            at,
            'Publish measured velocities, or leave the field empty',
            partial(velocities_left_out, k=k),
        )


def _still(recording: Recording) -> NDArray[np.bool_]:
    joints = recording.joints
    if joints.qd is None or joints.static:
        return np.zeros(joints.q.shape[1], dtype=bool)
    moving = np.ptp(joints.q, axis=0) > MOVED
    return np.asarray(moving & (np.abs(joints.qd).max(axis=0) < TINY))


def _apart(recording: Recording, k: int) -> Iterator[Finding]:
    """Yield that no measurement lies inside the joint stream."""
    t, seen = recording.joints.t, recording.seen.t
    if seen.size == 0 or ((seen >= t[0]) & (seen <= t[-1])).any():
        return
    spans = float(np.ptp(t)), float(np.ptp(seen))
    late = float(seen[0] - t[0])
    mend = None
    # Streams of one recording are started by one command, and end together.
    if min(spans) > (1.0 - 2.0 * FEW) * max(spans):
        mend = partial(stamps_as, k=k, late=late, rate=0.0, middle=float(seen[0]))
    yield mistake(
        f'No measurement of {recording.name} lies inside its joint stream '
        f'({t[0]:.3f} to {t[-1]:.3f} s against {seen[0]:.3f} to {seen[-1]:.3f} s): the stamps are '
        'of two clocks.',
        'clock',
        ('clock',),
        ONE_CLOCK,
        mend,
    )


def _in_bursts(given: Given, k: int) -> Iterator[Finding]:
    """Yield that measurements were stamped when they were sent, where an even clock explains more."""
    recording = given.recordings[k]
    result = bursts(recording.seen.t)
    if result is None or recording.contacts is not None:
        return
    before, even, after = _evenly(given, k, result)
    if before < NOISE or HALVED * after > before:
        return
    t = recording.seen.t
    waited = float(np.median(t - evenly(even.first, even.step, even.lost, t.size, t.size)))
    missing = f' ({even.lost.size} were lost on the way)' if even.lost.size else ''
    yield mistake(
        f'The measurements of {recording.name} are {even.words}: they waited in a buffer{missing}, '
        f'{waited * 1e3:.0f} ms in the middle. Stamped evenly and so much earlier, '
        f'{falls(before, after)}.',
        'stamps_in_bursts',
        ('clock',),
        "Record the instrument's own time of each measurement, or send each at once; --apply "
        'stamps them anew',
        _stamped(even, k, t.size),
    )


def _evenly(given: Given, k: int, result: Bursts) -> tuple[float, Bursts, float]:
    """Return the median gap [m] as stamped, the even stamps that explain most, and their gap."""
    alone = replace(given, recordings=(given.recordings[k],))
    count = given.recordings[k].seen.t.size
    even = result
    for _ in range(2):  # frames and delay in turn; a third time changes nothing
        (late,) = _posed(_stamped(even, 0, count)(alone)).lags
        if late is None:
            break
        # A delay that grows evenly is another first stamp and another step.
        first = even.first - (late.late + late.rate * (even.first - late.middle))
        even = even._replace(first=first, step=even.step * (1.0 - late.rate))
    after = _posed(_stamped(even, 0, count)(alone))
    return _posed(alone).gap, even, after.gap


def _stamped(even: Bursts, k: int, count: int) -> Mend:
    first, step, lost = even.first, even.step, even.lost
    return partial(stamped_evenly, k=k, first=first, step=step, lost=lost, count=count)


def _posed(given: Given) -> Case:
    return Case(*aligned(given.recordings, given.robot, FRAMES, ()))


def stamps(case: Case) -> Iterator[Finding]:
    """Yield gaps, jitter and rounding of the joint and measurement stamps."""
    for recording in case.recordings:
        both = (recording.joints.t, 'joint states'), (recording.seen.t, 'measurements')
        for t, what in () if recording.joints.static else both:
            if t.size >= ENOUGH:
                yield from _stream(t, f'The {what} of {recording.name}')


def _stream(t: Array, name: str) -> Iterator[Finding]:
    sent = bursts(t)
    if sent is not None:
        yield warning(f'{name} are {sent.words}: none has its own time.')
        return
    steps = np.diff(t)
    usual = float(np.median(steps))
    gaps = steps > CLEAR * usual
    if gaps.any():
        lost = float((steps[gaps] / usual - 1.0).sum())
        level = 'warning' if lost > 2.0 * FEW * (t.size + lost) else 'note'
        at = float(t[:-1][gaps][steps[gaps].argmax()])
        yield Finding(
            level,
            f'{name} have {int(gaps.sum())} gap(s), the longest {steps.max():.3g} s at '
            f't = {at:.3g} s; about {lost:.0f} messages are missing.',
        )
    grid = written(t - t[0])
    counts = np.rint(steps / max(grid, TINY))
    # Dropped messages make whole multiples of the usual step, rounding makes one more or less.
    uneven = np.abs(counts - np.median(counts)) == 1.0
    if grid > FEW * usual and np.median(counts) > 1.0 and 2.0 * uneven.mean() > FEW:
        yield note(
            f'{name} are stamped in whole {grid * 1e3:g} ms; positions are '
            f'uncertain by the way made in {grid * 5e2:g} ms.'
        )
        return
    spread = robust_spread(steps[~gaps] - usual)
    if spread > 2.0 * FEW * usual:
        yield note(
            f'{name} come irregularly: every {usual * 1e3:.3g} ms, give or take '
            f'{spread * 1e3:.2g} ms.'
        )


def written(values: Array) -> float:
    """Return the power of ten to which numbers were rounded; 0 where they were not, or finely."""
    for digits in range(2, 7):
        if np.abs(values - values.round(digits)).max() < TINY:
            return float(10.0**-digits)
    return 0.0


def clocks(case: Case) -> Iterator[Finding]:
    """Yield how late the measurements of a moving arm are, where that explains the gap."""
    for k, late in enumerate(case.lags):
        if late is not None and _by_drives(case, k) > WORTH * late.after:
            yield from _late_by(case, late, k)


def _by_drives(case: Case, k: int) -> float:
    """Return the gap, RMS [m], that is left where every drive trails by a time of its own."""
    few, _ = case.rest
    maker, off = few.features(case.model)[k], few.residuals(case.model)[k][:3]
    trails = [maker.column(('q', i))[:3] * qd for i, qd in enumerate(maker.view.qd.T)]
    frame = [maker.column(('base', i))[:3] for i in range(6)]
    columns = np.reshape([*frame, *trails], (len(frame) + len(trails), -1))
    x = np.linalg.lstsq(columns.T, off.ravel(), rcond=None)[0]
    remaining = np.sort(((off.ravel() - x @ columns).reshape(off.shape) ** 2).sum(axis=0))
    return float(np.sqrt(remaining[: max(int(KEPT * remaining.size), 1)].mean()))


def _late_by(case: Case, lag: Lag, k: int) -> Iterator[Finding]:
    recording, rate = case.recordings[k], plausible(case.model.robot, 'clock_rate', 'rate')
    t = recording.seen.t
    step = max(float(np.median(np.diff(s))) for s in (t, recording.joints.t))
    start, end = (float(lag.at(edge)) for edge in (t[0], t[-1]))
    mend = partial(stamps_as, k=k, late=lag.late, rate=lag.rate, middle=lag.middle)
    if abs(end - start) > step:
        sentence = (
            f'The clocks of {recording.name} run apart by {lag.rate * 1e6:.0f} ppm: the '
            f'measurements are {_late(start)} at the start and {_late(end)} at the end.'
        )
        wrong = not rate.low <= lag.rate <= rate.high
    elif abs(lag.late) > 3 * step:
        cause = ', or commanded joints were recorded and the arm lags behind'
        sentence = (
            f'The measurements of {recording.name} are {_late(lag.late)} against the joint states:'
            f' the clocks are not synchronised{cause if lag.late > 0.0 else ""}.'
        )
        wrong = abs(lag.late) > LATE
    else:
        return
    if wrong:
        yield mistake(sentence, 'clock', ('clock',), ONE_CLOCK, mend)
    else:
        yield note(sentence)


def _late(seconds: float) -> str:
    return f'{abs(seconds) * 1e3:.0f} ms {"late" if seconds >= 0.0 else "early"}'
