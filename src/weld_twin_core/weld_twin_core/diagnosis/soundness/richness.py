# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Is there enough to work on, and motion to see a cause, joint by joint, and tell frames apart?

Was anything recorded twice, or a stream frozen? Does a single reading stand out?
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ...arrays import Array
from ...errors import DataError
from ...recording import Recording
from ..algebra.open_directions import in_words, shown
from ..limits import ENOUGH, FEW, MOVED, NOISE, RUN, STRAY, TINY
from .evidence import Case, Finding, note, warning
from .lengths import length, listed

TWO_ARMS = 12
"""Turning joints from which a chain holds two arms: of six each. An arm on a gantry that welds on a
positioner has nine, or ten with seven axes."""


def motion(case: Case) -> Sequence[Finding]:
    """Return joints that hardly move or never reverse, and frames that cannot be told apart."""
    return [*_two_arms(case), *_hardly(case), *_one_way(case), *_frames(case)]


def _two_arms(case: Case) -> Iterator[Finding]:
    turning = int((~case.model.robot.prismatic).sum())
    if turning >= TWO_ARMS:
        yield note(
            f'The chain of {case.model.robot.name!r} has {turning} turning joints, as two arms '
            'together have; if only one was measured, give its own chain (--base-link, --tip-link): '
            'errors of the other take up its own.'
        )


def _hardly(case: Case) -> Iterator[Finding]:
    ranges = np.ptp(np.concatenate(case.motions), axis=0)
    robot = case.model.robot
    names = [
        f'{robot.joint_names[i]!r} ({_moved(ranges[i], bool(robot.prismatic[i]))})'
        for i in np.flatnonzero(ranges < MOVED)
    ]
    if names:
        yield note(
            f'{listed(names)} hardly move{"s" if len(names) == 1 else ""}; gear, play and ripple of '
            'such a joint cannot be seen, its spring only where its load changes, and its offset '
            'looks like one of its neighbours or of a frame.'
        )


def _moved(distance: float, prismatic: bool) -> str:
    return f'{distance * 1e3:.2g} mm' if prismatic else f'{np.degrees(distance):.2g} deg'


def _one_way(case: Case) -> Iterator[Finding]:
    if any(r.joints.static for r in case.recordings):
        return
    turned = np.zeros(case.model.robot.n, dtype=bool)
    for q in case.motions:
        travel = np.abs(np.diff(q, axis=0)).sum(axis=0)
        turned |= (travel < MOVED) | (travel - np.abs(q[-1] - q[0]) > MOVED)
    pairs = zip(case.model.robot.joint_names, turned, strict=True)
    names = [repr(name) for name, there in pairs if not there]
    if names:
        yield note(
            f'{listed(names)} never reverse{"s" if len(names) == 1 else ""}; '
            'play there looks like an offset.'
        )


def _frames(case: Case) -> Iterator[Finding]:
    """Report directions of the frames in which an error would not show."""
    names, _, strength, vectors = shown(case.problem, case.model, moving=True)
    hidden = int((strength < 1.0).sum())
    if hidden:
        strongest = np.argsort(-np.abs(vectors[:, 0]))[:2]
        pair = listed([in_words(names[i]) for i in sorted(strongest)])
        yield note(
            f'The motion leaves {hidden} of {len(names)} directions of the aligned frames open '
            f'(first of all {pair}); turn the tool more, about more axes, or align less.'
        )


def quantity(case: Case) -> Sequence[Finding]:
    """Return a note on few stations; DataError for fewer numbers than frames have, or no motion."""
    problem, total = case.problem, sum(case.problem.samples)
    frames = 6 * (len(case.recordings) if 'base' in problem.align else 0)
    frames += (6 if max(problem.rows) == 6 else 3) if 'tool' in problem.align else 0
    if problem.size <= frames or total < 3:
        raise DataError(
            f'{total} measurements give {problem.size} numbers, but the frames to '
            f'align have {frames}; measure more, or align less'
        )
    spread = max(float(np.ptp(q, axis=0).max()) for q in case.motions)
    seen = max(float(np.ptp(r.seen.position, axis=0).max()) for r in case.recordings)
    if spread < NOISE:
        others = 'the tool does, so these are not its joint states'
        why = 'there is nothing to compare' if seen < NOISE else others
        raise DataError(f'the joints do not move in any recording; {why}')
    if seen < NOISE and not case.tool_fixed:
        raise DataError('the joints move, but the measured tool never does; is the topic right?')
    if problem.at_rest and total < ENOUGH:
        return (note(f'With {total} stations few causes can be told apart.'),)
    return ()


def with_temperatures(
    recordings: Sequence[Recording], holdout: Sequence[Recording]
) -> tuple[Recording, ...]:
    """Return recordings without their temperatures where others have none: what grows is one model."""
    bare = [r.name for r in (*recordings, *holdout) if r.temperature is None]
    if not bare:
        return tuple(recordings)
    note = f'Its temperature is not used: {listed(bare)} came without one, so record it in all.'
    return tuple(
        r if r.temperature is None else replace(r, temperature=None, notes=(*r.notes, note))
        for r in recordings
    )


def refuse_reused(recordings: Sequence[Recording], holdout: Sequence[Recording]) -> None:
    """Raise DataError where a held-out recording has measurements that are fitted, whatever its name."""
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
    if case.tool_fixed:
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
        twice, again = (len(rows) - len(np.unique(rows, axis=0)) for rows in (both, q))
        # Of many readings of one posture some are equal by chance, to the digits that were written.
        if recording.joints.static and 2 * twice > again:
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
        where = f'station {worst + 1}' if recording.joints.static else f't = {at:.3f} s'
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
