# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What corrected seams add up to, a language at a time and all together."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from weld_twin_msgs_py.files import markdown

NOISE = 1e-6
"""Change of a path's accuracy [m] that is none: programs are written to about a micrometre."""
OUTCOMES = ('corrected', 'left', 'refused')
HEADS = (
    'language',
    'cases',
    'corrected',
    'left',
    'refused',
    'AT before, mm',
    'after',
    'true causes',
    'after over true, median',
    '90 of 100',
    'worst',
    'before over true, median',
    'worse than before',
)
"""Heads of the table a language."""
SEAM_HEADS = (
    'language',
    'robot',
    'causes',
    'seam',
    'verdict',
    'outcome',
    'AT before, mm',
    'after',
    'true causes',
    'over true',
)
"""Heads of the table of seams."""


def worse(entry: dict[str, Any]) -> bool:
    """Tell whether a program's path is worse than before by more than programs are written to."""
    at = entry['at_m']
    return bool(at['after'] > at['before'] + NOISE)


def ratio(entry: dict[str, Any], what: str = 'after') -> float:
    """Return an accuracy over that with the true causes; a seam left as it was is before."""
    at = entry['at_m']
    return float(at[what] / at['true'])


def counted(cases: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """
    Return what cases add up to.

    cases: as `corrected_seam` returns them; those that could not be drawn are told apart.
    """
    drawn = [case for case in cases if 'undrawn' not in case]
    outcomes = Counter(case['outcome'] for case in drawn)
    out: dict[str, Any] = {'cases': len(drawn), 'undrawn': len(cases) - len(drawn)}
    out |= {name: outcomes[name] for name in OUTCOMES}
    out['worse'] = sum(worse(case) for case in drawn)
    if drawn:
        ratios = [ratio(case) for case in drawn]
        corrected = [ratio(case) for case in drawn if case['outcome'] == 'corrected']
        out |= {
            'at_m': {
                name: float(np.median([case['at_m'][name] for case in drawn]))
                for name in ('before', 'after', 'true')
            },
            'ratio': _spread(ratios),
            'ratio_of_corrected': _spread(corrected) if corrected else None,
            'ratio_before': float(np.median([ratio(case, 'before') for case in drawn])),
        }
    return out


def _spread(values: Sequence[float]) -> dict[str, float]:
    return {
        'median': float(np.median(values)),
        'p90': float(np.percentile(values, 90.0)),
        'worst': float(max(values)),
    }


def totals(cases: Sequence[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return what cases add up to by language, and over all."""
    languages = list(dict.fromkeys(case['language'] for case in cases))
    out = {one: counted([c for c in cases if c['language'] == one]) for one in languages}
    return {**out, 'all': counted(cases)}


def page(result: dict[str, Any]) -> str:
    """Return the results as tables in Markdown."""
    rows = [_row(name, total) for name, total in result['totals'].items() if total['cases']]
    drawn = [case for case in result['cases'] if 'undrawn' not in case]
    why = Counter(_plain(case['why']) for case in drawn if case['why'])
    return '\n'.join(
        [
            '## Corrected seams, run by the plant',
            '',
            f'Seed {result["seed"]}. AT is the path accuracy of ISO 9283; where no number of',
            'a language is told apart it is the median of its seams.',
            '',
            markdown.table(HEADS, *rows),
            '',
            '## Why seams were left as they were',
            '',
            markdown.table(('why', 'seams'), *((text, str(n)) for text, n in why.most_common())),
            '',
            '## Every seam',
            '',
            markdown.table(SEAM_HEADS, *(_seam_row(case) for case in drawn)),
            '',
        ]
    )


def _row(name: str, total: dict[str, Any]) -> tuple[str, ...]:
    at, spread = total['at_m'], total['ratio']
    return (
        name,
        str(total['cases']),
        *(str(total[outcome]) for outcome in OUTCOMES),
        *(f'{1e3 * at[key]:.3f}' for key in ('before', 'after', 'true')),
        *(f'{spread[key]:.2f}' for key in ('median', 'p90', 'worst')),
        f'{total["ratio_before"]:.2f}',
        str(total['worse']),
    )


def _plain(why: str) -> str:
    """Return a reason without its place and numbers."""
    return re.sub(r'\d+\.\d+', '...', why.rpartition(': ')[2])


def _seam_row(case: dict[str, Any]) -> tuple[str, ...]:
    causes = ', '.join(
        ' of '.join(filter(None, (c['effect'], c.get('joint')))) for c in case['causes']
    )
    outcome = case['outcome'] + (', worse than before' if worse(case) else '')
    return (
        case['language'],
        case['robot'],
        causes,
        case['seam'],
        case['status'],
        outcome,
        *(f'{1e3 * case["at_m"][key]:.3f}' for key in ('before', 'after', 'true')),
        f'{ratio(case):.2f}',
    )
