# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of all cells, the worst first."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from weld_twin_nodes.wording.quantities import counted, millimetres

from ..history.database import Database
from ..history.runs import Run, Runs
from ..history.words import causes_of
from ..report.html import Child, Figure, Html, columns, document, figures, section, table, tag
from .cell_page import STYLE, troubles_section

ROWS = 500
"""Cells listed; more are counted."""
TROUBLES = 50
"""Recordings without a verdict listed, the newest first."""


def ranking_page(database: Database, link: Callable[[str], str], ways: Html | None = None) -> str:
    """Return the page that ranks cells by the gap of their newest diagnosis."""
    runs = Runs(database)
    newest = runs.newest()
    damaged = [row for row in newest if 'damaged' in row]
    rows = [row for row in newest if 'damaged' not in row]
    rows.sort(key=lambda row: -(row['gap_m'] or 0.0))
    troubles = runs.troubles()
    body = tag(
        'main',
        tag('header', ways, tag('p.kind', 'All cells'), tag('p.subject', _span(rows))),
        tag('section#verdict', tag('h1', _headline(rows)), _figures(rows, troubles)),
        _cells(rows, link),
        _damaged(damaged),
        troubles_section(troubles[:TROUBLES]),
    )
    return document('All cells', body, style=STYLE)


def _damaged(rows: Sequence[Mapping[str, Any]]) -> Html | None:
    if not rows:
        return None
    said = table(('cell', 'why'), [(row['name'], row['damaged']) for row in rows])
    return section('Cells that cannot be read', said, id_='damaged')


def _span(rows: Sequence[Mapping[str, Any]]) -> str:
    count = sum(row['diagnoses'] for row in rows)
    return f'{counted(len(rows), "cell")}, {counted(count, "diagnosis", "diagnoses")}'


def _headline(rows: Sequence[Mapping[str, Any]]) -> str:
    if not rows:
        return 'No cell has a diagnosis yet.'
    worst = rows[0]
    causes = causes_of(worst['effects'], 1)
    by = f', mostly from {causes}' if causes else ''
    return f'{worst["name"]} has the largest gap: {millimetres(worst["gap_m"])}{by}.'


def _figures(rows: Sequence[Mapping[str, Any]], troubles: Sequence[Run]) -> Html:
    changed = sum(bool(row['changes']) for row in rows)
    unknown = sum(row['status'] == 'unknown' for row in rows)
    cells: list[Figure] = [
        ('Cells', str(len(rows)), 'with a diagnosis'),
        ('Changed', str(changed), 'by more than chance'),
        ('Unknown', str(unknown), 'something is left that nothing explains'),
        ('No verdict', str(len(troubles)), 'recordings: unsound, refused or failed'),
    ]
    return figures(cells)


def _cells(rows: Sequence[Mapping[str, Any]], link: Callable[[str], str]) -> Html:
    shown: dict[str, Callable[[Any], Child]] = {
        'cell': lambda row: tag('a', row['name'], href=link(row['name'])),
        'verdict': lambda row: tag(f'span.status.{row["status"]}', row['status']),
        'gap': lambda row: millimetres(row['gap_m']),
        'left': lambda row: millimetres(row['unexplained_m']),
        'causes': lambda row: causes_of(row['effects'], 2),
        'last change': _last_change,
        'recorded': lambda row: tag('span', row['at'].date(), style='white-space: nowrap'),
        'robot': lambda row: row['robot'],
    }
    lead = 'The newest diagnosis of each cell, the largest gap first.'
    if len(rows) > ROWS:
        lead += f' {counted(len(rows) - ROWS, "cell")} with smaller gaps left out.'
    return section('Cells', columns(rows[:ROWS], shown), id_='cells', lead=lead)


def _last_change(row: Mapping[str, Any]) -> str:
    latest = max(row['changes'] or [], key=lambda change: str(change['date']), default=None)
    return '' if latest is None else str(latest['sentence'])
