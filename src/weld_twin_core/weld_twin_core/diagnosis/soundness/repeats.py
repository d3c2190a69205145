# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Was anything recorded twice, or a stream frozen? Does a single reading stand out?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ...arrays import Array
from ...errors import DataError
from ...recording import Recording
from .evidence import Case, Finding, warning
from .lengths import length
from .limits import FEW, NOISE, RUN, STRAY, TINY


def refuse_reused(recordings: Sequence[Recording], holdout: Sequence[Recording]) -> None:
    """
    Refuse to judge on measurements that are fitted as well.

    Raises DataError: a held-out recording holds measurements of another, whatever its name.
    """
    for held in holdout:
        for recording in recordings:
            if (recording.contacts is None) != (held.contacts is None):
                continue
            first, second = _shown(recording), _shown(held)
            same = _common(first, second)
            # Coarse instruments repeat some of their readings; two of a tracker are never equal.
            if same > 2.0 * FEW * len(second):
                raise DataError(
                    f'{held.name}, given to judge on, holds {same} of its {len(second)} '
                    f'measurements in common with {recording.name}, which is fitted; hold out a '
                    'recording of its own'
                )


def _shown(recording: Recording) -> Array:
    """Return what a recording shows: positions, or the postures of contacts."""
    position = recording.seen.position if recording.contacts is None else None
    if position is None or (np.ptp(position, axis=0) < TINY).all():
        return recording.joints.q  # a bar that two arms hold stays where it is in all recordings
    return position


def repeats(case: Case) -> Iterator[Finding]:
    """Yield recordings given twice, samples given twice, and frozen measurements."""
    if case.held:
        return
    seen = [r.seen.position for r in case.recordings]
    for i, k in combinations(range(len(seen)), 2):
        same = _common(seen[i], seen[k])
        if 2 * same > min(len(seen[i]), len(seen[k])):
            yield warning(
                f'{case.recordings[i].name} and {case.recordings[k].name} hold the same '
                f'measurements ({same} of {min(len(seen[i]), len(seen[k]))}); give each '
                'recording once.'
            )
    for recording, q in zip(case.recordings, case.motions, strict=True):
        position = recording.seen.position
        still = (np.diff(position, axis=0) == 0.0).all(axis=1)
        moving = np.abs(np.diff(q, axis=0)).max(axis=1) > TINY
        frozen = int((still & moving).sum())
        if frozen > FEW * len(position):
            yield Finding(
                'warning' if frozen > 2.0 * FEW * len(position) else 'note',
                f'{frozen} of {len(position)} measurements of {recording.name} repeat the one '
                'before to the last digit while the arm moves; the instrument is slower than its '
                'stream, or lost the target.',
            )
        both = np.concatenate([position, q], axis=1)
        twice = len(both) - len(np.unique(both, axis=0))
        if recording.joints.static and twice > 0:
            yield warning(
                f'{twice} station(s) of {recording.name} are there twice, equal to the last '
                'digit; a station measured again never is.'
            )


def _common(first: Array, second: Array) -> int:
    """Return how many rows of one are in the other too, to the last digit."""
    rows = {row.tobytes() for row in np.ascontiguousarray(first)}
    return sum(row.tobytes() in rows for row in np.ascontiguousarray(second))


def outliers(case: Case) -> Iterator[Finding]:
    """Yield how many measurements are far off, and the worst of them."""
    for recording, part in zip(case.recordings, case.residuals, strict=True):
        off = _apart(part[:3])
        bad = off > 0.0
        if not bad.any():
            continue
        worst = int(off.argmax())
        at = recording.seen.t[worst]
        where = f'station {worst}' if recording.joints.static else f't = {at:.3f} s'
        yield Finding(
            'warning' if bad.mean() > FEW else 'note',
            f'{int(bad.sum())} of {off.size} measurements of {recording.name} lie far off '
            f'their neighbours, the worst by {length(float(off[worst]))} at {where}; they '
            'lose their weight in every fit.',
        )


def _apart(position: Array) -> Array:
    """Return how far samples (3, M) are off their neighbours where that is too far, else 0, (M,) [m]."""
    window = 2 * RUN - 1
    padded = np.pad(position, ((0, 0), (RUN - 1, RUN - 1)), mode='edge')
    middle = np.median(sliding_window_view(padded, window, axis=1), axis=-1)
    off: Array = np.linalg.norm(position - middle, axis=0)
    # Vibration comes and goes, and joints that reverse leave spikes: what few samples do is no stray.
    usual = max(float(np.quantile(off, 1.0 - 2.0 * FEW)), NOISE / STRAY)
    limit = max(STRAY * usual, float(np.median(np.linalg.norm(position, axis=0))) / 2.0)
    return np.where(off > limit, off, 0.0)
