# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of one cell: what changed, its control charts, its last diagnoses."""

from collections.abc import Callable, Mapping, Sequence
from datetime import datetime, timezone
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.history import Observation
from weld_twin_nodes.wording.quantities import counted, millimetres, odds
from weld_twin_nodes.wording.words import capital

from ..history.database import Damaged, Database
from ..history.entry import Entry
from ..history.runs import NEWEST, Run, Runs
from ..history.words import HEADS, causes_of, coordinate, moved, observations, row
from ..report.charts import Axis, Line, chart
from ..report.html import (
    Child,
    Figure,
    Html,
    columns,
    document,
    figures,
    section,
    sentences,
    table,
    tag,
)

CHARTS = 8
"""Charts of single values: those that changed first, then those that are named as causes."""
CAUSES = 3
"""Causes named of a diagnosis; more are counted."""
ROWS = 20
"""Diagnoses listed, the newest first."""
TROUBLES = 10
"""Recordings without a verdict listed, the newest first."""
MILLI = 1e3
"""Millimetres of a metre."""
STYLE = (
    'a { color: var(--accent); } th[scope=row] { white-space: nowrap; }'
    'nav { display: flex; flex-wrap: wrap; gap: .25rem 1.25rem; padding-bottom: .6rem; }'
    '@media print { nav { display: none; } }'
)
"""What pages of cells have besides: links, and dates and names in one line."""


def cell_page(
    database: Database, cell: str, home: str | None = None, ways: Html | None = None
) -> str:
    """Return the page of a cell with its way ``home``, to that of all cells, and to others."""
    entries = database.entries(cell, NEWEST)
    runs = Runs(database)
    changes = runs.look(cell, entries)
    rows = [row(entry, CAUSES) for entry in entries[: -ROWS - 1 : -1]]
    last = entries[-1]
    sure = '' if last.confidence is None else f'{odds(last.confidence)} sure'
    cells: list[Figure] = [
        ('Verdict', last.status, sure),
        ('Gap', millimetres(last.gap_m), 'without what was found'),
        ('Left', millimetres(last.unexplained_m), 'with it'),
        ('Recorded', str(last.at.date()), causes_of(last.effects, CAUSES)),
    ]
    body = tag(
        'main',
        _head(cell, home, ways, f'{entries[-1].robot} · {_span(entries)}'),
        tag('section#verdict', tag('h1', _headline(entries, changes)), figures(cells)),
        _changed(changes),
        _charts(entries, changes),
        section('Last diagnoses', table(HEADS, rows), id_='diagnoses'),
        troubles_section(runs.troubles(cell)[:TROUBLES]),
    )
    return document(f'{cell} · history', body, charts=True, style=STYLE)


def page_of(
    database: Database, cell: str, home: str | None = None, ways: Html | None = None
) -> str:
    """Return the page of a cell; where its rows cannot be read, one that says why."""
    try:
        return cell_page(database, cell, home, ways)
    except Damaged as error:
        why = tag('p', str(error))
        said = tag('section#damaged', tag('h1', 'This cell cannot be read.'), why)
        return document(
            f'{cell} · history', tag('main', _head(cell, home, ways), said), style=STYLE
        )


def _head(cell: str, home: str | None, ways: Html | None, subject: str | None = None) -> Html:
    return tag(
        'header',
        ways,
        tag('p.kind', 'History of ', tag('b', cell)),
        tag('p.subject', subject) if subject else None,
        tag('p', tag('a', 'All cells', href=home)) if home else None,
    )


def _span(entries: Sequence[Entry]) -> str:
    """Return how many diagnoses there are, and of when."""
    count = len(entries)
    number = counted(count, 'diagnosis', 'diagnoses')
    first, last = entries[0].at.date(), entries[-1].at.date()
    more = 'the last ' if count == NEWEST else ''
    return f'{more}{number}, {first}' + (f' to {last}' if last != first else '')


def _headline(entries: Sequence[Entry], changes: Sequence[Mapping[str, Any]]) -> str:
    if len(entries) == 1:
        return 'One diagnosis so far: the next ones tell what changes.'
    if not changes:
        return 'Nothing changed by more than chance.'
    latest = max(changes, key=lambda change: str(change['date']))
    more = f' {len(changes) - 1} more below.' if len(changes) > 1 else ''
    return f'{str(latest["sentence"]).capitalize()}{more}'


