# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the splits together must show, and what they do show."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

Entry = dict[str, Any]
MANY = 120
"""Stations from which on more is asked of the diagnosis."""


class Measure(NamedTuple):
    """One line of the table: what, the goal in words, what was got, and whether it is reached."""

    what: str
    goal: str
    got: str
    reached: bool | None
    blame: tuple[str, ...] = ()


def measures(entries: Sequence[Entry]) -> list[Measure]:
    """Return every measure over the splits, the servo axis left out."""
    found = [e for e in entries if e['kind'] != 'servo_axis']
    return [
        _never_much_worse(found),
        _median(found, MANY, 0.85),
        _median(found, 0, 1.0),
        _unflagged(found),
        *_outside(found),
        _flagged(found),
        _unsound(found),
        _interval(found),
        _stable(found),
        _implausible(found),
        _nothing_named(found),
        _tracebacks(entries),
    ]


def _regions(entries: Sequence[Entry], region: str, key: str) -> list[tuple[Entry, Any]]:
    rows = [(e, (e.get(region) or {}).get(key)) for e in entries]
    return [(e, value) for e, value in rows if value is not None]


def _never_much_worse(entries: Sequence[Entry]) -> Measure:
    pairs = _regions(entries, 'inside', 'over_best')
    bad = [e['name'] for e, r in pairs if r['ratio'] > 1.05 and r['low'] > 1.0]
    worst = max((r['ratio'] for _, r in pairs), default=float('nan'))
    return Measure(
        'product over the best of the three plain fits, mean error, inside',
        '<= 1.05 on every split, or its 95 % interval reaches 1',
        f'{len(pairs) - len(bad)} of {len(pairs)}; worst {worst:.2f}',
        not bad,
        tuple(bad),
    )


def _median(entries: Sequence[Entry], least: int, goal: float) -> Measure:
    pairs = [
        r['ratio'] for e, r in _regions(entries, 'inside', 'over_best') if e['stations'] >= least
    ]
    middle = float(np.median(pairs)) if pairs else float('nan')
    which = f'splits of {least} stations or more' if least else 'all splits'
    return Measure(
        f'the same, median over {which}', f'<= {goal}', f'{middle:.2f}', _below(middle, goal)
    )


def _unflagged(entries: Sequence[Entry]) -> Measure:
    bad = []
    for region in ('inside', 'outside'):
        for e, r in _regions(entries, region, 'unflagged_over_frames'):
            if r['ratio'] >= 1.05 and e['name'] not in bad:
                bad.append(e['name'])
    return Measure(
        'splits whose stations that are not flagged are worse than frames only by 5 % or more',
        '0',
        str(len(bad)),
        not bad,
        tuple(bad),
    )


def _outside(entries: Sequence[Entry]) -> list[Measure]:
    pairs = [(e, r['ratio']) for e, r in _regions(entries, 'outside', 'over_frames')]
    ratios = [ratio for _, ratio in pairs] or [float('nan')]
    bad = tuple(e['name'] for e, ratio in pairs if ratio > 1.05)
    worst, middle = max(ratios), float(np.median(ratios))
    what = 'mean error outside over frames only'
    return [
        Measure(f'{what}, worst', '<= 1.05', f'{worst:.2f}', _below(worst, 1.05), bad),
        Measure(f'{what}, median', '<= 0.8', f'{middle:.2f}', _below(middle, 0.8)),
    ]


def _flagged(entries: Sequence[Entry]) -> Measure:
    pairs = _regions(entries, 'inside', 'flagged')
    count = sum(e['inside']['stations'] for e, _ in pairs)
    share = sum(e['inside']['stations'] * v for e, v in pairs) / max(count, 1)
    return Measure(
        'stations inside that are flagged', '<= 5 %', f'{100 * share:.1f} %', share <= 0.05
    )


def _unsound(entries: Sequence[Entry]) -> Measure:
    bad = tuple(e['name'] for e in entries if e.get('status') == 'unsound')
    return Measure('sound splits called unsound', '0', str(len(bad)), not bad, bad)


def _interval(entries: Sequence[Entry]) -> Measure:
    hits, bad = 0, []
    pairs = [e for e, _ in _regions(entries, 'inside', 'over_frames') if e.get('claimed')]
    for e in pairs:
        rms = e['inside']['rms_m']
        low, high = e['claimed']['ci95']
        if low <= rms['product'] / rms['frames'] <= high:
            hits += 1
        else:
            bad.append(e['name'])
    share = hits / max(len(pairs), 1)
    return Measure(
        '95 % interval of the shrink holds',
        '>= 90 % of splits',
        f'{hits} of {len(pairs)}',
        share >= 0.9,
        tuple(bad),
    )


def _stable(entries: Sequence[Entry]) -> Measure:
    """Return how often odd and even halves agree on status and families."""
    by_name = {e['name']: e for e in entries}
    pairs = [(e['name'], *e['halves']) for e in entries if e.get('halves')]
    for e in entries:
        if e['kind'] == 'odd' and f'{e["robot"]}_even' in by_name:
            pairs.append((f'{e["robot"]} odd/even', e, by_name[f'{e["robot"]}_even']))
    bad = tuple(name for name, one, other in pairs if not _alike(one, other))
    share = 1.0 - len(bad) / max(len(pairs), 1)
    return Measure(
        'same status and families on odd and even halves',
        '>= 90 %',
        f'{len(pairs) - len(bad)} of {len(pairs)}',
        share >= 0.9,
        bad,
    )


def _alike(one: Entry, other: Entry) -> bool:
    return all(one.get(key) == other.get(key) for key in ('status', 'families'))


def _implausible(entries: Sequence[Entry]) -> Measure:
    bad = tuple(e['name'] for e in entries if e.get('beyond'))
    count = sum(len(e.get('beyond') or ()) for e in entries)
    return Measure('named parameters outside their plausible range', '0', str(count), not bad, bad)


def _nothing_named(entries: Sequence[Entry]) -> Measure:
    bad = tuple(
        e['name'] for e in entries if e.get('status') == 'identified' and not e.get('families')
    )
    return Measure('identified with nothing named', '0', str(len(bad)), not bad, bad)


def _tracebacks(entries: Sequence[Entry]) -> Measure:
    bad = tuple(
        e['name']
        for e in entries
        if e.get('traceback') or any(h.get('traceback') for h in e.get('halves', ()))
    )
    return Measure('tracebacks on the splits', '0', str(len(bad)), not bad, bad)


def _below(value: float, goal: float) -> bool | None:
    """Return whether a goal is reached, None where nothing was measured."""
    return None if np.isnan(value) else value <= goal
