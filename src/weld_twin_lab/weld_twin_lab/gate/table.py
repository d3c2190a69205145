# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the trials of the gate came to, as plain values and as a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from weld_twin_msgs_py.files import markdown

from .mistakes import KINDS

GOAL_NAMED = 0.95
"""Least share of the mistakes of every kind that must be named."""


HEADS = ('named first', 'only among the alike')
NUMBERS = frozenset({'trials', 'named', 'only_alike'})


def result(trials: Sequence[Mapping[str, Any]], seed: int) -> dict[str, Any]:
    """
    Return shares named by kind, complaints, what went wrong, and whether the goals are met.

    What stands only among the alike of another mistake is counted beside, and not as named.

    trials: those without a ``kind`` are of sound recordings.
    """
    mistakes = [t for t in trials if 'kind' in t]
    sound = [t for t in trials if 'kind' not in t]
    tried = {t['kind'] for t in mistakes}
    named = {k: _share([m for m in mistakes if m['kind'] == k]) for k in KINDS if k in tried}
    complaints = [s for s in sound if not s['right']]
    goals = [n['named'] >= GOAL_NAMED * n['trials'] for n in named.values()]
    return {
        'seed': seed,
        'named': named,
        'sound': {'trials': len(sound), 'complaints': len(complaints)},
        'missed': [dict(m) for m in mistakes if not m['right']],
        'complaints': [dict(s) for s in complaints],
        'passed': all(goals) and not complaints,
    }


def _share(trials: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    out: dict[str, Any] = {
        'trials': len(trials),
        'named': sum(bool(t['right']) for t in trials),
        'only_alike': sum(bool(t['only_alike']) for t in trials),
    }
    for way in sorted({str(t['way']) for t in trials}):
        mine = [t for t in trials if t['way'] == way]
        out[way] = {'trials': len(mine), 'named': sum(bool(t['right']) for t in mine)}
    return out


def table(content: Mapping[str, Any]) -> str:
    """Return the result as a Markdown table."""
    ways = sorted({w for counts in content['named'].values() for w in counts} - NUMBERS)
    rows = [
        [
            kind,
            *(_cell(counts.get(way)) for way in ways),
            _cell(counts),
            counts['only_alike'] or '-',
        ]
        for kind, counts in content['named'].items()
    ]
    sound = content['sound']
    made = markdown.table(('mistake', *ways, *HEADS), *rows)
    return f'{made}\nsound recordings: {sound["complaints"]} complaints on {sound["trials"]}\n'


def page(content: Mapping[str, Any]) -> str:
    """Return tables and misses as a page."""
    out = [
        '# The gate, measured',
        '[What is found and how](../../unsound.md). Every kind of mistake was made in recordings '
        'that a simulator drew, then written as a bag or as a table and read again. Sound ones '
        'have causes of all families, big ones among them, on rich and poor motions.',
        table(content),
    ]
    if missed := content['missed']:
        rows = [
            [m['kind'], m['way'], m['what'], ', '.join((*m['kinds'], *m['dated'])) or 'nothing']
            for m in missed
        ]
        out += ['## Missed', markdown.table(('mistake', 'in', 'what was done', 'named'), *rows)]
    return '\n\n'.join(part.rstrip() for part in out) + '\n'


def _cell(counts: Mapping[str, Any] | None) -> str:
    return '-' if not counts else f'{counts["named"]} of {counts["trials"]}'