def _changed(changes: Sequence[Mapping[str, Any]]) -> Html | None:
    if not changes:
        return None
    said = sentences(str(each['sentence']).capitalize() for each in changes)
    lead = 'More than chance does in a year of weekly looks. The surest comes first.'
    return section('What changed', said, id_='changed', lead=lead)


def _charts(entries: Sequence[Entry], changes: Sequence[Mapping[str, Any]]) -> Html | None:
    """Return the control charts: the gap, and single values; None for a single diagnosis."""
    if len(entries) == 1:
        return None
    seconds = np.array([entry.at.timestamp() for entry in entries])
    gaps = np.array([entry.gap_m for entry in entries], dtype=float)
    charts: list[Child] = [
        control_chart('Gap', seconds, MILLI * gaps, Axis('gap', 'mm'), from_zero=True)
    ]
    # What a change is of: tools counted from the first one.
    seen = observations(entries)
    begins: dict[str, float] = {}
    for change in changes:
        day = datetime.fromisoformat(str(change['date'])).replace(tzinfo=timezone.utc)
        for name in moved(change):
            begins[name] = min(begins.get(name, np.inf), day.timestamp())
    for name in _shown(entries, begins):
        what = coordinate(name)
        before = int(np.searchsorted(seconds, begins[name])) if name in begins else None
        values = what.factor * np.array([_value(each, name) for each in seen])
        axis = Axis('value', what.unit)
        charts.append(control_chart(capital(what.words), seconds, values, axis, before=before))
    lead = (
        'Shaded is what is usual for this cell: three standard deviations of its own first '
        'diagnoses, before anything changed.'
    )
    return section('Control charts', *charts, id_='charts', lead=lead)


def _shown(entries: Sequence[Entry], begins: Mapping[str, float]) -> list[str]:
    named = [
        f'{each["effect"]} {each["joint"]} 0'
        for each in entries[-1].effects
        if each.get('joint') is not None
    ]
    known = {name for entry in entries for name in entry.names}
    return [name for name in dict.fromkeys([*begins, *named]) if name in known][:CHARTS]


def _value(each: Observation, name: str) -> float:
    return float(each.value[each.names.index(name)]) if name in each.names else np.nan


def troubles_section(troubles: Sequence[Run]) -> Html | None:
    """Return the recordings without a verdict, and why; None for none."""
    if not troubles:
        return None
    shown: dict[str, Callable[[Run], Child]] = {
        'cell': lambda run: run.cell,
        'recording': lambda run: run.recording.rsplit('/', 1)[-1],
        'state': lambda run: run.state,
        'why': lambda run: run.sentence,
    }
    return section('Recordings without a verdict', columns(troubles, shown), id_='troubles')


FIRST = 12
"""Diagnoses that a baseline is made of, if nothing changed among them: a quarter of weeks."""
FEWEST = 3
"""Diagnoses without which there is no baseline."""
LIMIT = 3.0
"""Standard deviations from the baseline to a control limit, as ever."""
MARKED = 60
"""Diagnoses up to which each has its dot; more of them run into one another."""
MOVING = 0.6745 * np.sqrt(2.0)
"""Median distance of two normal draws, in standard deviations."""


class Baseline(NamedTuple):
    """What is usual: the middle, and the control limits on both sides."""

    middle: float
    low: float
    high: float


def baseline(values: Array, before: int | None = None) -> Baseline | None:
    """Return what is usual of values in the order of time, up to a number; None for too few."""
    first = values[: min(FIRST, values.size if before is None else before)]
    first = first[np.isfinite(first)]
    if first.size < FEWEST:
        return None
    middle = float(np.median(first))
    sigma = float(np.median(np.abs(np.diff(first)))) / MOVING
    return Baseline(middle, middle - LIMIT * sigma, middle + LIMIT * sigma)


def control_chart(
    title: str,
    seconds: Array,  # shape (N,), since 1970, ascending
    values: Array,  # shape (N,)
    axis: Axis,  # what the values are
    *,
    before: int | None = None,  # number of diagnoses before the first change
    from_zero: bool = False,
) -> Html:
    """Return a chart of values over dates, with the baseline and its limits."""
    usual = baseline(values, before)
    lines = [Line(axis.label, values, marked=values.size <= MARKED)]
    band = None
    if usual is not None:
        every = np.ones(values.size)
        lines.append(Line('baseline', usual.middle * every, 'soft', dashed=True))
        low = max(usual.low, 0.0) if from_zero else usual.low
        band = (low * every, usual.high * every)
    axes = (Axis('recorded'), axis)
    return chart(
        title, seconds, lines, axes, key='history', band=band, dates=True, from_zero=from_zero
    )
