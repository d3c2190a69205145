# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What learned belief is worth, as tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from weld_twin_msgs_py.files import markdown

COUNTED = frozenset({'breadth', 'seconds', 'fia', 'curve_removes'})
"""Measures that are no shares of cases."""
HEAD = (
    'statements on',
    'number',
    'right',
    'calibration error, by hand',
    'learned',
    'sure and wrong, by hand',
    'learned',
    'sure, by hand',
    'learned',
    'wrong among the surest 70 %, by hand',
    'learned',
)


def page(result: Mapping[str, Any]) -> str:
    """
    Return the whole in Markdown.

    Parameters
    ----------
    result : mapping
        As `study.judged` gives it.

    """
    levels = [(name, row) for name, row in result['levels'].items() if row['after']]
    groups = [(name, row) for name, row in result['groups'].items() if row['after']]
    return '\n'.join(
        [
            *_bounds(result['learned_from'], result['judged_on']),
            '',
            markdown.table(HEAD, *(_row(name, row) for name, row in levels)),
            'Answers as a whole:',
            '',
            markdown.table(HEAD, *(_row(name, row) for name, row in groups)),
            'The cases learned from, each judged by weights that had not seen it:',
            '',
            markdown.table(
                ('statements on', 'belief', 'calibration error', 'sure and wrong', 'sure'),
                *_unseen(result['learned_from']['unseen']),
            ),
            'Beside the goals:',
            '',
            markdown.table(
                ('measure', 'value', '95 % interval', 'cases', 'goal', 'reached'),
                *(_goal(item) for item in result['goals']),
            ),
            *_failures(result['wrong_and_sure']),
        ]
    )


def _bounds(taught: Mapping[str, Any], tried: Mapping[str, Any]) -> list[str]:
    """Return what was learned from, and from where an answer is told as sure."""
    bounds = {name: b for name, b in taught['bounds'].items() if name.startswith('answer ')}
    return [
        f'Learned from {taught["cases"]} cases of seed {_listed(taught["seeds"])}, judged on '
        f'{tried["cases"]} cases of seed {_listed(tried["seeds"])}, none of which was learned '
        f'from. From where an answer is told as sure:',
        '',
        markdown.table(
            ('answers', 'cases', 'sure from', 'sure', 'of these wrong', 'at most', 'surely below'),
            *(_bound(name.partition(' ')[2], b) for name, b in bounds.items()),
        ),
        'Each case was judged by weights that had not seen it. One more such answer is sure and '
        'wrong with a probability of at most the sixth column; the share is below the last with '
        '90 % confidence.',
    ]


def _unseen(levels: Mapping[str, Any]) -> list[tuple[str, ...]]:
    return [
        (
            level,
            name,
            f'{worth["ece"]:.3f}',
            _percent(worth['sure_and_wrong']),
            _percent(worth['sure']),
        )
        for level, beliefs in levels.items()
        for name, worth in beliefs.items()
    ]


def _bound(name: str, bound: Mapping[str, Any]) -> tuple[str, ...]:
    never = bound['sure_from'] > 1.0
    return (
        name,
        str(bound['cases']),
        'never: too few cases' if never else f'{bound["sure_from"]:.3f}',
        _percent(bound['sure']),
        str(bound['wrong']),
        _percent(bound['expected']),
        _percent(bound['most']),
    )


def _row(name: str, row: Mapping[str, Any]) -> tuple[str, ...]:
    before, after = row['before'], row['after']
    return (
        name,
        str(row['statements']),
        _percent(row['right'] / row['statements']),
        *(f'{told["ece"]["value"]:.3f}' for told in (before, after)),
        *(_percent(told['sure_and_wrong']['value']) for told in (before, after)),
        *(_percent(told['sure']['value']) for told in (before, after)),
        *(_percent(told['wrong_at_70']) for told in (before, after)),
    )


def _goal(item: Mapping[str, Any]) -> tuple[str, ...]:
    estimate, goal = item['estimate'], item['goal']
    if estimate['value'] is None:
        return (item['title'], '-', '-', '0', '-', '-')
    show = _number if item['key'] in COUNTED else _percent
    reached = {True: 'yes', False: 'no', None: ''}[item['reached']]
    return (
        item['title'],
        show(estimate['value']),
        f'{show(estimate["low"])} to {show(estimate["high"])}',
        str(estimate['cases']),
        '' if goal is None else f'{"≥" if item["at_least"] else "≤"} {show(goal)}',
        reached,
    )


def _failures(listed: Sequence[Mapping[str, Any]]) -> list[str]:
    if not listed:
        return ['No case was sure and wrong.', '']
    rows = [
        (
            item['case'],
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


def _number(value: float) -> str:
    return f'{value:.2f}'


def _listed(values: Sequence[object]) -> str:
    return ', '.join(map(str, values))
