# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What arms that were given as URDFs add up to."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from weld_twin_msgs_py.files import markdown

NOTHING = 1e-6
"""Way [m] that is none: programs are written to about a micrometre."""
HALF = 0.5
"""Share of what a seam is off that the true causes must be able to take away for it to count."""
FINE = 1e-5
"""What is left [m] that no arm repeats any better; below it one left-over is as good as another."""
HEADS = (
    'first axis',
    'arms',
    'failed',
    'LIN from PTP at most, mm',
    'files apart, mm',
    'worse',
    'could gain half',
    'of these corrected',
    'before, mm',
    'after',
    'best',
    'corrected: after over best, median',
    '95 of 100',
    'the same above 0.01 mm, median',
    '95 of 100',
)


def counted(cases: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """
    Return what cases add up to.

    Parameters
    ----------
    cases : sequence of dict
        As `urdf_trial.tried` returns them.

    """
    done = [case for case in cases if 'worst_m' in case]
    able = [case for case in done if _best(case) <= HALF * case['worst_m']['before']]
    mended = [case for case in able if case['outcome'] == 'corrected' and not worse(case)]
    told = [case['linear_apart_m'] for case in done if case['linear_apart_m'] is not None]
    signs = Counter(case['signs'] for case in done)
    out: dict[str, Any] = {
        'arms': len(cases),
        'failed': sum('failed' in case for case in cases),
        'undrawn': sum('undrawn' in case for case in cases),
        'linear_apart_m': max(told, default=0.0),
        'files_apart_m': max((case['files_apart_m'] for case in done), default=0.0),
        'worse': sum(map(worse, done)),
        'signs_right': signs[True],
        'signs_wrong': signs[False],
        'able': len(able),
        'corrected': len(mended),
    }
    if able:
        out['worst_m'] = {
            key: float(np.median([case['worst_m'][key] for case in able]))
            for key in ('before', 'after', 'best')
        }
        out['ratio'] = _spread([ratio(case) for case in able])
        out['ratio_of_corrected'] = _spread([ratio(case) for case in mended])
        out['ratio_above_fine'] = _spread([ratio(case, FINE) for case in mended])
    return out


def worse(case: dict[str, Any]) -> bool:
    """Tell whether a seam is farther off than before by more than programs are written to."""
    return bool(case['worst_m']['after'] > case['worst_m']['before'] + NOTHING)


def ratio(case: dict[str, Any], least: float = 1e-9) -> float:
    """Return what is left over the best possible, each at least so much [m]."""
    return float(max(case['worst_m']['after'], least) / max(_best(case), least))


def _best(case: dict[str, Any]) -> float:
    return float(case['worst_m']['best'])


def _spread(values: Sequence[float]) -> dict[str, float]:
    if not values:
        return {'median': float('nan'), 'p95': float('nan')}
    return {'median': float(np.median(values)), 'p95': float(np.percentile(values, 95.0))}


def totals(cases: Sequence[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return what cases add up to by where the first axis points, by maker, and over all."""
    out = {}
    for key in ('kind', 'maker'):
        for name in dict.fromkeys(case[key] for case in cases):
            out[name] = counted([case for case in cases if case[key] == name])
    return {**out, 'all': counted(cases)}


def page(result: dict[str, Any]) -> str:
    """Return the results as tables in Markdown."""
    rows = [_row(name, total) for name, total in result['totals'].items()]
    odd = [
        (str(case['number']), case['kind'], case['maker'], _why(case))
        for case in result['cases']
        if case.get('outcome') != 'corrected'
    ]
    parts = ['## Arms given as URDFs', '', f'Seed {result["seed"]}.', '']
    parts += [markdown.table(HEADS, *rows), '']
    if odd:
        parts += ['## Not corrected', '']
        parts += [markdown.table(('arm', 'first axis', 'maker', 'why'), *odd), '']
    return '\n'.join(parts)


def _why(case: dict[str, Any]) -> str:
    """Return why an arm's program was not corrected, without the line of the program."""
    said = str(case.get('failed') or case.get('undrawn') or case.get('why') or 'nothing was found')
    return said.rpartition('corrected: ')[2]


def _row(name: str, total: dict[str, Any]) -> tuple[str, ...]:
    worst = total.get('worst_m', dict.fromkeys(('before', 'after', 'best'), float('nan')))
    none = _spread([])
    left = [total.get(key, none) for key in ('ratio_of_corrected', 'ratio_above_fine')]
    return (
        name,
        str(total['arms']),
        str(total['failed'] + total['undrawn']),
        f'{1e3 * total["linear_apart_m"]:.1g}',
        f'{1e3 * total["files_apart_m"]:.1g}',
        str(total['worse']),
        str(total['able']),
        str(total['corrected']),
        *(f'{1e3 * worst[key]:.3f}' for key in ('before', 'after', 'best')),
        *(f'{spread[key]:.2f}' for spread in left for key in ('median', 'p95')),
    )
