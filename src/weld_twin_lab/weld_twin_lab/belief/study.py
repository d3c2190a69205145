# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The calibration learned from some cases, and judged on others."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from weld_twin_core.arrays import Array
from weld_twin_nodes.offline.task_pool import Runner, Task

from ..blind.judging import NOT_IN_LIBRARY
from ..blind.statistics import brier, calibration_error, share
from . import learning, terms
from .bound import upper_limit
from .goals import goal_measures
from .judged import Example, examples_of, kept
from .logistic import log_loss
from .mix import USUAL
from .oracle import certainty
from .rows import seeds_of
from .trial import tried

COVERAGE = 0.7
"""Share of the statements, the surest first, at which the risk is quoted."""
MIX = (
    'half of them cells with one to six causes equally often, of a fifth of which a family is taken '
    'out; half as follows: seven arms; free motions, seams and stations, a third of them poor, 15 to '
    '45 s; causes of 0.3 to 40 times the noise; of 44 cases 16 with one cause, 6 with two, 3 with '
    'three, 3 ambiguous by construction, 4 with none, 6 outside the library, 6 with their family '
    'withheld'
)


def rows_of(seed: int, count: int, runner: Runner, mix: str = USUAL) -> list[dict[str, Any]]:
    """
    Return the rows of the first cases of a seed; those in the runner's store are not made anew.

    mix: as `tried` takes it.
    """
    tasks = [Task(tried, (seed, number, mix), f'case {number}') for number in range(count)]
    return [{'mix': mix, **kept(row)} for row in runner.run(tasks)]


def with_oracle(rows: Sequence[dict[str, Any]], runner: Runner) -> list[dict[str, Any]]:
    """
    Return rows with what an oracle is sure of, where it is asked: `oracle.certainty`.

    rows: as `rows_of` gives them.
    """
    cases = [(*map(int, str(row['name']).split('/')), str(row['mix'])) for row in rows]
    tasks = [Task(certainty, case, f'oracle on case {case[1]}') for case in cases]
    return [{**row, 'oracle': p} for row, p in zip(rows, runner.run(tasks), strict=True)]


def fit(rows: Sequence[Mapping[str, Any]], risk: float = terms.RISK) -> dict[str, Any]:
    """
    Return the content of the file of weights that some cases teach.

    rows: as `judged.kept` gives them.
    risk: probability that an answer may be sure and wrong.
    """
    own = [row for row in rows if row.get('examples')]
    card = {
        'cases': len(own),
        'seeds': seeds_of(own),
        'mixes': dict(Counter(str(row['mix']) for row in own)),
        'mix': MIX,
    }
    return learning.learned(examples_of(own), card, risk)


def judged(
    content: Mapping[str, Any], rows: Sequence[Mapping[str, Any]], examples: Sequence[Example]
) -> dict[str, Any]:
    """
    Return what answers were worth on cases that nothing was learned from.

    content: of the file of weights that they were reported by.
    rows: as `judged.kept` gives them; none where the cases learned from are judged by weights that
    had not seen them.
    examples: what was reported.
    """
    own = [row for row in rows if row.get('examples')]
    foreign = {str(row['name']) for row in own if row['kind'] in NOT_IN_LIBRARY}
    whole = _answers(examples)
    groups = {
        **{kind: [e for e in examples if e.kind == kind] for kind in content['statements']},
        'answers as a whole': whole,
        'the same, in the library or none': [e for e in whole if own and e.case not in foreign],
        'the same, withheld or outside': [e for e in whole if e.case in foreign],
        'causes': [e for e in examples if e.kind in learning.CAUSES],
    }
    return {
        'schema': 'weld_twin/belief_results/2',
        'learned_from': {**content['card'], 'weights': learning.count_of(content)},
        'judged_on': {
            'cases': len(own),
            'seeds': seeds_of(own),
            'mixes': dict(Counter(str(row['mix']) for row in own)),
            'unsound': [row['name'] for row in rows if row.get('unsound')],
            'failed': [row['name'] for row in rows if row['error']],
        },
        'statements': {name: worth(part) for name, part in groups.items() if part},
        'goals': [measure.as_dict() for measure in goal_measures(own)] if own else [],
        'wrong_and_sure': [_in_words(row) for row in own if row['sure'] and not row['right']],
    }


def _answers(examples: Sequence[Example]) -> list[Example]:
    return [e for e in examples if e.kind.startswith('answer')]


def worth(examples: Sequence[Example]) -> dict[str, Any]:
    """Return how far what is told of some statements can be trusted."""
    reported, right = probabilities_of(examples)
    sure = [e.sure for e in examples]
    wrong = sum(e.sure and not e.right for e in examples)
    return {
        'statements': len(examples),
        'right': int(right.sum()),
        'log_loss': log_loss(reported, right, np.ones(right.size)),
        'ece': calibration_error(list(reported), list(map(bool, right)))._asdict(),
        'brier': brier(list(reported), list(map(bool, right)))._asdict(),
        'sure': share(sure)._asdict(),
        'sure_and_wrong': wrong,
        'sure_and_wrong_most_95': upper_limit(wrong, len(examples), 0.05),
        'wrong_at_70': _risk_at(reported, right),
    }


def probabilities_of(examples: Sequence[Example]) -> tuple[Array, NDArray[np.bool_]]:
    """Return what was told of some statements, and which were right."""
    return np.array([e.reported for e in examples]), np.array([e.right for e in examples], bool)


def _risk_at(reported: Array, right: NDArray[np.bool_]) -> float:
    """Return the share that is wrong among the surest."""
    first = np.argsort(-reported, kind='stable')[: max(round(COVERAGE * reported.size), 1)]
    return float((~right[first]).mean())


def _in_words(row: Mapping[str, Any]) -> dict[str, Any]:
    own = {key: row[key] for key in ('name', 'kind', 'robot', 'motion', 'truth', 'sizes')}
    return {**own, 'said': f'{row["status"]} {row["said"]}'.strip()}
