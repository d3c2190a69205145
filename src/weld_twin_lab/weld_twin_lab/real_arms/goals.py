# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the splits together must show, what they do show, and both as tables in Markdown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from weld_twin_msgs_py.files import markdown

from ..study import tabled
from .splits import TUNED_ON

Entry = dict[str, Any]
MANY = 120
"""Stations from which on more is asked of the diagnosis."""
WORSE = 1.05
"""Mean error over another from which on it counts as worse."""
REACHED = {True: 'reached', False: '**missed**', None: 'not measured'}


class Measure(NamedTuple):
    """One line of the table: what, the goal in words, what was got, and whether it is reached."""

    what: str
    goal: str
    got: str
    reached: bool | None
    blame: tuple[str, ...] = ()


def measures(entries: Sequence[Entry]) -> list[Measure]:
    """Return every measure over the splits, the servo axis left out."""
    splits = [e for e in entries if e['kind'] != 'servo_axis']
    return [
        _never_much_worse(splits),
        _median(splits, MANY, 0.85),
        _median(splits, 0, 1.0),
        _none(
            'splits whose stations that are not flagged are worse than frames only by 5 % or more',
            splits,
            lambda e: any(
                _of(e, region, 'unflagged_over_frames', {'ratio': 0.0})['ratio'] >= WORSE
                for region in ('inside', 'outside')
            ),
        ),
        *_outside(splits),
        _flagged(splits),
        _none('sound splits called unsound', splits, lambda e: e.get('status') == 'unsound'),
        _interval(splits),
        _stable(splits),
        _none(
            'named parameters outside their plausible range',
            splits,
            lambda e: len(e.get('beyond') or ()),
        ),
        _none(
            'identified with nothing named',
            splits,
            lambda e: e.get('status') == 'identified' and not e.get('families'),
        ),
        _none(
            'tracebacks on the splits',
            entries,
            lambda e: bool(
                e.get('traceback') or any(h.get('traceback') for h in e.get('halves', ()))
            ),
        ),
    ]


def _of(entry: Entry, region: str, key: str, otherwise: Any = None) -> Any:
    value = (entry.get(region) or {}).get(key)
    return otherwise if value is None else value


def _none(what: str, entries: Sequence[Entry], count: Callable[[Entry], int]) -> Measure:
    """Return how much there is of what must not be."""
    counts = {e['name']: int(count(e)) for e in entries}
    bad = tuple(name for name, number in counts.items() if number)
    return Measure(what, '0', str(sum(counts.values())), not bad, bad)


def _regions(entries: Sequence[Entry], region: str, key: str) -> list[tuple[Entry, Any]]:
    rows = [(e, _of(e, region, key)) for e in entries]
    return [(e, value) for e, value in rows if value is not None]


def _never_much_worse(entries: Sequence[Entry]) -> Measure:
    pairs = _regions(entries, 'inside', 'over_best')
    bad = tuple(e['name'] for e, r in pairs if r['ratio'] > WORSE and r['low'] > 1.0)
    worst = max((r['ratio'] for _, r in pairs), default=float('nan'))
    return Measure(
        'product over the best of the three plain fits, mean error, inside',
        '<= 1.05 on every split, or its 95 % interval reaches 1',
        f'{len(pairs) - len(bad)} of {len(pairs)}; worst {worst:.2f}',
        not bad,
        bad,
    )


def _median(entries: Sequence[Entry], least: int, goal: float) -> Measure:
    pairs = [
        r['ratio'] for e, r in _regions(entries, 'inside', 'over_best') if e['stations'] >= least
    ]
    which = f'splits of {least} stations or more' if least else 'all splits'
    middle = float(np.median(pairs)) if pairs else float('nan')
    return _below(f'the same, median over {which}', middle, goal)


def _outside(entries: Sequence[Entry]) -> list[Measure]:
    pairs = [(e, r['ratio']) for e, r in _regions(entries, 'outside', 'over_frames')]
    ratios = [ratio for _, ratio in pairs] or [float('nan')]
    bad = tuple(e['name'] for e, ratio in pairs if ratio > WORSE)
    what = 'mean error outside over frames only'
    return [
        _below(f'{what}, worst', max(ratios), WORSE, bad),
        _below(f'{what}, median', float(np.median(ratios)), 0.8),
    ]


def _flagged(entries: Sequence[Entry]) -> Measure:
    pairs = _regions(entries, 'inside', 'flagged')
    count = sum(e['inside']['stations'] for e, _ in pairs)
    share = sum(e['inside']['stations'] * v for e, v in pairs) / max(count, 1)
    return Measure(
        'stations inside that are flagged', '<= 5 %', f'{100 * share:.1f} %', share <= 0.05
    )


