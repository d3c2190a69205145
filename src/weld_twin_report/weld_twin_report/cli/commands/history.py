# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Cells over time: what changed, which one is worst.

'add', 'show' and 'changed' keep the history of one cell. 'run' diagnoses the recordings of many cells
side by side into one database, and 'page' ranks them.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from weld_twin_core.errors import DataError
from weld_twin_nodes.cli.commands import job, jobs
from weld_twin_nodes.cli.options import POOL, folder_output, output, pair, refuse_unknown_effect

if TYPE_CHECKING:
    from rich.table import Table
    from sqlalchemy import Connection

    from weld_twin_nodes.offline.task_pool import Pool

    from ...fleet.running import Tell
    from ...history import Database, Entry
    from ...history.runs import Run
    from ...history.verifications import Verified

EXAMPLE = 'weld-twin history changed --cell line3'
TROUBLED = 1
"""Exit code where a recording was refused or failed; those that were unsound have their verdict."""
GIGABYTE = 1_000_000_000
"""Bytes."""
WIDTH = 100
"""Columns of a table, whatever the terminal has."""
INDEX = 'index.html'
CELL = '--cell NAME, required    whose history it is\n'
USUAL_DATABASE = """
--db URL                 an SQLite file, or a URL such as postgresql+psycopg://user@host/name
                         [default: weld_twin_history.db]
"""
DATABASE = '--db URL, required       an SQLite file, or postgresql+psycopg://...\n'
ADD = f"""
DIAGNOSIS ...            diagnosis.json, or the directory that diagnose wrote; or what verify wrote
{CELL}
--at DATE                when it was recorded, such as 2026-03-31; left out, the stamps of the recording
                         tell
"""
CHANGED = f"""
{CELL}
--since DATE             only what changed after it
--limit EFFECT=VALUE     largest value allowed of an effect, SI units, such as backlash=0.0017; may be
                         given again
--json                   print JSON instead of sentences
"""
RUN = """
--keep DIR               also keep the page and the model of every recording there
--again                  run once more what a limit or a crash has ended
rare:
--memory GB              of each [default: 6]
--minutes MIN            of each [default: 10]
"""


def opened(args: argparse.Namespace, *, make: bool = False) -> closing[Database]:
    """Return the database of the options, to be closed; ``make`` it where there is none yet."""
    from ...history import Database

    return closing(Database(args.db, make=make))


@job('weld-twin history add found --cell line3 --at 2026-03-31', ADD, USUAL_DATABASE)
def add(args: argparse.Namespace) -> int:
    """Add diagnoses to the history of a cell."""
    from ...history.entry import entry_of, instant
    from ...history.verifications import Verified, put_verified, verified_of

    if args.at and len(args.diagnosis) > 1:
        raise DataError('--at is the date of one diagnosis; add them one by one')
    at = instant(args.at) if args.at else None
    # All are read before the first is written, and all are written or none.
    entries = [verified_of(path, at) or entry_of(path, at) for path in args.diagnosis]

    def written(connection: Connection) -> list[int | None]:
        return [
            put_verified(database, connection, args.cell, entry)
            if isinstance(entry, Verified)
            else database.put(connection, args.cell, entry)
            for entry in entries
        ]

    with opened(args, make=True) as database:
        made = database.write(written)
    for path, entry, number in zip(args.diagnosis, entries, made, strict=True):
        said = 'was there already' if number is None else 'added'
        print(f'{args.cell}: {path}, {entry.at.date()}, {entry.status}: {said}')
    return 0


@job(
    'weld-twin history show --cell line3',
    '--cell NAME              left out: list the cells',
    USUAL_DATABASE,
)
def show(args: argparse.Namespace) -> int:
    """Show the diagnoses of a cell, or which cells there are."""
    from rich.console import Console

    from ...history.verifications import verifications

    with opened(args) as database:
        if not args.cell:
            print('\n'.join(database.cells()) or 'no cell yet')
            return 0
        entries = database.entries(args.cell)
        verified = verifications(database, args.cell)
    console = Console(highlight=False, width=WIDTH)
    console.print(_diagnoses(entries))
    if verified:
        console.print(_verified(verified))
    return 0


def _diagnoses(entries: list[Entry]) -> Table:
    from rich.table import Table

    from ...history.words import HEADS, row

    table = Table(*HEADS, box=None)
    for entry in entries:
        table.add_row(*row(entry))
    return table


def _verified(result: list[Verified]) -> Table:
    """Return what was measured after corrections, a row each."""
    from rich.table import Table

    from weld_twin_nodes.wording.quantities import millimetres
    from weld_twin_nodes.wording.words import cause

    table = Table('measured again', 'promise', 'promised', 'measured', 'did not go away', box=None)
    for at, _, content in result:
        still = [
            cause(site['effect'], site['joint'])
            for item in content['causes']
            if item['state'] not in ('gone', 'open')
            for site in item['sites']
        ]
        table.add_row(
            at.date().isoformat(),
            'kept' if content['kept'] else 'not kept',
            *(millimetres(content[key]['rms_m']) for key in ('promised', 'measured')),
            ', '.join(still),
        )
    return table


