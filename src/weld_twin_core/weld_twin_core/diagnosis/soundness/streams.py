# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is wrong with the streams themselves, before any robot is looked at."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...recording import Recording
from ...two_clocks import ONE_CLOCK
from .evidence import Mistake, listed
from .limits import LIKE_LENGTH, MOVED, STILL_SPEED
from .mending import Given, measured, stamps_as, velocities_left_out


def streams(given: Given) -> list[Mistake]:
    """Return velocities that cannot be, and clocks that have nothing in common."""
    out: list[Mistake] = []
    for k, recording in enumerate(given.recordings):
        if recording.measured is None or recording.joints.static:
            continue
        out += _velocities(recording, k, given.robot.joint_names)
        out += _apart(recording, k)
    return out


def velocities_checked(recording: Recording) -> Recording:
    """Return the recording without velocities that cannot be."""
    if not _still(recording).any():
        return recording
    return replace(recording, joints=replace(recording.joints, qd=None))


def _velocities(recording: Recording, k: int, names: tuple[str, ...]) -> Iterator[Mistake]:
    still, moving = _still(recording), np.ptp(recording.joints.q, axis=0) > MOVED
    if still.any():
        at = tuple(names[i] for i in np.flatnonzero(still))
        whose = 'every moving joint' if still.sum() == moving.sum() else listed(at)
        yield Mistake(
            'zero_velocities',
            at,
            f'The joint states of {recording.name} give velocity zero for {whose} while the '
            'positions move.',
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


def _apart(recording: Recording, k: int) -> Iterator[Mistake]:
    """Yield that no measurement lies inside the joint stream."""
    t, seen = recording.joints.t, measured(recording).t
    if seen.size == 0 or ((seen >= t[0]) & (seen <= t[-1])).any():
        return
    spans = float(np.ptp(t)), float(np.ptp(seen))
    late = float(seen[0] - t[0])
    mend = None
    if min(spans) > LIKE_LENGTH * max(spans):
        mend = partial(stamps_as, k=k, late=late, rate=0.0, middle=float(seen[0]))
    yield Mistake(
        'clock',
        ('clock',),
        f'No measurement of {recording.name} lies inside its joint stream '
        f'({t[0]:.3f} to {t[-1]:.3f} s against {seen[0]:.3f} to {seen[-1]:.3f} s): the stamps are '
        'of two clocks.',
        ONE_CLOCK,
        mend,
        of_all=False,
    )
