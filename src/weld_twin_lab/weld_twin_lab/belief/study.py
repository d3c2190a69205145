# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Belief learned from some cases, and judged on others."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from weld_twin_core.diagnosis.trust.model import FILE, Trust, trust_from
from weld_twin_nodes.offline.output_directory import write_owned
from weld_twin_nodes.offline.task_pool import Runner, Task

from . import learning
from .goals import goal_measures
from .judged import Case, Example, cases_of, examples_of
from .pictures import reliability_picture, risk_picture
from .rows import seeds_of, slim
from .table import page
from .told import Belief, belief_in, calibration
from .trial import USUAL, tried

RESULT, PAGE = 'results.json', 'belief.md'
RELIABILITY, RISK = 'reliability.svg', 'risk.svg'
LEVELS = ('answer', 'place', 'dependence', 'name')
MIX = (
    'seven arms; free motions, seams and stations, a third of them poor, 15 to 45 s; causes of 0.3 '
    'to 40 times the noise; of 44 cases 16 with one cause, 6 with two, 3 with three, 3 ambiguous '
    'by construction, 4 with none, 6 outside the library and 6 with their family withheld'
)


def rows_of(seed: int, count: int, runner: Runner, mix: str = USUAL) -> list[dict[str, Any]]:
    """
    Return the rows of the first cases of a seed; those in the runner's store are not made anew.

    Parameters
    ----------
    seed, count : int
    runner : Runner
    mix : str
        As `tried` takes it.

    """
    tasks = [Task(tried, (seed, number, mix), f'case {number}') for number in range(count)]
    return [slim(row) for row in runner.run(tasks)]


def fit(rows: Sequence[Mapping[str, Any]], risk: float = learning.RISK) -> dict[str, Any]:
    """
    Return the content of the belief file that some cases teach.

    Parameters
    ----------
    rows : sequence of mappings
    risk : float
        Probability that an answer may be sure and wrong.

    """
    cases = cases_of(rows)
    card = {
        'cases': len(cases),
        'seeds': seeds_of(rows),
        'engines': dict(Counter(str(c.row['engine']) for c in cases)),
        'kinds': dict(Counter(c.judged.kind for c in cases)),
        'mix': MIX,
    }
    return learning.learned(examples_of(cases), card, risk)


def judged(content: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """
    Return what a belief file is worth on cases that it did not learn from.

    Parameters
    ----------
    content : mapping
        Of the belief file.
    rows : sequence of mappings

    """
    trust = trust_from(content)
    cases = cases_of(rows)
    examples = examples_of(cases)
    return {
        'schema': 'weld_twin/belief_results/1',
        'learned_from': dict(content['card']),
        'judged_on': {
            'cases': len(cases),
            'seeds': seeds_of(rows),
            'engines': dict(Counter(str(c.row['engine']) for c in cases)),
            'unsound': [row['name'] for row in rows if row.get('unsound')],
            'failed': [row['name'] for row in rows if row['error']],
        },
        'levels': {level: _both(_of(examples, level), trust) for level in LEVELS},
        'groups': {name: _both(part, trust) for name, part in _groups(cases, examples).items()},
        'goals': [measure.as_dict() for measure in goal_measures(cases, trust)],
        'wrong_and_sure': [_in_words(case) for case in cases if _sure_wrong(case, trust)],
    }


def _of(examples: Sequence[Example], level: str) -> list[Example]:
    return [e for e in examples if e.level.startswith(f'{level} ')]


def _groups(cases: Sequence[Case], examples: Sequence[Example]) -> dict[str, list[Example]]:
    """Return the answers as a whole by whether the library holds the causes, and by status."""
    known = {str(c.row['name']) for c in cases if c.judged.in_library or c.judged.kind == 'none'}
    whole = _of(examples, 'answer')
    return {
        'in the library, or none': [e for e in whole if e.case in known],
        'withheld or outside': [e for e in whole if e.case not in known],
        'named': [e for e in whole if e.level == 'answer named'],
        'unknown': [e for e in whole if e.level == 'answer unknown'],
        'none': [e for e in whole if e.level == 'answer none'],
    }


def _both(examples: Sequence[Example], trust: Trust) -> dict[str, Any]:
    belief = belief_in(examples, trust)
    return {
        'statements': len(examples),
        'right': int(belief.right.sum()),
        'before': calibration(belief, belief.before) if len(examples) else None,
        'after': calibration(belief, belief.after) if len(examples) else None,
    }


def _sure_wrong(case: Case, trust: Trust) -> bool:
    belief = belief_in([e for e in examples_of([case]) if e.level.startswith('answer ')], trust)
    return bool((belief.sure & ~belief.right).any())


def _in_words(case: Case) -> dict[str, Any]:
    told = case.judged
    return {
        'case': case.row['name'],
        'kind': told.kind,
        'robot': told.robot,
        'motion': f'{told.motion} {case.row["poor"]}'.strip(),
        'truth': told.truth,
        'sizes': list(case.row['truth']['ratios']),
        'said': f'{told.status} {told.said}'.strip(),
    }


def write(out: Path, content: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> str:
    """
    Write the belief file, what it is worth, the page and its pictures; return the page.

    Parameters
    ----------
    out : Path
    content : mapping
        Of the belief file.
    rows : sequence of mappings
        Cases that it did not learn from.

    """
    result = judged(content, rows)
    whole: Belief = belief_in(_of(examples_of(cases_of(rows)), 'answer'), trust_from(content))
    text = page(result)
    for name, body in (
        (FILE, json.dumps(content, indent=1) + '\n'),
        (RESULT, json.dumps(result, indent=1) + '\n'),
        (PAGE, text),
        (RELIABILITY, reliability_picture(whole)),
        (RISK, risk_picture(whole)),
    ):
        write_owned(out / name, body)
    return text
