# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is wrong with the streams themselves, before any robot is looked at."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...bursts import Bursts, bursts, evenly
from ...recording import Recording
from ...two_clocks import ONE_CLOCK
from ..algebra.problem import FRAMES
from ..frames.aligned import aligned
from .evidence import Case, Finding, length, listed, mistake
from .limits import EVEN, EVEN_LEAST, LIKE_LENGTH, MOVED, STILL_SPEED
from .mending import Given, Mend, measured, stamped_evenly, stamps_as, velocities_left_out

ROUNDS = 2
"""Times that frames and delay are found in turn; a third changes nothing."""


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
    """Return the recording without velocities that cannot be."""
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
            of_all=False,
        )


def _still(recording: Recording) -> NDArray[np.bool_]:
    """Return which joints move at velocity zero, shape (n,)."""
    joints = recording.joints
    if joints.qd is None or joints.static:
        return np.zeros(joints.q.shape[1], dtype=bool)
    moving = np.ptp(joints.q, axis=0) > MOVED
    return np.asarray(moving & (np.abs(joints.qd).max(axis=0) < STILL_SPEED))


def _apart(recording: Recording, k: int) -> Iterator[Finding]:
    """Yield that no measurement lies inside the joint stream."""
    t, seen = recording.joints.t, measured(recording).t
    if seen.size == 0 or ((seen >= t[0]) & (seen <= t[-1])).any():
        return
    spans = float(np.ptp(t)), float(np.ptp(seen))
    late = float(seen[0] - t[0])
    mend = None
    if min(spans) > LIKE_LENGTH * max(spans):
        mend = partial(stamps_as, k=k, late=late, rate=0.0, middle=float(seen[0]))
    yield mistake(
        f'No measurement of {recording.name} lies inside its joint stream '
        f'({t[0]:.3f} to {t[-1]:.3f} s against {seen[0]:.3f} to {seen[-1]:.3f} s): the stamps are '
        'of two clocks.',
        'clock',
        ('clock',),
        ONE_CLOCK,
        mend,
        of_all=False,
    )


def _in_bursts(given: Given, k: int) -> Iterator[Finding]:
    """Yield that measurements were stamped when they were sent, where an even clock explains more."""
    recording = given.recordings[k]
    found = bursts(measured(recording).t)
    if found is None or recording.contacts is not None:
        return
    before, even, after = _evenly(given, k, found)
    if before < EVEN_LEAST or EVEN * after > before:
        return
    t = measured(recording).t
    waited = float(np.median(t - evenly(even.first, even.step, even.lost, t.size, t.size)))
    missing = f' ({even.lost.size} were lost on the way)' if even.lost.size else ''
    yield mistake(
        f'The measurements of {recording.name} are {even.words}: they waited in a buffer{missing}, '
        f'{waited * 1e3:.0f} ms in the middle. Stamped evenly and so much earlier, the gap falls '
        f'from {length(before)} to {length(after)}.',
        'stamps_in_bursts',
        ('clock',),
        "Record the instrument's own time of each measurement, or send each at once; --apply "
        'stamps them anew',
        _stamped(even, k, t.size),
        of_all=False,
    )


def _evenly(given: Given, k: int, found: Bursts) -> tuple[float, Bursts, float]:
    """Return the median gap [m] as stamped, the even stamps that explain most, and their gap."""
    alone = replace(given, recordings=(given.recordings[k],))
    count = measured(given.recordings[k]).t.size
    even = found
    for _ in range(ROUNDS):
        (late,) = _posed(_stamped(even, 0, count)(alone)).lags
        if late is None:
            break
        # A delay that grows evenly is another first stamp and another step.
        first = even.first - (late.late + late.rate * (even.first - late.middle))
        even = even._replace(first=first, step=even.step * (1.0 - late.rate))
    after = _posed(_stamped(even, 0, count)(alone))
    return _posed(alone).gap, even, after.gap


def _stamped(even: Bursts, k: int, count: int) -> Mend:
    """Return what stamps recording k by an even clock."""
    first, step, lost = even.first, even.step, even.lost
    return partial(stamped_evenly, k=k, first=first, step=step, lost=lost, count=count)


def _posed(given: Given) -> Case:
    """Return a recording with both frames fitted, wherever they are."""
    return Case(*aligned(given.recordings, given.robot, FRAMES, ()))
