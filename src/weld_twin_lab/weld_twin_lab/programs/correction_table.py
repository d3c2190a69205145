# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What corrected seams add up to, a language at a time and all together."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Sequence
from operator import itemgetter
from typing import Any

import numpy as np

from weld_twin_msgs_py.files import markdown

from ..study import tabled

NOISE = 1e-6
"""Change of a path's accuracy [m] that is none: programs are written to about a micrometre."""
OUTCOMES = ('corrected', 'left', 'refused')


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
    rows = [item for item in result['totals'].items() if item[1]['cases']]
    drawn = [case for case in result['cases'] if 'undrawn' not in case]
    why = Counter(_plain(case['why']) for case in drawn if case['why'])
    return '\n'.join(
        [
            '## Corrected seams, run by the plant',
            '',
            f'Seed {result["seed"]}. AT is the path accuracy of ISO 9283; where no number of',
            'a language is told apart it is the median of its seams.',
            '',
            tabled(LANGUAGES, rows),
            '',
            '## Why seams were left as they were',
            '',
            markdown.table(('why', 'seams'), *((text, str(n)) for text, n in why.most_common())),
            '',
            '## Every seam',
            '',
            tabled(SEAMS, drawn),
            '',
        ]
    )


def _plain(why: str) -> str:
    """Return a reason without its place and numbers."""
    return re.sub(r'\d+\.\d+', '...', why.rpartition(': ')[2])


def _accuracies(at: Callable[[Any], dict[str, float]]) -> dict[str, Callable[[Any], str]]:
    """Return the columns of path accuracies [mm], which `at` finds in a row."""
    keys = {'AT before, mm': 'before', 'after': 'after', 'true causes': 'true'}
    return {
        head: lambda row, key=key: f'{1e3 * at(row)[key]:.3f}'  # type: ignore[misc]
        for head, key in keys.items()
    }


LANGUAGES: dict[str, Callable[[Any], object]] = {
    'language': lambda row: row[0],
    'cases': lambda row: row[1]['cases'],
    'corrected': lambda row: row[1]['corrected'],
    'left': lambda row: row[1]['left'],
    'refused': lambda row: row[1]['refused'],
    **_accuracies(lambda row: row[1]['at_m']),
    'after over true, median': lambda row: f'{row[1]["ratio"]["median"]:.2f}',
    '90 of 100': lambda row: f'{row[1]["ratio"]["p90"]:.2f}',
    'worst': lambda row: f'{row[1]["ratio"]["worst"]:.2f}',
    'before over true, median': lambda row: f'{row[1]["ratio_before"]:.2f}',
    'worse than before': lambda row: row[1]['worse'],
}
"""Columns of the table of languages, each a name and its totals."""
SEAMS: dict[str, Callable[[Any], object]] = {
    'language': itemgetter('language'),
    'robot': itemgetter('robot'),
    'causes': lambda case: ', '.join(
        ' of '.join(filter(None, (c['effect'], c.get('joint')))) for c in case['causes']
    ),
    'seam': itemgetter('seam'),
    'verdict': itemgetter('status'),
    'outcome': lambda case: case['outcome'] + (', worse than before' if worse(case) else ''),
    **_accuracies(itemgetter('at_m')),
    'over true': lambda case: f'{ratio(case):.2f}',
}
"""Columns of the table of seams."""
