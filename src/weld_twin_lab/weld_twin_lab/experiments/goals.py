# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What investigated cells add up to."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from weld_twin_nodes.offline.investigation import SAID

from ..study import tabled

Case = dict[str, Any]


def summary(cases: Sequence[Case]) -> dict[str, Any]:
    """Return the measures over all cells."""
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
    """Return the results in Markdown."""
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
