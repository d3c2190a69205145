# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Open the seals, check the commitments, hold verdicts against truths; the score as a page."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.diagnosis_model import read_diagnosis

from ..study import tabled
from . import layout, seal
from .judging import Judged, judge
from .measures import Measure, Question, measure_table, measured
from .statistics import calibration_error

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


def score(
    cases: Path,
    truths: Path,
    results: Path,
    *,
    seal_given: str = '',
) -> dict[str, Any]:
    """
    Return the score of verdicts in plain values.

    cases, truths, results: as `make` and `diagnose_cases` wrote them.
    seal_given: the seal as printed before the diagnosis; left out, the one stored holds.

    Raises DataError: a case or truth was changed, or the verdicts are on other cases.
    """
    opened = seal.opened(cases, truths, seal_given)
    about = layout.read(results / layout.VERDICTS)
    if about['seal'] != layout.read(cases / layout.CASES)['seal']:
        raise DataError(f"the verdicts in '{results}' are on other cases than those in '{cases}'")
    verdicts = {verdict['name']: verdict for verdict in about.pop('verdicts')}
    judged = []
    for truth in opened:
        name = truth['name']
        file = results / name / layout.DIAGNOSIS
        judged.append(judge(truth, None if verdicts[name]['error'] else read_diagnosis(file)))
    seed = layout.read(truths / layout.TRUTHS)['seed']
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
