# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Diagnose the recordings of a list into a database.

LIST is a table of text with commas and a first line of names: cell, recording and robot, and where
they are needed at, align, effects_known, base_link, tip_link, contacts and apply. Paths are relative
to the list. What is in the database already is not run again, so a run that was stopped goes on. A
recording that cannot be read, or takes too much, is told and harms no other.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from weld_twin_nodes.cli.options import add_pool
from weld_twin_nodes.cli.parsing import Adder

from .database_options import opened

if TYPE_CHECKING:
    from weld_twin_nodes.offline.task_pool import Pool
    from weld_twin_report.fleet.running import Tell
    from weld_twin_report.history.runs import Run

TROUBLED = 1
"""Exit code where a recording was refused or failed; those that were unsound have their verdict."""
GIGABYTE = 1_000_000_000
"""Bytes."""

EXAMPLE = 'weld-twin history run examples/files/cells.csv --db plant.db'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add = Adder(parser)
    add('list', 'LIST', 'table of recordings')
    add('--db', 'URL', 'an SQLite file, or postgresql+psycopg://...', required=True)
    add_pool(parser)
    text = 'also keep the page and the model of every recording there'
    add('--keep', 'DIR', text)
    add('--again', 'run once more what a limit or a crash has ended')
    add('--memory', 'GB', 'of each (default: {default})', type=float, default=6.0, rare=True)
    add('--minutes', 'N', 'of each (default: {default})', type=float, default=10.0, rare=True)


def run(args: argparse.Namespace) -> int:
    """Run what is not done yet, print what went wrong and how many went well."""
    from weld_twin_core.errors import DataError
    from weld_twin_report.fleet import read_list, run_fleet
    from weld_twin_report.guarded import Limits
    from weld_twin_report.history.runs import FAILED, REFUSED

    if args.memory < 1.0 or args.minutes <= 0.0:
        raise DataError('--memory takes 1 GB or more, --minutes more than none')
    listed = read_list(args.list)
    wall = max(round(60.0 * args.minutes), 1)
    limits = Limits(memory=round(args.memory * GIGABYTE), cpu_s=wall, wall_s=wall)
    keep = Path(args.keep) if args.keep else None
    with opened(args, make=True) as database, _pool(args) as pool, _progress() as tell:
        tally = run_fleet(listed, database, pool, limits, keep=keep, again=args.again, tell=tell)
    said = ', '.join(f'{count} {state}' for state, count in sorted(tally.items()))
    print(f'{args.list}: {said}')
    return TROUBLED if tally.keys() & {REFUSED, FAILED} else 0


@contextmanager
def _pool(args: argparse.Namespace) -> Iterator[Pool]:
    from weld_twin_nodes.offline.task_pool import Cluster
    from weld_twin_report.fleet.threads import Threads

    pool: Pool = Cluster(args.scheduler) if args.scheduler else Threads(args.workers)
    try:
        yield pool
    finally:
        pool.close()


@contextmanager
def _progress() -> Iterator[Tell]:
    """Yield where to tell how far it is: a bar on a terminal, and a line for each trouble."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

    from weld_twin_report.history.runs import DONE

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
