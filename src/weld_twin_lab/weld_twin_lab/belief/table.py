# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the calibration is worth, as tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from weld_twin_msgs_py.files import markdown

from ..blind.measures import measure_table

HEAD = (
    'statements',
    'number',
    'right',
    'calibration error',
    'log loss',
    'sure',
    'sure and wrong',
    'wrong among the surest 70 %',
)


def page(result: Mapping[str, Any]) -> str:
    """
    Return the whole in Markdown.

    result: as `study.judged` gives it.
    """
    return '\n'.join(
        [
            *_bounds(result['learned_from'], result['judged_on']),
            '',
            markdown.table(HEAD, *(_row(*item) for item in result['statements'].items())),
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
        markdown.table(
            ('statement', 'number', 'sure from', 'sure', 'of these wrong'),
            *(_bound(name, bound) for name, bound in taught['bounds'].items()),
        ),
    ]


def _bound(name: str, bound: Mapping[str, Any]) -> tuple[str, ...]:
    never = bound['sure_from'] > 1.0
    return (
        name,
        f'{bound["cases"]:.0f}',
        'never: too few cases' if never else f'{bound["sure_from"]:.3f}',
        _percent(bound['sure']),
        f'{bound["wrong"]:.0f}',
    )


def _row(name: str, row: Mapping[str, Any]) -> tuple[str, ...]:
    return (
        name,
        str(row['statements']),
        _percent(row['right'] / row['statements']),
        f'{row["ece"]["value"]:.3f}',
        f'{row["log_loss"]:.3f}',
        _percent(row['sure']['value']),
        str(row['sure_and_wrong']),
        _percent(row['wrong_at_70']),
    )


def _failures(listed: Sequence[Mapping[str, Any]]) -> list[str]:
    if not listed:
        return ['No case was sure and wrong.', '']
    rows = [
        (
            item['name'],
            item['kind'],
            item['robot'],
            item['motion'],
            item['truth'],
            ', '.join(f'{size:.1f}' for size in item['sizes']),
            item['said'],
        )
        for item in listed
    ]
    head = ('case', 'kind', 'robot', 'motion', 'truth', 'sizes [noise]', 'said')
    return ['Sure and wrong:', '', markdown.table(head, *rows)]


def _percent(value: float) -> str:
    return f'{100.0 * value:.1f} %'


def _listed(values: Sequence[object]) -> str:
    return ', '.join(map(str, values))
