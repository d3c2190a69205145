# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The splits and the goals as tables in Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from weld_twin_msgs_py.files import markdown

from .goals import Measure
from .splits import TUNED_ON

REACHED = {True: 'reached', False: '**missed**', None: 'not measured'}
HEADS = (
    'split',
    'stations',
    'frames',
    'geometry',
    'gravity',
    'product',
    'over best (95 %)',
    'outside: frames',
    'product',
    'over frames',
    'flagged',
    'verdict',
)


def page(entries: Sequence[dict[str, Any]], found: Sequence[Measure]) -> str:
    """Return both tables, and that of the servo axis."""
    parts = [goal_table(found), split_table(entries)]
    parts += [axis_table(e) for e in entries if e['kind'] == 'servo_axis']
    return '\n'.join(parts)


def goal_table(measures: Sequence[Measure]) -> str:
    """Return one line per measure."""
    rows = [(m.what, m.goal, m.got, REACHED[m.reached]) for m in measures]
    return markdown.table(('measure', 'goal', 'got', ''), *rows)


def split_table(entries: Sequence[dict[str, Any]]) -> str:
    """Return one line per split: mean errors in mm."""
    return markdown.table(
        HEADS, *[_row(entry) for entry in entries if entry['kind'] != 'servo_axis']
    )


def axis_table(entry: dict[str, Any]) -> str:
    """Return what each model leaves of the servo axis, in µm RMS."""
    rows = [(name, f'{1e6 * rms:.1f}') for name, rms in entry['rms_m'].items()]
    return markdown.table(('model', 'left [µm RMS]'), *rows)


def _row(entry: dict[str, Any]) -> tuple[str, ...]:
    mark = ' *' if entry['robot'] == 'ur5' and entry['kind'] in TUNED_ON else ''
    head = (entry['name'] + mark, str(entry['stations']))
    if entry['traceback']:
        last = entry['traceback'].strip().splitlines()[-1]
        return (*head, *[''] * 9, f'traceback: {last}')
    inside, outside = entry['inside'], entry['outside']
    return (
        *head,
        *[_mm(inside, name) for name in ('frames', 'geometry', 'gravity', 'product')],
        _ratio(inside, 'over_best'),
        _mm(outside, 'frames'),
        _mm(outside, 'product'),
        _ratio(outside, 'over_frames'),
        '' if outside is None or 'flagged' not in outside else f'{100 * outside["flagged"]:.0f} %',
        _verdict(entry),
    )


def _mm(region: dict[str, Any] | None, name: str) -> str:
    if region is None or name not in region['mean_m']:
        return ''
    return f'{1e3 * region["mean_m"][name]:.3f}'


def _ratio(region: dict[str, Any] | None, key: str) -> str:
    if region is None or region.get(key) is None:
        return ''
    found = region[key]
    return f'{found["ratio"]:.2f} ({found["low"]:.2f} to {found["high"]:.2f})'


def _verdict(entry: dict[str, Any]) -> str:
    sure = '' if entry['confidence'] is None else f', {100 * entry["confidence"]:.0f} %'
    names = ', '.join(entry['families']) or 'nothing named'
    return f'{entry["status"]}{sure}: {names}'
