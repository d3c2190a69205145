# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One sealed cell, investigated; and the same minutes spent as is usual."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

from weld_twin_core.diagnosis.advice import Limits
from weld_twin_core.errors import TwinError
from weld_twin_core.recording import Recording
from weld_twin_nodes.offline.investigation import decided, question, weighed

from ..blind.recorded_motion import Motion
from .sealed_cell import STAY, SealedCell, as_motion
from .usual_practice import at_random, d_optimal, rich

ROUNDS = 3
"""Experiments at most."""
MINUTES = 5.0
"""Of robot motion at most, all experiments together."""
STEPS = (8, 20)
"""Stations after which D-optimal ones are diagnosed, up to as many as the minutes hold."""


def said(cell: SealedCell, found: Mapping[str, Any], why: str) -> dict[str, Any]:
    """Return a diagnosis in short, judged by the truth; why it closes the question, if it does."""
    judged = cell.judged(found)
    return {
        'status': judged.status,
        'confidence': judged.confidence,
        'said': judged.said,
        'right': judged.right,
        'sure': bool(why),
    }


def answered(
    cell: SealedCell, first: Recording, later: Sequence[Recording], minutes: float = MINUTES
) -> tuple[Mapping[str, Any], str]:
    """Return the answer from the first recording and later ones, and why it closes the question."""
    limits = Limits(minutes=max(minutes, 0.25), set_up=False)
    together = cell.diagnosed([first, *later], limits=limits)
    if not later:
        return weighed(together)
    try:
        alone = cell.diagnosed(list(later), holdout=[first], limits=limits)
    except TwinError:
        # Too few stations to be diagnosed by themselves.
        return weighed(together)
    return weighed(together, alone)


def poor_at_first(cell: SealedCell) -> tuple[dict[str, Any], dict[str, Any]] | None:
    """Return the first diagnosis and what it is worth; None where it is right or finds a mistake."""
    found, why = answered(cell, cell.first(), [])
    first = said(cell, found, why)
    wrong = first['status'] in ('ambiguous', 'unknown') or not first['right']
    # What cannot be told apart by any motion is no question for an experiment.
    closed = first['right'] and first['sure']
    return (dict(found), first) if wrong and not closed else None


def trial(cell: SealedCell, found: Mapping[str, Any], first: Mapping[str, Any]) -> dict[str, Any]:
    """
    Return what came of one cell.

    Parameters
    ----------
    cell : SealedCell
    found : mapping
        The first diagnosis.
    first : mapping
        The same in short.

    """
    start = cell.first()
    rounds, end, answer = investigated(cell, start, found, dict(first))
    minutes = sum(step['robot_minutes'] for step in rounds)
    spent = max(minutes, 1.0)
    count = max(int(60.0 * spent / STAY), 1)
    others = {
        'random': at_random(cell.robot, cell.still, spent, 1),
        'rich': rich(cell.robot, cell.still, spent),
        'd_optimal': d_optimal(cell.robot, count, _points(start)),
    }
    told = {name: _with(cell, start, name, motion) for name, motion in others.items()}
    good = answer['right'] and answer['sure']
    return {
        'name': cell.name,
        'seal': cell.seal,
        'poor': cell.poor,
        'still': cell.still,
        'truth': {**cell.opened(), 'causes': None},
        'first': dict(first),
        'rounds': rounds,
        'end': end,
        'minutes': minutes,
        'loop': answer,
        **told,
        'd_optimal_stations': _to_certainty(cell, start, count, told) if good else None,
    }


def investigated(
    cell: SealedCell, start: Recording, found: Mapping[str, Any], answer: dict[str, Any]
) -> tuple[list[dict[str, Any]], str, dict[str, Any]]:
    """Return the rounds of the loop, the word that it ended with, and its last answer."""
    later: list[Recording] = []
    rounds: list[dict[str, Any]] = []
    left, why = MINUTES, None
    while True:
        asked = question(found, left, [step['kind'] for step in rounds], why)
        if not isinstance(asked, dict):
            return rounds, asked[0], answer
        if len(rounds) == ROUNDS:
            return rounds, 'rounds spent', answer
        name = f'experiment {len(rounds) + 1}'
        later.append(cell.made(name, as_motion(asked['motion'], cell.robot), 100 + len(rounds)))
        left -= asked['robot_minutes']
        begun = time.perf_counter()
        try:
            found, why = answered(cell, start, later, left)
        except TwinError as error:
            return rounds, f'refused: {error}', answer
        answer = said(cell, found, why)
        rounds.append(
            {
                **{key: asked[key] for key in ('kind', 'robot_minutes', 'stations')},
                'expected_sigma': asked['expected_sigma'],
                'between': asked['between'],
                'decided': decided(asked, found),
                'seconds': time.perf_counter() - begun,
                'found': answer,
            }
        )


def _with(cell: SealedCell, start: Recording, name: str, motion: Motion) -> dict[str, Any]:
    """Return what a further recording of a motion leads to."""
    try:
        return said(cell, *answered(cell, start, [cell.made(name, motion, 200)]))
    except TwinError as error:
        return {'status': 'refused', 'said': str(error), 'right': False, 'sure': False}


def _to_certainty(
    cell: SealedCell, start: Recording, tried: int, told: Mapping[str, Any]
) -> int | None:
    """Return after how many D-optimal stations the answer is right and sure; None: never."""
    for count in sorted({*STEPS, tried}):
        motion = d_optimal(cell.robot, count, _points(start))
        again = count == tried
        answer = told['d_optimal'] if again else _with(cell, start, f'd {count}', motion)
        if answer['right'] and answer['sure']:
            return count
    return None


def _points(recording: Recording) -> bool:
    return recording.measured is None or recording.measured.rotation is None
