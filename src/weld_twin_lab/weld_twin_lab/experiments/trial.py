# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One sealed cell, investigated."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

from weld_twin_core.diagnosis.advice import Limits
from weld_twin_core.errors import TwinError
from weld_twin_core.recording import Recording
from weld_twin_nodes.offline.investigation import STATED, decided, question, short, signs, weighed

from .sealed_cell import SealedCell, as_motion

ROUNDS = 3
"""Experiments at most."""
MINUTES = 5.0
"""Of robot motion at most, all experiments together."""
VISIT = 60.0
"""Minutes at most, all experiments together, with what has to be set up for them."""
Content = Mapping[str, Any]
"""The content of a diagnosis.json."""
LEAST = 0.25
"""Minutes that an experiment is planned with where hardly any are left."""
ASKED = (
    *('kind', 'minutes', 'robot_minutes', 'stations'),
    *('expected_sigma', 'between', 'promise', 'changes'),
)
"""What is kept of every experiment."""


def said(cell: SealedCell, diagnosis: Mapping[str, Any], why: str) -> dict[str, Any]:
    """Return a diagnosis in short, judged by the truth; why it closes the question, if it does."""
    judged = cell.judged(diagnosis)
    return {
        'status': judged.status,
        'confidence': judged.confidence,
        'said': judged.said,
        'right': judged.right,
        'sure': bool(why),
    }


def answered(
    cell: SealedCell, first: Recording, later: Sequence[Recording], limits: Limits
) -> tuple[Content, str, dict[str, Any]]:
    """
    Return the answer from the first recording and later ones, why it closes the question, and how.

    limits: what the next experiment may take.

    Returns
    -------
    diagnosis : mapping
    why : str
    heard : dict
        What the two diagnoses were weighed by, and what they are worth; empty where there was one.

    """
    by_itself = not later or cell.seen_anew(later)
    asked = replace(limits, confirm=by_itself)
    together = cell.diagnosed([first, *later], limits=asked)
    if by_itself:
        return *weighed(together), {}
    # Too few stations cannot be diagnosed by themselves.
    with suppress(TwinError):
        alone = cell.diagnosed(list(later), limits=limits)
        pairs = {'together': (together, alone), 'alone': (alone, together)}
        heard = {name: _weight(cell, *pair) for name, pair in pairs.items()}
        return *weighed(together, alone), heard
    return *weighed(together), {}


def _weight(cell: SealedCell, diagnosis: Content, other: Content) -> dict[str, Any]:
    return {
        'signs': signs(diagnosis, other),
        'stated': diagnosis['verdict']['status'] in STATED,
        'right': cell.judged(diagnosis).right,
    }


def _limits(minutes: float, visit: float = VISIT) -> Limits:
    return Limits(minutes=max(visit, LEAST), moving=max(minutes, LEAST))


def poor_at_first(cell: SealedCell) -> tuple[dict[str, Any], dict[str, Any]] | None:
    """Return the first diagnosis and what it is worth; None where it is right or finds a mistake."""
    diagnosis, why, _ = answered(cell, cell.first, [], _limits(MINUTES))
    first = said(cell, diagnosis, why)
    wrong = first['status'] in ('ambiguous', 'unknown') or not first['right']
    # What cannot be told apart by any motion is no question for an experiment; nor is one that only
    # confirms what is right already.
    confirms = bool((diagnosis['next_experiment'] or {}).get('confirms'))
    closed = first['right'] and (first['sure'] or confirms)
    return (dict(diagnosis), first) if wrong and not closed else None


def looped(
    cell: SealedCell, diagnosis: Mapping[str, Any], first: Mapping[str, Any]
) -> dict[str, Any]:
    """
    Return what came of one cell that was investigated.

    diagnosis: the first diagnosis.
    first: the same in short.
    """
    rounds, end, answer = investigated(cell, cell.first, diagnosis, dict(first))
    return {
        'name': cell.name,
        'seal': cell.seal,
        'poor': cell.poor,
        'still': cell.still,
        'truth': {**cell.opened(), 'causes': None},
        'first': dict(first),
        'rounds': rounds,
        'end': end,
        'minutes': sum(step['robot_minutes'] for step in rounds),
        'loop': answer,
    }


def investigated(
    cell: SealedCell, start: Recording, diagnosis: Mapping[str, Any], answer: dict[str, Any]
) -> tuple[list[dict[str, Any]], str, dict[str, Any]]:
    """Return the rounds of the loop, the word that it ended with, and its last answer."""
    later: list[Recording] = []
    rounds: list[dict[str, Any]] = []
    remaining, visit, why = MINUTES, VISIT, None
    while True:
        asked = question(diagnosis, visit, [step['kind'] for step in rounds], why)
        if not isinstance(asked, dict):
            # What the visit would allow, the minutes of motion may not.
            spent = asked[0] == 'nothing would part them' and not why and short(remaining)
            return rounds, 'minutes spent' if spent else asked[0], answer
        if len(rounds) == ROUNDS or asked['robot_minutes'] > remaining:
            return rounds, 'rounds spent' if len(rounds) == ROUNDS else 'minutes spent', answer
        name = f'experiment {len(rounds) + 1}'
        motion = as_motion(asked['motion'], cell.robot)
        later.append(cell.made(name, motion, 100 + len(rounds), asked['changes']))
        remaining, visit = remaining - asked['robot_minutes'], visit - asked['minutes']
        begun = time.perf_counter()
        try:
            diagnosis, why, heard = answered(cell, start, later, _limits(remaining, visit))
        except TwinError as error:
            return rounds, f'refused: {error}', answer
        answer = said(cell, diagnosis, why)
        rounds.append(
            {
                **{key: asked[key] for key in ASKED},
                'decided': decided(asked, diagnosis),
                'seconds': time.perf_counter() - begun,
                'found': answer,
                'heard': heard,
            }
        )
