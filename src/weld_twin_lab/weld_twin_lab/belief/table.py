# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the calibration is worth, as tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from operator import itemgetter
from typing import Any

from ..blind.measures import measure_table
from ..study import tabled


def page(result: Mapping[str, Any]) -> str:
    """
    Return the whole in Markdown.

    result: as `study.judged` gives it.
    """
    return '\n'.join(
        [
            *_bounds(result['learned_from'], result['judged_on']),
            '',
            tabled(STATEMENTS, result['statements'].items()),
            *(_beside_goals(result) if result['goals'] else ()),
        ]
    )


def _beside_goals(result: Mapping[str, Any]) -> list[str]:
    """Return the measures beside their goals, and what was sure and wrong."""
    return [
        'Beside the goals:',
        '',
        measure_table(result['goals']),
        *_failures(result['wrong_and_sure']),
    ]


def _bounds(taught: Mapping[str, Any], tried: Mapping[str, Any]) -> list[str]:
    """Return what was learned from, and from where a statement is told as sure."""
    by = (
        f'judged on {tried["cases"]} cases of seed {_listed(tried["seeds"])}, none of which was '
        'learned from'
        if tried['cases']
        else 'each judged by weights that had not seen it'
    )
    return [
        f'{taught["weights"]} weights, learned from {taught["cases"]} cases of seed '
        f'{_listed(taught["seeds"])}; {by}. From where a statement is told as sure:',
        '',
        tabled(BOUNDS, taught['bounds'].items()),
    ]


def _failures(listed: Sequence[Mapping[str, Any]]) -> list[str]:
    if not listed:
        return ['No case was sure and wrong.', '']
    return ['Sure and wrong:', '', tabled(FAILURES, listed)]


def _percent(value: float) -> str:
    return f'{100.0 * value:.1f} %'


def _listed(values: Sequence[object]) -> str:
    return ', '.join(map(str, values))


BOUNDS: dict[str, Callable[[Any], object]] = {
    'statement': lambda row: row[0],
    'number': lambda row: f'{row[1]["cases"]:.0f}',
    'sure from': lambda row: (
        'never: too few cases' if row[1]['sure_from'] > 1.0 else f'{row[1]["sure_from"]:.3f}'
    ),
    'sure': lambda row: _percent(row[1]['sure']),
    'of these wrong': lambda row: f'{row[1]["wrong"]:.0f}',
}
"""Columns of the table of bounds, each a name and its bound."""
STATEMENTS: dict[str, Callable[[Any], object]] = {
    'statements': lambda row: row[0],
    'number': lambda row: row[1]['statements'],
    'right': lambda row: _percent(row[1]['right'] / row[1]['statements']),
    'calibration error': lambda row: f'{row[1]["ece"]["value"]:.3f}',
    'log loss': lambda row: f'{row[1]["log_loss"]:.3f}',
    'sure': lambda row: _percent(row[1]['sure']['value']),
    'sure and wrong': lambda row: row[1]['sure_and_wrong'],
    'wrong among the surest 70 %': lambda row: _percent(row[1]['wrong_at_70']),
}
"""The same of kinds of statements."""
FAILURES: dict[str, Callable[[Any], object]] = {
    'case': itemgetter('name'),
    **{key: itemgetter(key) for key in ('kind', 'robot', 'motion', 'truth')},
    'sizes [noise]': lambda item: ', '.join(f'{size:.1f}' for size in item['sizes']),
    'said': itemgetter('said'),
}
"""Columns of the table of cases that were sure and wrong."""
