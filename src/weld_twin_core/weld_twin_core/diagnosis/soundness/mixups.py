# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Is a large gap a mix-up of units, signs, joints, robots or frames?"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from ..frames.alignment import initial_frames, refined
from .evidence import LARGE, Case, Finding, length
from .snapshot import Snapshot, gap
from .suspicions import Suspicion, doubles, suspicions

EXPLAINED = 5.0
"""The gap must fall by this factor for a mix-up to be named."""
UNEXPLAINED = 0.01
"""Median gap [m] from which it is worth a warning that nothing explains it."""
SMALL_TURN = 0.09
"""Joint offsets [rad] up to which a large gap is bad mastering and not a mix-up."""
MOST = 3
"""So many mix-ups at once are looked for."""
WORTH = 0.7
"""A further mix-up must bring the gap below this share of what it was."""
ENOUGH = 1e-3
"""A gap [m] this small after a rough fit needs no further trials."""
SHORTLIST = 5
FAR = 0.05
"""A gap [m] from which wrong frames are an instrument's own, not an error of set-up."""


def mixups(case: Case) -> Sequence[Finding]:
    """Return what a gap of centimetres and more comes from, if not from the arm."""
    if case.gap < LARGE:
        return ()
    shot = case.snapshot
    model = shot.framed()
    left = gap(shot.problem, model)
    given = gap(shot.problem, shot.model)
    if left < LARGE or left < given / EXPLAINED:
        return _frames(case, given) if given > FAR else ()
    offset = shot.offset()
    turns = [abs(float(effect.vector()[0])) for effect in offset.found]
    if max(turns) < SMALL_TURN and gap(shot.problem, offset) < left / EXPLAINED:
        return ()
    found, rest = _unravelled(shot, left)
    if not found:
        return (Finding('warning', _unexplained(case, left)),) if left > UNEXPLAINED else ()
    words = '; '.join(s.words for s in found)
    words += f' (undone, the gap falls from {length(left)} to {length(rest)}'
    words += '; something else is wrong too)' if rest > LARGE else ')'
    return (Finding('warning', f'{words[0].upper()}{words[1:]}.'),)


def _frames(case: Case, before: float) -> Sequence[Finding]:
    """The given frames alone are to blame; name those that were not to be fitted."""
    given = case.problem.align
    for more in ({'base'}, {'tool'}, {'base', 'tool'}):
        if not more - given:
            continue
        problem = replace(case.snapshot.problem, align=given | more)
        left = gap(problem, refined(problem, initial_frames(problem, case.snapshot.model)))
        if left < max(LARGE, before / EXPLAINED):
            names = ' and '.join(sorted(more - given))
            return (
                Finding(
                    'warning',
                    f'The gap of {length(before)} is almost only one of frames: with the '
                    f'{names} fitted {length(left)} remain; have the {names} aligned if the '
                    'instrument stands anywhere, or the tool centre point was never measured.',
                ),
            )
    return ()


def _unexplained(case: Case, left: float) -> str:
    return (
        f'No base and tool frame brings the gap below {length(left)} (median), and no mix-up of '
        'units, signs, joint order, zero positions or bundled robots explains it; check that '
        f'{case.model.robot.name!r} is the robot that was measured.'
    )


def _unravelled(shot: Snapshot, start: float) -> tuple[list[Suspicion], float]:
    """Return the fewest mix-ups that explain the gap, and the gap without them."""
    for first in (suspicions, doubles):
        found: list[Suspicion] = []
        left, trial, look = start, shot, first
        while left > LARGE and len(found) < MOST:
            best, undone, rest = _best(trial, look(trial))
            if best is None or rest > WORTH * left:
                break
            found.append(best)
            trial, left, look = undone, rest, suspicions
        if left < start / EXPLAINED:
            return found, left
    return [], start


def _best(shot: Snapshot, tries: Iterable[Suspicion]) -> tuple[Suspicion | None, Snapshot, float]:
    """Return the mix-up whose undoing leaves least, from a rough ranking and a fit of the best."""
    tried, rough = [], []
    for suspicion in tries:
        trial = suspicion.undo(shot)
        tried.append((suspicion, trial))
        rough.append(trial.rough_gap())
        if rough[-1] < ENOUGH:
            return suspicion, trial, gap(trial.problem, trial.framed())
    best: tuple[Suspicion | None, Snapshot, float] = (None, shot, np.inf)
    for k in np.argsort(rough, kind='stable')[:SHORTLIST]:
        suspicion, trial = tried[k]
        left = gap(trial.problem, trial.framed())
        if left < WORTH * best[2]:
            best = (suspicion, trial, left)
    return best
