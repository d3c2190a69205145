# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Sealed cells, several at a time, each kept as soon as it is done."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError, TwinError
from weld_twin_msgs_py.files import markdown
from weld_twin_nodes.offline.investigation import SAID
from weld_twin_nodes.offline.task_pool import Runner, Task

from ..belief.learning import Weights, fitted
from ..blind.deck import lots
from ..study import Study, engine_digest, head, require_simulator, tabled

SIGNS = ('own', 'same', 'against')
"""Log odds of the answer, and those of the other diagnosis that speak for it, or against it."""
WAYS = np.array([1.0, 1.0, -1.0])
"""Which way each may change belief."""
RIDGE = 1.0
"""Towards the log odds of the answer alone, in log loss: as much as one answer."""
FOLDS = 10
"""Parts of the cells of which each is judged by weights learned from the others."""
TRIED = (0.9, 0.93, 0.95, 0.98)
"""Beliefs from which a question could be closed."""


class Heard(NamedTuple):
    """Every answer that was heard in the rounds of many cells."""

    signs: NDArray[Any]
    """Shape (N, 3)."""
    right: NDArray[Any]
    """Shape (N,)."""
    cell: NDArray[Any]
    turn: NDArray[Any]
    """Which cell, and which of its rounds, shape (N,)."""

    def only(self, rows: NDArray[Any]) -> Heard:
        return Heard(*(column[rows] for column in self))


def heard(cases: Sequence[Mapping[str, Any]]) -> Heard:
    """Return the answers that say what the causes are, of cells as in investigate.json."""
    rows = [
        (answer['signs'], answer['right'], k, turn)
        for k, case in enumerate(cases)
        for turn, step in enumerate(case['rounds'])
        for answer in (step.get('heard') or {}).values()
        if answer['stated']
    ]
    columns = zip(*rows, strict=True) if rows else ([], [], [], [])
    signs, right, cell, turn = (np.array(column) for column in columns)
    return Heard(signs.reshape(-1, len(SIGNS)), right.astype(bool), cell, turn)


def weights(taught: Heard) -> Weights:
    """Return what each sign counts, and what is added."""
    ones = np.ones(len(taught.right))
    prior = np.array([1.0, 0.0, 0.0])
    return fitted(taught.signs, taught.right, WAYS, RIDGE, ones, prior)


def unseen(all_: Heard) -> Array:
    """Return the belief in each answer by weights learned from other cells, shape (N,)."""
    out = np.zeros(len(all_.right))
    for fold in range(FOLDS):
        here = all_.cell % FOLDS == fold
        bias, slopes = weights(all_.only(~here))
        out[here] = 1.0 / (1.0 + np.exp(-(bias + all_.signs[here] @ slopes)))
    return out


def reached(all_: Heard, probability: Array, least: float) -> tuple[int, int]:
    """Return in how many cells the first answer believed by so much is right, and in how many wrong."""
    counts = [0, 0]
    for cell in np.unique(all_.cell):
        own = np.flatnonzero((all_.cell == cell) & (probability >= least))
        if own.size:
            first = own[all_.turn[own] == all_.turn[own].min()]
            counts[0 if all_.right[first[np.argmax(probability[first])]] else 1] += 1
    return counts[0], counts[1]


def closing_page(cases: Sequence[Mapping[str, Any]]) -> str:
    """Return what was learned, and its worth on other cells; raises DataError without two diagnoses."""
    all_ = heard(cases)
    if not len(all_.right):
        raise DataError('none of the cells has two diagnoses of the same round; give other tables')
    fit, probability = weights(all_), unseen(all_)
    learned = zip((*SIGNS, 'added'), (*fit.slopes, fit.bias), strict=True)
    rows = [(f'{least:.2f}', *map(str, reached(all_, probability, least))) for least in TRIED]
    return '\n'.join(
        [
            f'{len(all_.right)} answers of {len(np.unique(all_.cell))} cells',
            '',
            markdown.table(('sign', 'counts'), *((name, f'{v:.2f}') for name, v in learned)),
            '',
            markdown.table(('believed from', 'right', 'wrong'), *rows),
            '',
        ]
    )


Case = dict[str, Any]


def summary(cases: Sequence[Case]) -> dict[str, Any]:
    if not cases:
        return {'cells': 0}
    rounds = [step for case in cases for step in case['rounds']]
    certain = [case for case in cases if case['loop']['right'] and case['loop']['sure']]
    return {
        'cells': len(cases),
        'first': dict(sorted(Counter(str(c['first']['status']) for c in cases).items())),
        'right_and_sure': len(certain),
        'right': _count(cases, lambda c: c['loop']['right']),
        'sure_and_wrong': _count(cases, lambda c: c['loop']['sure'] and not c['loop']['right']),
        'minutes_to_certainty': float(np.median([c['minutes'] for c in certain]))
        if certain
        else None,
        'experiments': len(rounds),
        **_promises(rounds),
        'seconds': max((step['seconds'] for step in rounds), default=0.0),
    }