def _interval(entries: Sequence[Entry]) -> Measure:
    pairs = [e for e, _ in _regions(entries, 'inside', 'over_frames') if e.get('claimed')]
    bad = []
    for e in pairs:
        rms, (low, high) = e['inside']['rms_m'], e['claimed']['ci95']
        if not low <= rms['product'] / rms['frames'] <= high:
            bad.append(e['name'])
    return _most('95 % interval of the shrink holds', '>= 90 % of splits', len(pairs), bad, 0.0)


def _stable(entries: Sequence[Entry]) -> Measure:
    """Return how often odd and even halves agree on status and families."""
    by_name = {e['name']: e for e in entries}
    pairs = [(e['name'], *e['halves']) for e in entries if e.get('halves')]
    for e in entries:
        if e['kind'] == 'odd' and f'{e["robot"]}_even' in by_name:
            pairs.append((f'{e["robot"]} odd/even', e, by_name[f'{e["robot"]}_even']))
    bad = [
        name
        for name, one, other in pairs
        if any(one.get(key) != other.get(key) for key in ('status', 'families'))
    ]
    what = 'same status and families on odd and even halves'
    return _most(what, '>= 90 %', len(pairs), bad, 1.0)


def _most(what: str, goal: str, count: int, bad: Sequence[str], of_none: float) -> Measure:
    """Return whether nine of ten are good; ``of_none`` is their share where there are none."""
    good = count - len(bad)
    share = good / count if count else of_none
    return Measure(what, goal, f'{good} of {count}', share >= 0.9, tuple(bad))


def _below(what: str, value: float, goal: float, blame: tuple[str, ...] = ()) -> Measure:
    """Return whether a value is low enough, None where nothing was measured."""
    reached = None if np.isnan(value) else value <= goal
    return Measure(what, f'<= {goal}', f'{value:.2f}', reached, blame)


def page(entries: Sequence[Entry], measured: Sequence[Measure]) -> str:
    """Return both tables, and that of the servo axis."""
    parts = [goal_table(measured), split_table(entries)]
    parts += [axis_table(e) for e in entries if e['kind'] == 'servo_axis']
    return '\n'.join(parts)


def goal_table(measures: Sequence[Measure]) -> str:
    """Return one line per measure."""
    rows = [(m.what, m.goal, m.got, REACHED[m.reached]) for m in measures]
    return markdown.table(('measure', 'goal', 'got', ''), *rows)


def split_table(entries: Sequence[Entry]) -> str:
    """Return one line per split: mean errors in mm."""
    return tabled(SPLITS, [entry for entry in entries if entry['kind'] != 'servo_axis'])


def axis_table(entry: Entry) -> str:
    """Return what each model leaves of the servo axis, in µm RMS."""
    rows = [(name, f'{1e6 * rms:.1f}') for name, rms in entry['rms_m'].items()]
    return markdown.table(('model', 'left [µm RMS]'), *rows)


def _name(entry: Entry) -> str:
    mark = ' *' if entry['robot'] == 'ur5' and entry['kind'] in TUNED_ON else ''
    return str(entry['name'] + mark)


def _mm(region: str, name: str) -> Callable[[Entry], str]:
    """Return what tells the mean error of a model in a region [mm]."""

    def in_words(entry: Entry) -> str:
        mean = _of(entry, region, 'mean_m', {}).get(name)
        return '' if mean is None else f'{1e3 * mean:.3f}'

    return in_words


def _ratio(region: str, key: str) -> Callable[[Entry], str]:
    """Return what tells a ratio in a region, with its interval."""

    def in_words(entry: Entry) -> str:
        estimate = _of(entry, region, key)
        if estimate is None:
            return ''
        return f'{estimate["ratio"]:.2f} ({estimate["low"]:.2f} to {estimate["high"]:.2f})'

    return in_words


def _share_flagged(entry: Entry) -> str:
    share = _of(entry, 'outside', 'flagged')
    return '' if share is None else f'{100 * share:.0f} %'


def _verdict(entry: Entry) -> str:
    if entry['traceback']:
        return f'traceback: {entry["traceback"].strip().splitlines()[-1]}'
    sure = '' if entry['confidence'] is None else f', {100 * entry["confidence"]:.0f} %'
    names = ', '.join(entry['families']) or 'nothing named'
    return f'{entry["status"]}{sure}: {names}'


SPLITS: dict[str, Callable[[Entry], object]] = {
    'split': _name,
    'stations': lambda entry: entry['stations'],
    **{name: _mm('inside', name) for name in ('frames', 'geometry', 'gravity', 'product')},
    'over best (95 %)': _ratio('inside', 'over_best'),
    'outside: frames': _mm('outside', 'frames'),
    'outside: product': _mm('outside', 'product'),
    'over frames': _ratio('outside', 'over_frames'),
    'flagged': _share_flagged,
    'verdict': _verdict,
}
"""Columns of the table of splits."""
