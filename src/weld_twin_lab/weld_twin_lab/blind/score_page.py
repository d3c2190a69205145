# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The score as one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from importlib.resources import files
from typing import Any

from weld_twin_report.report.html import Html, document, section, table, tag

from .judging import Judged
from .measures import Measure
from .score_plots import error_plot, outcome_plot, reliability_plot, shrink_plot
from .scoring import Score

_COUNTED = frozenset(
    {
        'brier',
        'over_floor',
        'z_spread',
        'shrink_off',
        'shrink_off_same',
        'shrink_off_new',
        'ece',
        'ece_library',
    }
)
"""Measures told as numbers; the others are shares."""


def score_page(score: Score) -> str:
    """Return the page."""
    data = score.as_dict()
    body = tag(
        'main',
        _opening(score),
        _measures(score.measures),
        _pictures(score),
        _groups(data),
        _failures(score),
        _costs(score),
    )
    own = (files(__package__) / 'page.css').read_text(encoding='utf-8')
    return document('blind check', body, style=own)


def _opening(score: Score) -> Html:
    made = score.made
    told = sum(case.right for case in score.cases)
    seen = 'could be read' if made['truths_readable'] else 'could not be read'
    return tag(
        'header',
        tag('h1', f'Blind check: {told} of {len(score.cases)} cases answered rightly'),
        tag('p', f'seed {made["seed"]} · seal {made["seal"]}'),
        tag(
            'p',
            f'engine {made["engine"][:16]} of version {made["version"]} · truths {seen} from '
            'where the cases were diagnosed',
        ),
    )


def _measures(measures: Iterable[Measure]) -> Html:
    rows = []
    for measure in measures:
        value, low, high, count = measure.estimate
        text = _number(measure.key, value)
        interval = (
            ''
            if value is None
            else (f'{_number(measure.key, low)} to {_number(measure.key, high)}')
        )
        mark = {None: None, True: 'reached', False: 'missed'}[measure.reached]
        rows.append(
            (
                measure.title,
                tag('b', text),
                interval,
                str(count),
                _goal(measure),
                tag('span', mark, class_=f'mark {mark}') if mark else '',
            )
        )
    return section(
        'Measures',
        table(('measure', 'value', '95 % interval', 'of', 'goal', 'mark'), rows),
        id_='measures',
        lead='Shares have Wilson intervals, other numbers bootstrap intervals. A cause counts as '
        'named when it is in a set of its own in the verdict; a set lists what cannot be '
        'told apart.',
    )


def _goal(measure: Measure) -> str:
    if measure.goal is None:
        return ''
    return f'{"≥" if measure.at_least else "≤"} {_number(measure.key, measure.goal)}'


def _number(key: str, value: float | None) -> str:
    if value is None:
        return '-'
    return f'{value:.3f}' if key in _COUNTED else f'{100.0 * value:.1f} %'


def _pictures(score: Score) -> Html:
    pictures = (
        ('How sure, how right', reliability_plot(score.cases)),
        ('Shrink claimed and achieved', shrink_plot(score.known_shrinks)),
        ('Outcome by effect size', outcome_plot(score.cases)),
        ('Errors of parameters', error_plot(score.cases)),
    )
    made = [tag('figure', tag('figcaption', title), picture) for title, picture in pictures]
    return section('Pictures', tag('div', *made, class_='pictures'), id_='pictures')


def _groups(data: dict[str, Any]) -> Html:
    parts: list[Html] = []
    for key, title in (
        ('by_kind', 'By kind of case'),
        ('by_stratum', 'By effect RMS over noise, weakest cause'),
        ('by_robot', 'By robot'),
        ('by_motion', 'By motion'),
        ('by_cause', 'By cause'),
    ):
        parts += [tag('h3', title), _group_table(data[key])]
    return section('Groups', *parts, id_='groups')


def _group_table(rows: Sequence[dict[str, Any]]) -> Html:
    heads = (
        'group',
        'cases',
        'right',
        'family',
        'joint',
        'exact / partial / wrong / silent',
        'statuses',
        'sure and wrong',
        'set size',
    )
    cells = []
    for row in rows:
        sets = row['sets']
        cells.append(
            (
                f'{row["stratum"]} {row["group"]}' if 'stratum' in row else row['group'],
                str(row['count']),
                *(_number('', row[key]['value']) for key in ('right', 'family', 'joint')),
                ' / '.join(str(sets[key]) for key in ('exact', 'partial', 'wrong', 'silent')),
                ', '.join(f'{count} {name}' for name, count in row['statuses'].items()),
                str(row['confidently_wrong']),
                f'{row["breadth"]:.1f}',
            )
        )
    return table(heads, cells)


def _failures(score: Score) -> Html:
    heads = ('case', 'kind', 'truth (RMS over noise)', 'verdict', 'confidence', 'reason')
    rows = [_failure(case, score) for case in score.failures]
    return section(
        f'{len(rows)} cases not answered rightly',
        table(heads, rows),
        id_='failures',
        lead='Right means: the set of causes is exact; or nothing was wrong and nothing was '
        "found; or no library knows the cause and the verdict is 'unknown'.",
    )


def _failure(case: Judged, score: Score) -> tuple[str, ...]:
    return (
        case.name,
        f'{case.kind}, {case.robot}, {case.motion}',
        f'{case.truth} ({case.stratum:.1f})',
        f'{case.status}: {case.said or "-"}',
        f'{case.confidence:.2f}',
        score.errors.get(case.name, ''),
    )


def _costs(score: Score) -> Html:
    costs = score.costs
    rows = (
        ('seconds', f'{costs["median_seconds"]:.1f}', f'{costs["most_seconds"]:.1f}'),
        (
            'memory of the process [MiB]',
            f'{costs["median_memory_mib"]:.0f}',
            f'{costs["most_memory_mib"]:.0f}',
        ),
    )
    return section('Cost of a diagnosis', table(('cost', 'median', 'most'), rows), id_='costs')
