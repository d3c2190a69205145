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
from .evidence import Case, Finding, distance, warning
from .lengths import length
from .limits import TINY

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
        if same > 0.5 * min(len(seen[i]), len(seen[k])):
            yield warning(
                f'{case.recordings[i].name} and {case.recordings[k].name} hold the same '
                f'measurements ({same} of {min(len(seen[i]), len(seen[k]))}); give each '
                'recording once.'
            )
    for recording, q in zip(case.recordings, case.motions, strict=True):
        position = recording.seen.position
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
            yield warning(
                f'{twice} station(s) of {recording.name} are there twice, equal to the last '
                'digit; a station measured again never is.'
            )


def _common(first: Array, second: Array) -> int:
    """Return how many rows of one are in the other too, to the last digit."""
    rows = {row.tobytes() for row in np.ascontiguousarray(first)}
    return sum(row.tobytes() in rows for row in np.ascontiguousarray(second))


WINDOW = 7
"""Neighbours in time that a sample is compared with."""
FAR = 10.0
"""Robust deviations from which a sample is an outlier."""
SMALL = 0.5
"""Share of the median gap below which nothing matters."""
ALONE = 0.4
"""A sample off its neighbours by less than this share is on the way from one to the other."""
SEVERAL, GROSS = 3, 3.0
"""Fewer than three outliers are told only when one is three times as far off as the limit."""
STATION_FAR = 8.0
"""Median gaps from which a station is an outlier."""
MANY = 0.1
"""Share of outliers from which a note becomes a warning."""


def outliers(case: Case) -> Iterator[Finding]:
    """Yield how many measurements are far off, and the worst of them."""
    for recording, part in zip(case.recordings, case.residuals, strict=True):
        off = _stations(part) if recording.joints.static else _of_samples(part)
        bad = off > 0.0
        if not bad.any():
            continue
        worst = int(off.argmax())
        at = recording.seen.t[worst]
        where = f'station {worst}' if recording.joints.static else f't = {at:.3f} s'
        yield Finding(
            'warning' if bad.mean() > MANY else 'note',
            f'{int(bad.sum())} of {off.size} measurements of {recording.name} lie far off '
            f'their neighbours, the worst by {length(float(off[worst]))} at {where}; they '
            'lose their weight in every fit.',
        )


def _running_median(part: Array) -> Array:
    """Return the median of every component over its neighbours in time; the ends repeat."""
    side = WINDOW // 2
    padded = np.pad(part, ((0, 0), (side, side)), mode='edge')
    return np.asarray(np.median(sliding_window_view(padded, WINDOW, axis=1), axis=-1))


def _of_samples(part: Array) -> Array:
    """Return how far samples are off a running median where that is too far, else 0, (M,) [m]."""
    smooth = _running_median(part[:3])
    off = np.linalg.norm(part[:3] - smooth, axis=0)
    # Vibration comes and goes: what one sample in ten does is no outlier.
    limit = max(FAR * float(np.median(off)), 4.0 * float(np.quantile(off, 0.9)))
    limit = max(limit, SMALL * float(np.median(distance(part))), TINY)
    bad = (off > limit) & (_peak(part[:3]) > ALONE * off)
    # Two joints that reverse at nearly the same time leave a spike; an instrument leaves several.
    if bad.sum() < SEVERAL and off.max() < GROSS * limit:
        return np.zeros(off.size)
    return np.where(bad, off, 0.0)


def _peak(position: Array) -> Array:
    """Return how far samples are off the middle of their two neighbours, shape (M,) [m]."""
    padded = np.pad(position, ((0, 0), (1, 1)), mode='edge')
    middle = 0.5 * (padded[:, :-2] + padded[:, 2:])
    return np.asarray(np.linalg.norm(position - middle, axis=0))


def _stations(part: Array) -> Array:
    off = distance(part - np.median(part, axis=1, keepdims=True))
    limit = max(STATION_FAR * float(np.median(off)), TINY)
    # Far off together means that the set-up moved; an outlier is alone.
    alone = distance(part[:3] - _running_median(part[:3]))
    return np.where((off > limit) & (alone > 0.5 * off), off, 0.0)
