# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Open the seals, check the commitments, hold verdicts against truths; the score as a page."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from weld_twin_core.diagnosis.result import NAMING
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.diagnosis_model import read_diagnosis

from ..study import tabled
from . import seal
from .cause_sizes import Site
from .measures import Measure, Question, calibration_error, measure_table, measured

CONFIDENT = 0.8
"""Probability above which what says no more of itself counts as sure: older answers, other methods."""
IN_LIBRARY = frozenset({'single', 'double', 'triple', 'ambiguous'})
NOT_IN_LIBRARY = frozenset({'outside', 'withheld'})
NAMED = {'station_step': 'instrument_knock'}
"""What the twin calls a cause that the plant calls otherwise."""


@dataclass(frozen=True)
class Judged:
    """What a verdict was worth."""

    name: str
    kind: str
    robot: str
    motion: str
    """Of the case."""
    truth: str
    said: str
    """Both in words."""
    status: str
    """Of the verdict, or 'error'."""
    confidence: float
    sure: bool
    stratum: float
    """Effect RMS over noise, of the weakest cause."""
    named: bool
    """Whether every cause at work is in a set of its own."""
    right: bool
    """What the confidence is about: the set is exact, or nothing was to be found and nothing was
    said, or the library lacks the cause and the verdict is 'unknown'."""

    @property
    def confidently_wrong(self) -> bool:
        """Return whether it names what is wrong, or denies what is there, and is sure of it."""
        return self.sure and not self.right and self.status != 'unknown'

    def as_dict(self) -> dict[str, Any]:
        return {**asdict(self), 'confidently_wrong': self.confidently_wrong}


def judge(truth: Mapping[str, Any], diagnosis: Mapping[str, Any] | None) -> Judged:
    """Return what a diagnosis, or its failure to come about, was worth."""
    verdict = diagnosis['verdict'] if diagnosis else {}
    status = str(verdict.get('status', 'error'))
    groups = [
        {(item['effect'], item['joint']) for item in group}
        for group in verdict.get('indistinguishable', ())
    ]
    answers = answers_of(truth)
    answer = min(answers, key=lambda at: (-_share(at, groups), abs(len(groups) - len(at))))
    matched = _matched(answer, groups)
    whole = matched == len(answer)
    kind = str(truth['kind'])
    exact = whole and len(groups) == len(answer)
    return Judged(
        truth['name'],
        kind,
        truth['robot'],
        truth['motion'],
        _in_words(truth['sites']),
        _said(groups),
        status,
        float(verdict.get('confidence') or 0.0),
        is_sure(verdict),
        float(min(truth['ratios'], default=0.0)),
        whole and bool(answer) and status != 'error',
        _right(kind, status, exact),
    )


def is_sure(verdict: Mapping[str, Any]) -> bool:
    """
    Return whether an answer is reported as sure.

    verdict: as diagnosis.json has it; the first schema tells only a confidence, and 0.8 at the
    most of what is not sure.
    """
    sure = verdict.get('sure')
    return float(verdict.get('confidence') or 0.0) > CONFIDENT if sure is None else bool(sure)


def _sites(items: Iterable[Sequence[Any]]) -> list[Site]:
    return [(NAMED.get(str(item[0]), str(item[0])), item[1]) for item in items]


def _matched(answer: Sequence[Site], groups: Sequence[set[Site]]) -> int:
    """Return how many causes have a set of their own that holds them."""
    if not answer or not groups:
        return 0
    contained = np.array([[at in group for group in groups] for at in answer], dtype=float)
    return int(contained[linear_sum_assignment(-contained)].sum())


def _share(answer: Sequence[Site], groups: Sequence[set[Site]]) -> float:
    return _matched(answer, groups) / max(len(answer), 1)


def _right(kind: str, status: str, exact: bool) -> bool:
    if kind == 'none':
        return status == 'none'
    if kind in NOT_IN_LIBRARY:
        # What gave way at an instant may be dated, and is then named; so may be what no motion
        # tells from the cause, in a set with it.
        return status == 'unknown' or (exact and status in NAMING)
    return exact and status in NAMING


def answers_of(truth: Mapping[str, Any]) -> list[list[Site]]:
    """Return every list of sites that is as right as a truth, by the library's names."""
    return [_sites(answer) for answer in (truth['sites'], *truth['alike'])]


def _in_words(sites: Iterable[Sequence[Any]]) -> str:
    return ' + '.join(' of '.join(filter(None, at)) for at in sites) or 'nothing'


def _said(groups: Sequence[set[Site]]) -> str:
    listed = (sorted(group, key=str) for group in groups)
    return ' + '.join(' or '.join(_in_words([at]) for at in group) for group in listed)


