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
PROMISED_HEADS = (
    'of',
    'seams',
    'RMS in its 90 % interval',
    'within what was 95 % sure',
    'width, mm',
)
"""Heads of the table of promises."""
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

    Parameters
    ----------
    cases : sequence of dict
        As `corrected_seam` returns them; those that could not be drawn are told apart.

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


def kept(cases: Sequence[dict[str, Any]]) -> dict[str, dict[str, float]]:
    """
    Return how often promises of before and after hold, and how wide they are.

    Parameters
    ----------
    cases : sequence of dict
        As `corrected_seam` returns them; those without a promise do not count.

    Returns
    -------
    dict
        For 'before' and 'after': ``seams``; ``held``, the share whose RMS lies in its 90 % interval;
        ``within``, the share that stays within what was 95 % sure; ``width_m``, median of the interval.

    """
    out = {}
    for name in ('before', 'after'):
        mine = [(c, c['promised'][name]) for c in cases if name in (c.get('promised') or {})]
        if mine:
            ends = np.array([p['ci90_m'] for _, p in mine])
            rms = np.array([c['rms_m'][name] for c, _ in mine])
            at = np.array([c['at_m'][name] for c, _ in mine])
            sure = np.array([p['sure_within_m'] for _, p in mine])
            out[name] = {
                'seams': float(len(mine)),
                'held': float(((ends[:, 0] <= rms) & (rms <= ends[:, 1])).mean()),
                'within': float((at <= sure).mean()),
                'width_m': float(np.median(ends[:, 1] - ends[:, 0])),
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
            '## Promises',
            '',
            markdown.table(PROMISED_HEADS, *map(_promised_row, kept(drawn).items())),
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


def _promised_row(named: tuple[str, dict[str, float]]) -> tuple[str, ...]:
    name, told = named
    return (
        name,
        f'{told["seams"]:.0f}',
        f'{told["held"]:.0%}',
        f'{told["within"]:.0%}',
        f'{1e3 * told["width_m"]:.3f}',
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
