# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Cells over time: what changed, which one is worst."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from contextlib import closing
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from weld_twin_core.errors import DataError
from weld_twin_nodes.cli.given import Given, pair, refuse_unknown_effect
from weld_twin_nodes.wording.quantities import counted, millimetres
from weld_twin_nodes.wording.words import cause

from ...history import Database, observations, words
from ...history.entry import Entry, entry_of, instant
from ...history.runs import (
    DONE,
    FAILED,
    REFUSED,
    Run,
    Verified,
    put_verified,
    verifications,
    verified_of,
)
from .. import limits, progress

if TYPE_CHECKING:
    from sqlalchemy import Connection  # an extra: the history itself says where it is missing

TROUBLED = 1
"""Exit code where a recording was refused or failed; those that were unsound have their verdict."""
WIDTH = 100
"""Columns of a table, whatever the terminal has."""
INDEX = 'index.html'
VERIFIED = ('measured again', 'promise', 'promised', 'measured', 'did not go away')
"""Heads of what was measured after corrections."""


def opened(given: Given, *, make: bool = False) -> closing[Database]:
    """Return the database of the options, to be closed; ``make`` it where there is none yet."""
    return closing(Database(given.db, make=make))


def add(given: Given) -> int:
    """Add diagnoses to the history of a cell."""
    if given.at and len(given.diagnosis) > 1:
        raise DataError('--at is the date of one diagnosis; add them one by one')
    at = instant(given.at) if given.at else None
    # All are read before the first is written, and all are written or none.
    entries = [verified_of(path, at) or entry_of(path, at) for path in given.diagnosis]

    def written(connection: Connection) -> list[int | None]:
        return [
            put_verified(database, connection, given.cell, entry)
            if isinstance(entry, Verified)
            else database.put(connection, given.cell, entry)
            for entry in entries
        ]

    with opened(given, make=True) as database:
        made = database.write(written)
        said_of = [
            'added' if number else _there_already(database, given.cell, entry)
            for entry, number in zip(entries, made, strict=True)
        ]
    for path, entry, said in zip(given.diagnosis, entries, said_of, strict=True):
        print(f'{given.cell}: {path}, {entry.at.date()}, {entry.status}: {said}')
        if entry.at > datetime.now(timezone.utc) + timedelta(days=1):
            print(f'note: {entry.at.date()} is still to come by the clock of this computer')
    return 0


def _there_already(database: Database, cell: str, entry: Entry | Verified) -> str:
    """Return that a recording was there, and what is kept of it where that is something else."""
    kept = () if isinstance(entry, Verified) else database.entries(cell)
    for old in kept:
        if old.recording == entry.recording and _verdict(old) != _verdict(entry):
            return (
                f'was there already, and what was diagnosed then stays: {": ".join(_verdict(old))}; '
                'begin a history anew (--db) to have this instead'
            )
    return 'was there already'


def _verdict(entry: Entry | Verified) -> list[str]:
    causes = '' if isinstance(entry, Verified) else words.causes_of(entry.effects)
    return [text for text in (entry.status, causes) if text]


def show(given: Given) -> int:
    """Show the diagnoses of a cell, or which cells there are."""
    with opened(given) as database:
        if not given.cell:
            print('\n'.join(database.cells()) or 'no cell yet')
            return 0
        entries = database.entries(given.cell)
        verified = verifications(database, given.cell)
    _print_table(words.HEADS, map(words.row, entries))
    if verified:
        _print_table(VERIFIED, map(_verified_row, verified))
    return 0


def _print_table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    table = Table(*heads, box=None)
    for row in rows:
        table.add_row(*row)
    Console(highlight=False, width=WIDTH).print(table)


def _verified_row(result: Verified) -> list[str]:
    content = result.content
    still = [
        cause(site['effect'], site['joint'])
        for item in content['causes']
        if item['state'] not in ('gone', 'open')
        for site in item['sites']
    ]
    sizes = (millimetres(content[key]['rms_m']) for key in ('promised', 'measured'))
    kept = 'kept' if content['kept'] else 'not kept'
    return [result.at.date().isoformat(), kept, *sizes, ', '.join(still)]


def changed(given: Given) -> int:
    """Say what changed, since when, and where it leads."""
    allowed = {}
    for text in given.limit:
        effect, value = pair(text, '--limit', 'EFFECT=VALUE, such as backlash=0.0017')
        try:
            allowed[effect] = float(value)
        except ValueError:
            raise DataError(f"--limit: '{value}' is no number") from None
        refuse_unknown_effect('--limit', effect)
    with opened(given) as database:
        entries = database.entries(given.cell)
    seen = observations(entries)
    day = instant(given.since).timestamp() / words.DAY if given.since else None
    everything = words.changed(entries, seen)
    result = words.since(everything, day)
    pairs = [(change, words.forecast(change, seen, everything, allowed)) for change in result]
    if given.json:
        rows = [{**words.as_dict(change), 'forecast': ahead} for change, ahead in pairs]
        print(json.dumps({'cell': given.cell, 'diagnoses': len(seen), 'changes': rows}, indent=2))
        return 0
    if not result:
        many = counted(len(seen), 'diagnosis', 'diagnoses')
        after = f' after {given.since}' if everything else ''
        print(f'{given.cell}: nothing changed by more than chance{after} in {many}')
    for change, ahead in pairs:
        print(f'{given.cell}: {words.sentence(change)}')
        if ahead is not None:
            print(f'{given.cell}: {words.forecast_sentence(change, ahead)}')
    return 0


def run(given: Given) -> int:
    """Diagnose the recordings of a list into a database."""
    from weld_twin_nodes.offline.task_pool import Cluster

    from ...fleet import read_list, run_fleet
    from ...fleet.running import Threads

    if given.memory < 1.0 or given.minutes <= 0.0:
        raise DataError('--memory takes 1 GB or more, --minutes more than none')
    listed = read_list(given.list)
    with (
        opened(given, make=True) as database,
        closing(Cluster(given.scheduler) if given.scheduler else Threads(given.workers)) as pool,
        progress('diagnosing') as (bars, advance),
    ):

        def tell(done: int, total: int, run: Run | None) -> None:
            advance(done, total)
            if run is not None and run.state != DONE:
                said = f'{run.cell}: {run.recording}: {run.state}: {run.sentence}'
                bars.console.print(said, markup=False)

        keep = Path(given.keep) if given.keep else None
        most = limits(given)
        tally = run_fleet(listed, database, pool, most, keep=keep, again=given.again, tell=tell)
    said = ', '.join(f'{count} {state}' for state, count in sorted(tally.items()))
    print(f'{given.list}: {said}')
    return TROUBLED if tally.keys() & {REFUSED, FAILED} else 0


def page(given: Given) -> int:
    """Write a page that ranks cells, and one for each cell."""
    from weld_twin_msgs_py.files.whole_files import write_text
    from weld_twin_nodes.offline.task_pool import digest

    from ...fleet.cell_page import page_of
    from ...fleet.ranking_page import ranking_page

    def file(cell: str) -> str:
        return f'cell_{digest(cell)[:16]}.html'

    with opened(given) as database, given.output(INDEX) as place:
        cells = database.cells()
        for cell in cells:
            write_text(place / file(cell), page_of(database, cell, INDEX))
        write_text(place / INDEX, ranking_page(database, file))
    print(f'{given.out}/{INDEX}: {counted(len(cells), "cell")}')
    return 0
