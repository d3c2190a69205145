# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What investigated cells add up to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from weld_twin_msgs_py.files import markdown
from weld_twin_nodes.offline.investigation import SAID

WAYS = ('loop', 'random', 'rich', 'd_optimal')
"""The loop, and what it is held against."""
SECONDS_A_POSE = 15.0
"""A moving arm counts one pose for as long as a station takes."""
Case = dict[str, Any]


def summary(cases: Sequence[Case]) -> dict[str, Any]:
    """Return the measures over all cells."""
    if not cases:
        return {'cells': 0}
    rounds = [step for case in cases for step in case['rounds']]
    certain = [case for case in cases if _good(case, 'loop')]
    compared = [case for case in cases if 'd_optimal' in case]
    both = [c for c in certain if c.get('d_optimal_stations') is not None]
    return {
        'cells': len(cases),
        'compared': len(compared),
        'first': {
            s: _count(cases, lambda c, s=s: c['first']['status'] == s) for s in _statuses(cases)
        },
        'right_and_sure': {way: _count(cases, lambda c, w=way: _good(c, w)) for way in WAYS},
        'right': {way: _count(cases, lambda c, w=way: w in c and c[w]['right']) for way in WAYS},
        'sure_and_wrong': {way: _count(cases, lambda c, w=way: _misled(c, w)) for way in WAYS},
        'loop_where_compared': _count(compared, lambda c: _good(c, 'loop')),
        'minutes_to_certainty': _median([c['minutes'] for c in certain]),
        'poses': _median([poses(c) for c in both]),
        'd_optimal_poses': _median([c['d_optimal_stations'] for c in both]),
        'd_optimal_never': _count(
            certain, lambda c: 'd_optimal' in c and c['d_optimal_stations'] is None
        ),
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


def poses(case: Case) -> float:
    """Return how many poses the loop took; of a path, one for as long as a station takes."""
    return float(60.0 * case['minutes'] / SECONDS_A_POSE)


def _good(case: Case, way: str) -> bool:
    return way in case and bool(case[way]['right'] and case[way]['sure'])


def _misled(case: Case, way: str) -> bool:
    return way in case and bool(case[way]['sure'] and not case[way]['right'])


def _statuses(cases: Sequence[Case]) -> list[str]:
    return sorted({str(case['first']['status']) for case in cases})


def _count(cases: Sequence[Case], told: Callable[..., bool]) -> int:
    return sum(bool(told(case)) for case in cases)


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if values else None


def page(result: dict[str, Any]) -> str:
    """Return the results in Markdown."""
    told, cases = result['summary'], result['cases']
    if not cases:
        return 'No cell was left open.\n'
    ways = [
        (
            way,
            *(
                f'{told[key][way]} of {told["cells" if way == "loop" else "compared"]}'
                for key in ('right_and_sure', 'right', 'sure_and_wrong')
            ),
        )
        for way in WAYS
    ]
    heads = (
        'cell',
        'robot',
        'first motion',
        'causes',
        'first',
        'asked',
        'loop',
        'ended',
        *WAYS[1:],
    )
    return '\n'.join(
        [
            markdown.table(('way', 'right and sure', 'right', 'sure and wrong'), *ways),
            '',
            *(f'- {key}: {told[key]}' for key in told if not isinstance(told[key], dict)),
            '',
            markdown.table(heads, *(_row(case) for case in cases)),
            '',
        ]
    )


def _row(case: Case) -> tuple[str, ...]:
    truth = case['truth']
    return (
        str(case['name']),
        str(truth['robot']),
        f'{truth["motion"]}, {case["poor"]}',
        ' + '.join(' of '.join(filter(None, site)) for site in truth['sites']),
        _told(case['first']),
        ', '.join(f'{s["kind"]} {s["robot_minutes"]:.1f} min' for s in case['rounds']),
        _told(case['loop']),
        str(case['end']),
        *(_told(case[way]) if way in case else '' for way in WAYS[1:]),
    )


def _told(found: dict[str, Any]) -> str:
    right = 'right' if found['right'] else 'wrong'
    sure = 'sure' if found['sure'] else 'open'
    return f'{found["status"]}, {right}, {sure}'
