# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How long the pages of cells take over a database of many diagnoses."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from weld_twin_msgs_py.files import markdown
from weld_twin_report.fleet.cell_page import cell_page
from weld_twin_report.fleet.ranking_page import ranking_page
from weld_twin_report.history import Database
from weld_twin_report.history.runs import Runs

from .made_history import fill, made
from .postgres import NoServer, postgres

GOAL = 1.0
"""Seconds that a page may take."""
LONG = 'one for years'
"""Cell with more diagnoses than a page looks at."""
TIMES = 3
"""Each page is made so often; the longest counts."""


class PageTime(NamedTuple):
    """What was timed on which database."""

    database: str
    what: str
    seconds: float
    is_page: bool = True


def page_times(cells: int, diagnoses: int) -> tuple[list[PageTime], str]:
    """Return the times, and why PostgreSQL is not among them; empty where it is."""
    with tempfile.TemporaryDirectory() as place:
        rows = _on('SQLite', str(Path(place) / 'pages.db'), cells, diagnoses)
    try:
        with postgres() as url:
            rows += _on('PostgreSQL', url, cells, diagnoses)
    except NoServer as error:
        return rows, f'not timed on PostgreSQL: {error}'
    return rows, ''


def _on(name: str, url: str, cells: int, diagnoses: int) -> list[PageTime]:
    database = Database(url)
    runs = Runs(database)
    rows = [PageTime(name, 'fill', _longest(lambda: fill(database, cells, diagnoses), 1), False)]
    long = list(made(cells, 2000))
    database.write(lambda connection: [database.put(connection, LONG, entry) for entry in long])
    some = database.cells()[: max(cells // 10, 1)]
    looks = _longest(lambda: [runs.look(cell) for cell in some], 1)
    rows.append(
        PageTime(name, 'what changed on a cell, once a diagnosis', looks / len(some), False)
    )
    rows += [
        PageTime(name, 'all cells', _longest(lambda: ranking_page(database, str))),
        PageTime(name, 'a cell', _longest(lambda: cell_page(database, 'line 002'))),
        PageTime(
            name,
            'a cell, first time',
            _longest(lambda: cell_page(database, f'line {cells:03d}'), 1),
        ),
    ]
    runs.look(LONG)
    rows.append(PageTime(name, 'a cell with 2,000', _longest(lambda: cell_page(database, LONG))))
    database.close()
    return rows


def _longest(work: Callable[[], object], times: int = TIMES) -> float:
    """Return the longest of some times that the work takes [s]."""
    out = 0.0
    for _ in range(times):
        began = time.perf_counter()
        work()
        out = max(out, time.perf_counter() - began)
    return out


def table(rows: Sequence[PageTime], cells: int, diagnoses: int) -> str:
    """Return the page of results."""
    told = [
        (row.database, row.what, f'{row.seconds:.2f} s', f'{GOAL:.0f} s' if row.is_page else '')
        for row in rows
    ]
    lead = (
        f'# Pages over {cells * diagnoses:,} diagnoses\n\n'
        f'{cells} cells with {diagnoses} diagnoses each, and one with 2,000 more; made up by '
        '`weld-twin lab pages`. Of three times the longest.\n\n'
    )
    return lead + markdown.table(('database', 'page', 'took', 'goal'), *told) + '\n'