def _promises(rounds: Sequence[Case]) -> dict[str, Any]:
    """Return how often experiments decided, beside what they had said."""
    judged = [step for step in rounds if step['decided'] is not None]
    said = [step for step in judged if (step['promise'] or 0.0) >= SAID]
    return {
        'that_compared': len(judged),
        'foreseen': sum(step['promise'] or 0.0 for step in judged),
        'decided': _count(judged, lambda step: step['decided']),
        'said_they_would': len(said),
        'of_these_decided': _count(said, lambda step: step['decided']),
    }


def _count(cases: Sequence[Case], holds: Callable[..., bool]) -> int:
    return sum(bool(holds(case)) for case in cases)


def page(result: dict[str, Any]) -> str:
    totals, cases = result['summary'], result['cases']
    if not cases:
        return 'No cell was left open.\n'
    return '\n'.join(
        [
            *(f'- {key}: {totals[key]}' for key in totals if not isinstance(totals[key], dict)),
            '',
            tabled(COLUMNS, cases),
            '',
        ]
    )


def _in_words(answer: dict[str, Any]) -> str:
    right = 'right' if answer['right'] else 'wrong'
    sure = 'sure' if answer['sure'] else 'open'
    return f'{answer["status"]}, {right}, {sure}'


COLUMNS: dict[str, Callable[[Case], object]] = {
    'cell': lambda case: case['name'],
    'robot': lambda case: case['truth']['robot'],
    'first motion': lambda case: f'{case["truth"]["motion"]}, {case["poor"]}',
    'causes': lambda case: ' + '.join(
        ' of '.join(filter(None, site)) for site in case['truth']['sites']
    ),
    'first': lambda case: _in_words(case['first']),
    'asked': lambda case: ', '.join(
        f'{s["kind"]} {s["robot_minutes"]:.1f} min' for s in case['rounds']
    ),
    'loop': lambda case: _in_words(case['loop']),
    'ended': lambda case: case['end'],
}
"""Columns of the table of cells."""


KINDS = ('single', 'double', 'triple')
"""Cases with their causes in the library: of the others no experiment can make anybody sure."""
MOST_DRAWN = 40
"""Cells drawn for each that is wanted: most are diagnosed rightly from a poor motion."""
BATCH = 8
"""Cells drawn at a time: a run that has to end in between ends after some, whatever came of them."""


def investigated(
    seed: int, wanted: int, runner: Runner, tell: Callable[[str], None], *, minutes: float
) -> dict[str, Any]:
    """
    Investigate as many sealed cells as are wanted that poor motions leave open.

    minutes: no further cells are begun after so long.
    """
    end = time.monotonic() + 60.0 * minutes
    drawn: list[dict[str, Any]] = []
    cases: list[dict[str, Any]] = []
    for tasks in _batches(seed, wanted):
        drawn += runner.run(tasks)
        cases = [entry for entry in drawn if entry['open']][:wanted]
        tell(f'{len(drawn)} drawn, {len(cases)} left open at first')
        if len(cases) == wanted or time.monotonic() > end:
            break
    return head(
        'investigate/2',
        engine=engine_digest(),
        seed=seed,
        drawn=drawn.index(cases[-1]) + 1 if len(cases) == wanted else len(drawn),
        summary=summary(cases),
        cases=cases,
    )


def _batches(seed: int, wanted: int) -> Iterator[list[Task]]:
    most = MOST_DRAWN * wanted
    for begin in range(0, most, BATCH):
        numbers = range(begin, min(begin + BATCH, most))
        yield [Task(investigated_cell, (seed, k), f'cell {k}') for k in numbers]


def investigated_cell(seed: int, number: int) -> dict[str, Any]:
    """Return what came of one cell, in plain values; the simulator is loaded where it is needed."""
    require_simulator()
    from .trial import SealedCell, looped, poor_at_first

    begun = time.process_time()
    try:
        cell = SealedCell(lots(seed, number + 1, KINDS)[number], seed, number)
    except TwinError as error:
        return {'open': False, 'why': str(error)}
    made = time.process_time()
    first = poor_at_first(cell)
    spent = {'making': made - begun, 'first': time.process_time() - made}
    if first is None:
        return {'open': False, 'why': 'right from the first', 'spent': spent}
    entry = looped(cell, *first)
    spent['loop'] = time.process_time() - begun - sum(spent.values())
    return {'open': True, **entry, 'spent': spent}


def run(study: Study) -> None:
    args = study.args
    if args.learn_from:
        study.write('closing', page=closing_page(_kept(args.learn_from)))
        return
    with study.runner('investigating') as runner:
        result = investigated(args.seed, args.cells, runner, study.tell, minutes=args.minutes)
    study.write('investigate', result, page(result))


def _kept(tables: Sequence[str]) -> list[Case]:
    """Return the cells of tables; refuse what is none."""
    out: list[Case] = []
    for table in tables:
        try:
            out += json.loads(Path(table).read_text(encoding='utf-8'))['cases']
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise DataError(f"'{table}' is no table of investigated cells: {error}") from None
    return out
