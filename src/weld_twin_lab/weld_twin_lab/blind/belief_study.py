# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What hangs on each belief: every one moved both ways on cases whose truths are known."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.diagnosis import Diagnosis
from weld_twin_core.diagnosis.beliefs import Beliefs
from weld_twin_core.diagnosis.verdict.decision import Verdict, decide
from weld_twin_core.diagnosis.verdict.evidence import Evidence
from weld_twin_core.errors import DataError

from . import layout, seal
from .diagnosing import diagnosis_of
from .judging import Judged, judge

MOVE = 0.25
"""Share of its value by which every belief is moved, both ways; whole numbers by one at least."""


@dataclass(frozen=True, eq=False)
class Case:
    """A case with its truth, and what is said of it with the usual beliefs."""

    place: Path
    truth: Mapping[str, Any]
    evidence: Evidence
    judged: Judged
    said: Verdict


def study(
    cases: Path, truths: Path, refitted: int, only: Sequence[str], tell: Callable[[str], None]
) -> dict[str, Any]:
    """
    Return what changes when each belief is moved.

    Parameters
    ----------
    cases, truths : Path
        As ``blind make`` writes them; the cases must be readable beside their truths.
    refitted : int
        Cases diagnosed anew for a belief that acts before the verdict, spread evenly. The
        others are only decided anew, on all cases.
    only : sequence of str
        Beliefs to move; all when empty.
    tell : callable
        Told what has been done.

    Raises
    ------
    DataError
        A case or a truth is not what was sealed, or there is no belief of a name in ``only``.

    """
    usual = Beliefs()
    moved = _chosen(usual, only)
    whole = [_case(cases, truth, tell) for truth in seal.opened(cases, truths)]
    few = [whole[k] for k in _spread(len(whole), refitted)]
    rows = []
    for name, step, value, other in moved:
        changed: dict[str, Any] = {name: other}
        beliefs = replace(usual, **changed)
        late = step == 'verdict'
        if not late and not few:
            continue
        row = _row(whole, _decided(beliefs)) if late else _row(few, _refitted(beliefs))
        rows.append({'belief': name, 'step': step, 'value': value, 'moved_to': other, **row})
        tell(f'{name} {value:g} -> {other:g}: {row["verdicts"]} of {row["cases"]} verdicts change')
    return {
        'schema': 'weld_twin/beliefs/1',
        'seal': layout.read(cases / layout.CASES)['seal'],
        'move': MOVE,
        'usual': {'verdict': _totals(whole), 'others': _totals(few)},
        'rows': rows,
    }


def _chosen(usual: Beliefs, only: Sequence[str]) -> list[tuple[str, str, float, float]]:
    """Return name, step, value and moved value of every move to make."""
    steps = {item.name: str(item.metadata['step']) for item in fields(usual)}
    unknown = sorted(set(only) - set(steps))
    if unknown:
        raise DataError(f'there is no belief {unknown[0]!r}; they are ' + ', '.join(steps))
    return [
        (name, step, getattr(usual, name), other)
        for name, step in steps.items()
        if not only or name in only
        for other in _others(getattr(usual, name))
    ]


def _others(value: float) -> Iterator[float]:
    for way in (-1, 1):
        if isinstance(value, int):
            yield value + way * max(1, round(MOVE * value))
        else:
            yield value * (1.0 + way * MOVE)


def _spread(count: int, wanted: int) -> list[int]:
    places = np.linspace(0, count - 1, min(wanted, count)).round().astype(int)
    return [int(k) for k in np.unique(places)]


def _case(cases: Path, truth: Mapping[str, Any], tell: Callable[[str], None]) -> Case:
    place = cases / str(truth['name'])
    result = diagnosis_of(place)
    evidence = _evidence(result)
    said = decide(evidence)
    tell(f'{place.name}: {said.status}')
    return Case(place, truth, evidence, _judged(truth, said), said)


def _evidence(result: Diagnosis) -> Evidence:
    if not isinstance(result.evidence, Evidence):
        raise DataError('a diagnosis of this version holds no evidence to decide on anew')
    return result.evidence


def _judged(truth: Mapping[str, Any], verdict: Verdict) -> Judged:
    """Return what a verdict is worth; estimates are left out, as beliefs do not move them."""
    groups = [[{'effect': s.effect, 'joint': s.joint} for s in group] for group in verdict.sets]
    told = {
        'status': verdict.status,
        'confidence': verdict.confidence,
        'indistinguishable': groups,
        'effects': [],
    }
    return judge(truth, {'verdict': told})


def _decided(beliefs: Beliefs) -> Callable[[Case], Verdict]:
    return lambda case: decide(case.evidence, beliefs)


def _refitted(beliefs: Beliefs) -> Callable[[Case], Verdict]:
    def anew(case: Case) -> Verdict:
        return decide(_evidence(diagnosis_of(case.place, beliefs=beliefs)), beliefs)

    return anew


def _row(cases: Sequence[Case], anew: Callable[[Case], Verdict]) -> dict[str, Any]:
    """Return how many verdicts change, by how much confidence does, and how many are right."""
    verdicts = [anew(case) for case in cases]
    judged = [_judged(case.truth, v) for case, v in zip(cases, verdicts, strict=True)]
    changed = [
        (v.status, {frozenset(g) for g in v.sets})
        != (case.said.status, {frozenset(g) for g in case.said.sets})
        for case, v in zip(cases, verdicts, strict=True)
    ]
    drift = [
        abs(v.confidence - case.said.confidence) for case, v in zip(cases, verdicts, strict=True)
    ]
    return {
        'cases': len(cases),
        'verdicts': sum(changed),
        'confidence': max(drift, default=0.0),
        'right': sum(j.right for j in judged),
        'sure_and_wrong': sum(j.confidently_wrong for j in judged),
    }


def _totals(cases: Sequence[Case]) -> dict[str, int]:
    return {
        'cases': len(cases),
        'right': sum(case.judged.right for case in cases),
        'sure_and_wrong': sum(case.judged.confidently_wrong for case in cases),
    }
