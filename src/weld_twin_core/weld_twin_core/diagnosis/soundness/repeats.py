# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Was anything recorded twice, or a stream frozen?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from ...arrays import Array
from ...errors import DataError
from ...recording import Recording
from .evidence import Case, Finding
from .snapshot import measured

REUSED = 0.2
"""
Share of a held-out recording that may be in another one to the last digit.

Two measurements of a laser tracker, 15 um apart in noise, are never equal; coarse instruments
repeat some of their readings.
"""
FROZEN = 0.02
"""Share of measurements that repeat the one before, from which it is said."""


def refuse_reused(recordings: Sequence[Recording], holdout: Sequence[Recording]) -> None:
    """
    Refuse to judge on measurements that are fitted as well.

    Raises
    ------
    DataError
        A held-out recording holds measurements of another, whatever its name.

    """
    for held in holdout:
        for recording in recordings:
            if (recording.contacts is None) != (held.contacts is None):
                continue
            first, second = _shown(recording), _shown(held)
            same = _common(first, second)
            if same > REUSED * len(second):
                raise DataError(
                    f'{held.name}, given to judge on, holds {same} of its {len(second)} '
                    f'measurements in common with {recording.name}, which is fitted; hold out a '
                    'recording of its own'
                )


def _shown(recording: Recording) -> Array:
    """Return what a recording shows: positions, or the postures of contacts."""
    if recording.contacts is not None:
        return recording.joints.q
    return measured(recording).position


def repeats(case: Case) -> Sequence[Finding]:
    """Return recordings given twice, samples given twice, and frozen measurements."""
    return [*_recordings(case), *_samples(case)]


def _recordings(case: Case) -> Iterator[Finding]:
    seen = [measured(r).position for r in case.recordings]
    for i, k in combinations(range(len(seen)), 2):
        same = _common(seen[i], seen[k])
        if same > 0.5 * min(len(seen[i]), len(seen[k])):
            yield Finding(
                'warning',
                f'{case.recordings[i].name} and {case.recordings[k].name} hold the same '
                f'measurements ({same} of {min(len(seen[i]), len(seen[k]))}); give each '
                'recording once.',
            )


def _samples(case: Case) -> Iterator[Finding]:
    for recording, q in zip(case.recordings, case.motions, strict=True):
        position = measured(recording).position
        still = (np.diff(position, axis=0) == 0.0).all(axis=1)
        moving = np.abs(np.diff(q, axis=0)).max(axis=1) > 1e-6
        frozen = int((still & moving).sum())
        if frozen > FROZEN * len(position):
            yield Finding(
                'warning' if frozen > 0.2 * len(position) else 'note',
                f'{frozen} of {len(position)} measurements of {recording.name} repeat the one '
                'before to the last digit while the arm moves; the instrument is slower than its '
                'stream, or lost the target.',
            )
        both = np.concatenate([position, q], axis=1)
        twice = len(both) - len(np.unique(both, axis=0))
        if recording.joints.static and twice > 0:
            yield Finding(
                'warning',
                f'{twice} station(s) of {recording.name} are there twice, equal to the last '
                'digit; a station measured again never is.',
            )


def _common(first: Array, second: Array) -> int:
    """Return how many rows of one are in the other too, to the last digit."""
    rows = {row.tobytes() for row in np.ascontiguousarray(first)}
    return sum(row.tobytes() in rows for row in np.ascontiguousarray(second))