@job('weld-twin history changed --cell line3 --since 2026-03-31', CHANGED, USUAL_DATABASE)
def changed(args: argparse.Namespace) -> int:
    """Say what changed, since when, and where it leads.

    A change is told where it is more than chance: one false alarm in a year of weekly looks.
    """
    from weld_twin_nodes.wording.quantities import counted

    from ...history import observations
    from ...history.entry import instant
    from ...history.words import (
        DAY,
        as_dict,
        changed,
        forecast,
        forecast_sentence,
        sentence,
        since,
    )

    limits = _limits(args.limit)
    with opened(args) as database:
        entries = database.entries(args.cell)
    seen = observations(entries)
    day = instant(args.since).timestamp() / DAY if args.since else None
    everything = changed(entries, seen)
    result = since(everything, day)
    ahead = [forecast(change, seen, everything, limits) for change in result]
    if args.json:
        rows = [
            {**as_dict(change), 'forecast': reported}
            for change, reported in zip(result, ahead, strict=True)
        ]
        print(json.dumps({'cell': args.cell, 'diagnoses': len(seen), 'changes': rows}, indent=2))
        return 0
    if not result:
        many = counted(len(seen), 'diagnosis', 'diagnoses')
        print(f'{args.cell}: nothing changed by more than chance in {many}')
    for change, reported in zip(result, ahead, strict=True):
        print(f'{args.cell}: {sentence(change)}')
        if reported is not None:
            print(f'{args.cell}: {forecast_sentence(change, reported)}')
    return 0


def _limits(given: Sequence[str]) -> dict[str, float]:
    out = {}
    for text in given:
        effect, value = pair(text, '--limit', 'EFFECT=VALUE, such as backlash=0.0017')
        try:
            out[effect] = float(value)
        except ValueError:
            raise DataError(f"--limit: '{value}' is no number") from None
        refuse_unknown_effect('--limit', effect)
    return out


@job(
    'weld-twin history run examples/files/cells.csv --db plant.db',
    'LIST                     table of recordings',
    DATABASE,
    POOL,
    RUN,
)
def run(args: argparse.Namespace) -> int:
    """Diagnose the recordings of a list into a database.

    LIST is a table of text with commas and a first line of names: cell, recording and robot, and
    where they are needed at, align, effects_known, base_link, tip_link, contacts and apply. Paths are
    relative to the list. What is in the database already is not run again, so a run that was stopped
    goes on. A recording that cannot be read, or takes too much, is told and harms no other.
    """
    from ...fleet import read_list, run_fleet
    from ...guarded import Limits
    from ...history.runs import FAILED, REFUSED

    if args.memory < 1.0 or args.minutes <= 0.0:
        raise DataError('--memory takes 1 GB or more, --minutes more than none')
    listed = read_list(args.list)
    wall = max(round(60.0 * args.minutes), 1)
    limits = Limits(memory=round(args.memory * GIGABYTE), cpu_s=wall, wall_s=wall)
    keep = Path(args.keep) if args.keep else None
    with opened(args, make=True) as database, closing(_pool(args)) as pool, _progress() as tell:
        tally = run_fleet(listed, database, pool, limits, keep=keep, again=args.again, tell=tell)
    said = ', '.join(f'{count} {state}' for state, count in sorted(tally.items()))
    print(f'{args.list}: {said}')
    return TROUBLED if tally.keys() & {REFUSED, FAILED} else 0


def _pool(args: argparse.Namespace) -> Pool:
    from weld_twin_nodes.offline.task_pool import Cluster

    from ...fleet.running import Threads

    return Cluster(args.scheduler) if args.scheduler else Threads(args.workers)


@contextmanager
def _progress() -> Iterator[Tell]:
    """Yield where to tell how far it is: a bar on a terminal, and a line for each trouble."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

    from ...history.runs import DONE

    console = Console(stderr=True, highlight=False, soft_wrap=True)
    columns = ('diagnosing', BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal) as progress:
        bar = progress.add_task('diagnosing', total=None)

        def tell(done: int, total: int, run: Run | None) -> None:
            progress.update(bar, completed=done, total=total)
            if run is not None and run.state != DONE:
                said = f'{run.cell}: {run.recording}: {run.state}: {run.sentence}'
                progress.console.print(said, markup=False)

        yield tell


@job(
    'weld-twin history page --db plant.db --out plant',
    DATABASE,
    folder_output('directory for the pages'),
)
def page(args: argparse.Namespace) -> int:
    """Write a page that ranks cells, and one for each cell."""
    from weld_twin_msgs_py.files.whole_files import write_text
    from weld_twin_nodes.offline.content_hash import digest
    from weld_twin_nodes.wording.quantities import counted

    from ...fleet.cell_page import page_of
    from ...fleet.ranking_page import ranking_page

    def file(cell: str) -> str:
        return f'cell_{digest(cell)[:16]}.html'

    with opened(args) as database, output(args, INDEX) as place:
        cells = database.cells()
        for cell in cells:
            write_text(place / file(cell), page_of(database, cell, INDEX))
        write_text(place / INDEX, ranking_page(database, file))
    print(f'{args.out}/{INDEX}: {counted(len(cells), "cell")}')
    return 0


JOBS = jobs(add, show, changed, run, page)
