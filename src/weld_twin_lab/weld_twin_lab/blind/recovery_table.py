# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The recovery table: a row for every family, a mark for every arm and size, and the sums."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from .statistics import Estimate, share

Row = Mapping[str, Any]
MARKS = {
    'exact': '●',
    'more': '◐',
    'joint': '○',
    'unknown': '?',
    'none': '-',
    'wrong': 'x',
    'error': '!',
    'not shown': ' ',
}
LEGEND = (
    '● named, alone or in the set that holds it, and nothing else; ◐ named, and something else '
    'besides; ○ the family named, on another joint; ? said to be unknown; - nothing found; '
    'x something else named; ! no verdict; blank: no plausible cause is that large'
)
DASH = '-'


def mark(row: Row) -> str:
    """Return what became of a case, a key of `MARKS`."""
    if row['not_shown']:
        return 'not shown'
    judged = row['judged']
    if row['error']:
        return 'error'
    if judged['named']:
        return 'exact' if judged['set'] == 'exact' else 'more'
    if judged['status'] in ('unknown', 'none'):
        return str(judged['status'])
    return 'joint' if judged['family'] else 'wrong'


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Return shares, errors and costs: over all, by family, by arm and by size."""
    shown = [row for row in rows if not row['not_shown']]
    return {
        'all': _sums(shown),
        'family': _by(shown, lambda row: row['family']),
        'arm': _by(shown, lambda row: row['arm']),
        'size': _by(shown, lambda row: f'{row["size"]:g}'),
    }


def _by(rows: Sequence[Row], key: Callable[[Row], str]) -> dict[str, Any]:
    names = dict.fromkeys(key(row) for row in rows)
    return {name: _sums([row for row in rows if key(row) == name]) for name in names}


def _sums(rows: Sequence[Row]) -> dict[str, Any]:
    judged = [row['judged'] for row in rows]
    z = [value for case in judged for value in case['z']]
    shrinks = [row['shrink'] for row in rows if row['shrink']]
    return {
        'cases': len(rows),
        'family': share([bool(case['family']) for case in judged])._asdict(),
        'joint': share([case['joint'] for case in judged if case['joint'] is not None])._asdict(),
        'exact': share([case['set'] == 'exact' for case in judged])._asdict(),
        'confidently_wrong': sum(case['confidently_wrong'] for case in judged),
        'z_median': _median([abs(value) for value in z]),
        'z_inside': share([abs(value) < 1.96 for value in z])._asdict(),
        'shrink_claimed': _median([item['claimed'] for item in shrinks]),
        'shrink_achieved': _median([item['ratio'] for item in shrinks]),
        'shrink_off': _median([abs(item['claimed'] - item['ratio']) for item in shrinks]),
        'over_floor': _median([item['over_floor'] for item in shrinks]),
        'seconds': _median([row['seconds'] for row in rows]),
        'processor_seconds': _median([row['processor_seconds'] for row in rows]),
        'most_processor_seconds': max((row['processor_seconds'] for row in rows), default=None),
    }


def _median(values: Sequence[float]) -> float | None:
    return float(np.median(values)) if len(values) else None


def table(rows: Sequence[Row], made: Mapping[str, Any]) -> str:
    """Return the whole in Markdown."""
    sums = summary(rows)
    sizes = ', '.join(f'{size:g}' for size in dict.fromkeys(row['size'] for row in rows))
    parts = [
        f'Seed {made["seed"]}, motion {made["motion"]}, engine `{made["engine"][:16]}` of version '
        f'{made["version"]}. Each mark is one case; from left to right the cause is '
        f'{sizes} times the noise. {LEGEND}.',
        '\n'.join(_families(rows, sums['family'])),
        'Family and joint: share of cases that name it, or hold it in a set that cannot be told '
        'apart. z: error of a parameter over its standard error. Shrink: RMS after over RMS '
        'before, as claimed and as achieved on a recording that the diagnosis never saw.',
        '\n'.join(_groups(sums)),
        '\n'.join(_failures(rows)),
    ]
    return '\n\n'.join(part for part in parts if part) + '\n'


def _families(rows: Sequence[Row], sums: Mapping[str, Any]) -> Iterator[str]:
    arms = list(dict.fromkeys(row['arm'] for row in rows))
    heads = [
        'cause',
        *arms,
        'family',
        'joint',
        '\\|z\\|, median',
        'shrink claimed / achieved',
        'processor s',
    ]
    yield from _head(heads)
    for family in dict.fromkeys(row['family'] for row in rows):
        marks = [
            ''.join(
                MARKS[mark(row)] for row in rows if (row['family'], row['arm']) == (family, arm)
            )
            for arm in arms
        ]
        if family in sums:
            yield _line([family, *(f'`{text}`' for text in marks), *_told(sums[family])])


def _told(sums: Mapping[str, Any]) -> list[str]:
    return [
        _count(sums['family']),
        _count(sums['joint']),
        _number(sums['z_median']),
        f'{_number(sums["shrink_claimed"])} / {_number(sums["shrink_achieved"])}',
        _number(sums['processor_seconds'], 1),
    ]


def _groups(sums: Mapping[str, Any]) -> Iterator[str]:
    yield from _head(
        [
            '',
            'cases',
            'family',
            'joint',
            'nothing else named',
            'sure and wrong',
            'z within 1.96',
            'claimed and achieved differ by',
            'over the floor',
            'processor s, median / most',
        ]
    )
    named = {
        'all': sums['all'],
        **sums['arm'],
        **{f'{size} times the noise': value for size, value in sums['size'].items()},
    }
    for name, item in named.items():
        yield _line(
            [
                name,
                str(item['cases']),
                _percent(item['family']),
                _percent(item['joint']),
                _percent(item['exact']),
                str(item['confidently_wrong']),
                _percent(item['z_inside']),
                _number(item['shrink_off'], 3),
                _number(item['over_floor'], 3),
                f'{_number(item["processor_seconds"], 1)} / '
                f'{_number(item["most_processor_seconds"], 1)}',
            ]
        )


def _failures(rows: Sequence[Row]) -> Iterator[str]:
    """Yield the cases whose cause is not named alone."""
    missed = [row for row in rows if mark(row) not in ('exact', 'not shown')]
    if not missed:
        return
    yield f'{len(missed)} cases whose cause is not named, or not alone:\n'
    yield from _head(['', 'cause', 'arm', 'size', 'verdict', 'confidence'])
    for row in missed:
        judged = row['judged']
        said = row['error'] or f'{judged["status"]}: {judged["said"] or DASH}'
        yield _line(
            [
                f'`{MARKS[mark(row)]}`',
                judged['truth'],
                row['arm'],
                f'{row["size"]:g}',
                said,
                f'{judged["confidence"]:.2f}',
            ]
        )


def _head(names: Sequence[str]) -> Iterator[str]:
    yield _line(names)
    yield _line(['---'] * len(names))


def _line(cells: Iterable[str]) -> str:
    return f'| {" | ".join(cells)} |'


def _count(estimate: Mapping[str, Any]) -> str:
    """Return '11 of 12'."""
    found = Estimate(**estimate)
    return DASH if found.value is None else f'{round(found.value * found.cases)} of {found.cases}'


def _percent(estimate: Mapping[str, Any]) -> str:
    """Return a share with its interval."""
    value, low, high = (estimate[key] for key in ('value', 'low', 'high'))
    return (
        DASH
        if value is None
        else (f'{100.0 * value:.1f} % ({100.0 * low:.0f} to {100.0 * high:.0f})')
    )


def _number(value: float | None, places: int = 2) -> str:
    return DASH if value is None else f'{value:.{places}f}'