MIB = 1 << 20
"""Bytes."""
KINDS = {
    'single': 'one cause',
    'double': 'two causes',
    'triple': 'three causes',
    'ambiguous': 'ambiguous by construction',
    'none': 'no cause',
    'outside': 'cause outside the library',
    'withheld': 'family withheld',
}
"""Kinds of cases in words."""


def _is(kind: str, case: Judged) -> bool:
    return case.kind == kind


QUESTIONS = (
    *(
        Question(kind, f'{words}: right', partial(_is, kind), attrgetter('right'))
        for kind, words in KINDS.items()
    ),
    Question(
        'confident_wrong',
        'sure and wrong',
        lambda case: True,
        attrgetter('confidently_wrong'),
        0.01,
        False,
    ),
)
"""What verdicts are measured by."""


def score(cases: Path, truths: Path, results: Path, *, seal_given: str = '') -> dict[str, Any]:
    """
    Return the score of verdicts in plain values.

    cases, truths, results: as `make` and `diagnose_cases` wrote them.
    seal_given: the seal as printed before the diagnosis; left out, the one stored holds.

    Raises DataError: a case or truth was changed, or the verdicts are on other cases.
    """
    opened = seal.opened(cases, truths, seal_given)
    about = seal.read(results / seal.VERDICTS)
    if about['seal'] != seal.read(cases / seal.CASES)['seal']:
        raise DataError(f"the verdicts in '{results}' are on other cases than those in '{cases}'")
    verdicts = {verdict['name']: verdict for verdict in about.pop('verdicts')}
    judged = []
    for truth in opened:
        name = truth['name']
        file = results / name / seal.DIAGNOSIS
        judged.append(judge(truth, None if verdicts[name]['error'] else read_diagnosis(file)))
    seed = seal.read(truths / seal.TRUTHS)['seed']
    return {
        'made': {**about, 'seed': seed},
        'count': len(judged),
        'measures': [measure.as_dict() for measure in measures(judged)],
        'costs': _costs(list(verdicts.values())),
        'errors': {name: v['error'] for name, v in verdicts.items() if v['error']},
        'cases': [case.as_dict() for case in judged],
    }


def measures(cases: Sequence[Judged]) -> list[Measure]:
    """Return how often which kind of case was answered rightly, and what confidence is worth."""
    answered = [case for case in cases if case.status != 'error']
    error = calibration_error([c.confidence for c in answered], [c.right for c in answered])
    return [
        *measured(QUESTIONS, cases),
        Measure('ece', 'expected calibration error', error, 0.03, False),
    ]


def _costs(verdicts: list[dict[str, Any]]) -> dict[str, float]:
    seconds = [verdict['seconds'] for verdict in verdicts]
    memory = [verdict['memory_bytes'] / MIB for verdict in verdicts]
    return {
        'median_seconds': float(np.median(seconds)),
        'most_seconds': float(np.max(seconds)),
        'median_memory_mib': float(np.median(memory)),
        'most_memory_mib': float(np.max(memory)),
    }


def page(score: Mapping[str, Any]) -> str:
    """Return measures, cases that were missed, and what a diagnosis costs."""
    made, costs, count = score['made'], score['costs'], score['count']
    seen = 'could be read' if made['truths_readable'] else 'could not be read'
    missed = [case for case in score['cases'] if not case['right']]
    columns: dict[str, Callable[[Mapping[str, Any]], str]] = {
        'case': lambda case: case['name'],
        'kind': lambda case: f'{case["kind"]}, {case["robot"]}, {case["motion"]}',
        'truth (RMS over noise)': lambda case: f'{case["truth"]} ({case["stratum"]:.1f})',
        'verdict': lambda case: f'{case["status"]}: {case["said"] or "-"}',
        'confidence': lambda case: f'{case["confidence"]:.2f}',
        'why there is none': lambda case: score['errors'].get(case['name'], ''),
    }
    return '\n'.join(
        [
            f'# {count - len(missed)} of {count} cases answered rightly\n',
            f'Seed {made["seed"]}, seal {made["seal"]}, engine {made["engine"][:16]} of version '
            f'{made["version"]}. Truths {seen} from where the cases were diagnosed.\n',
            measure_table(score['measures']),
            f'A diagnosis took {costs["median_seconds"]:.1f} s in the median, '
            f'{costs["most_seconds"]:.1f} s at most, and {costs["most_memory_mib"]:.0f} MiB.\n',
            *([tabled(columns, missed)] if missed else []),
        ]
    )
