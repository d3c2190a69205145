# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What hangs on each belief: every one moved both ways on cases whose truths are known."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.diagnosis import Diagnosis
from weld_twin_core.diagnosis.beliefs import Beliefs
from weld_twin_core.diagnosis.verdict.decision import Verdict, decide
from weld_twin_core.diagnosis.verdict.evidence import Evidence
from weld_twin_core.errors import DataError
from weld_twin_nodes.offline.task_pool import Runner, Task

from . import layout, seal
from .diagnosing import diagnosis_of, engine_digest
from .judging import Judged, judge

MOVE = 0.25
"""Share of its value by which every belief is moved, both ways; whole numbers by one at least."""
LATE = 'verdict'
"""Step of the beliefs that need no new fit."""
Told = Mapping[str, Any]
"""A verdict in plain values, as `told_of` gives it."""


@dataclass(frozen=True)
class Move:
    """One belief moved: its name, the step it acts in, its usual value and the other one."""

    belief: str
    step: str
    value: float
    other: float

    @property
    def beliefs(self) -> Beliefs:
        """Return the beliefs with this one moved."""
        changed: dict[str, Any] = {self.belief: self.other}
        return replace(Beliefs(), **changed)


def study(
    cases: Path, truths: Path, runner: Runner, refitted: int, only: Sequence[str] = ()
) -> dict[str, Any]:
    """
    Return what changes when each belief is moved.

    Parameters
    ----------
    cases, truths : Path
        As ``blind make`` writes them; the cases must be readable beside their truths.
    runner : Runner
        Its store makes the work resumable.
    refitted : int
        Cases diagnosed anew for a belief that acts before the verdict, spread evenly. For the
        others the verdict is drawn anew from the same evidence, on all cases.
    only : sequence of str
        Beliefs to move; all when empty.

    Raises
    ------
    DataError
        A case or a truth is not what was sealed, or there is no belief of a name in ``only``.

    """
    moves = list(_moves(only))
    opened = seal.opened(cases, truths)
    late = [(move.belief, move.other) for move in moves if move.step == LATE]
    engine = engine_digest()
    whole = runner.run([_task(decided, cases, truth, engine, late) for truth in opened])
    usual = [told['usual'] for told in whole]
    final = [told['whole'] for told in whole]
    few = [int(k) for k in np.unique(np.linspace(0, len(opened) - 1, refitted).round())]
    early = [move for move in moves if move.step != LATE] if few else []
    anew = runner.run(
        [
            _task(refitted_case, cases, opened[k], engine, (move.belief, move.other))
            for move in early
            for k in few
        ]
    )
    rows = [
        _row(move, opened, usual, [told['moved'][k] for told in whole])
        for k, move in enumerate(m for m in moves if m.step == LATE)
    ]
    rows += [
        _row(move, [opened[i] for i in few], [final[i] for i in few], anew[at : at + len(few)])
        for move, at in zip(early, range(0, len(anew), max(len(few), 1)), strict=True)
    ]
    return {
        'schema': 'weld_twin/beliefs/1',
        'seal': layout.read(cases / layout.CASES)['seal'],
        'move': MOVE,
        'usual': {
            'verdict': _totals(_judged(opened, usual)),
            'others': _totals(_judged([opened[k] for k in few], [final[k] for k in few])),
        },
        'rows': rows,
    }


def _task(function: Any, cases: Path, truth: Told, engine: str, moved: Any) -> Task:
    name = str(truth['name'])
    return Task(function, (str(cases / name), engine, moved), name)


def decided(place: str, engine: str, moves: Sequence[tuple[str, float]]) -> dict[str, Any]:
    """Return the verdict on a case, and the one drawn from the same evidence for every move."""
    result = diagnosis_of(Path(place))
    evidence = _evidence(result)
    verdicts = [decide(evidence, Move(name, LATE, 0.0, other).beliefs) for name, other in moves]
    return {
        'usual': told_of(decide(evidence)),
        'whole': told_of(result),
        'moved': [told_of(v) for v in verdicts],
    }


def refitted_case(place: str, engine: str, move: tuple[str, float]) -> dict[str, Any]:
    """Return the verdict on a case that is diagnosed anew with one belief moved."""
    return told_of(diagnosis_of(Path(place), beliefs=Move(move[0], '', 0.0, move[1]).beliefs))


def _evidence(result: Diagnosis) -> Evidence:
    if not isinstance(result.evidence, Evidence):
        raise DataError(f'{result.status}: such a diagnosis comes to no evidence to decide on')
    return result.evidence


def told_of(said: Verdict | Diagnosis) -> dict[str, Any]:
    """Return a verdict in plain values, without estimates: beliefs do not move them."""
    sets = said.sets if isinstance(said, Verdict) else said.indistinguishable
    return {
        'status': said.status,
        'confidence': said.confidence or 0.0,
        'indistinguishable': [
            [{'effect': s.effect, 'joint': s.joint} for s in group] for group in sets
        ],
        'effects': [],
    }


def _moves(only: Sequence[str]) -> Iterator[Move]:
    """Yield every move to make."""
    usual = Beliefs()
    steps = {item.name: str(item.metadata['step']) for item in fields(usual)}
    most = {item.name: float(item.metadata.get('most', np.inf)) for item in fields(usual)}
    unknown = sorted(set(only) - set(steps))
    if unknown:
        raise DataError(f'there is no belief {unknown[0]!r}; they are ' + ', '.join(steps))
    for name in only or steps:
        value = getattr(usual, name)
        for way in (-1, 1):
            step = max(1, round(MOVE * value)) if isinstance(value, int) else MOVE * value
            yield Move(name, steps[name], value, min(value + way * step, most[name]))


def _row(
    move: Move, truths: Sequence[Told], usual: Sequence[Told], moved: Sequence[Told]
) -> dict[str, Any]:
    """Return how many verdicts change, by how much confidence does, and how many are right."""
    pairs = list(zip(usual, moved, strict=True))
    return {
        'belief': move.belief,
        'step': move.step,
        'value': move.value,
        'moved_to': move.other,
        'verdicts': sum(_named(a) != _named(b) for a, b in pairs),
        'confidence': max((abs(a['confidence'] - b['confidence']) for a, b in pairs), default=0.0),
        **_totals(_judged(truths, moved)),
    }


def _named(told: Told) -> tuple[str, list[list[str]]]:
    groups = [sorted(map(str, group)) for group in told['indistinguishable']]
    return str(told['status']), sorted(groups)


def _judged(truths: Sequence[Told], told: Sequence[Told]) -> list[Judged]:
    return [judge(truth, {'verdict': one}) for truth, one in zip(truths, told, strict=True)]


def _totals(judged: Sequence[Judged]) -> dict[str, int]:
    return {
        'cases': len(judged),
        'right': sum(one.right for one in judged),
        'sure_and_wrong': sum(one.confidently_wrong for one in judged),
    }
