# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A list of recordings diagnosed into a database: resumable, each written once.

Workers diagnose and know nothing of the database. This process writes each result, verdict and
record of the run, in one transaction, and what is written is not asked for again. So a kill at any
instant costs what was running then, and nothing else. What a database cannot take now is kept, and
written as soon as it can.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from contextlib import suppress
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

from weld_twin_core.errors import DataError
from weld_twin_nodes.offline.task_pool import Pool, Task, available_cores, call

from ..guarded import Guarded, Limits
from ..history import Unavailable
from ..history.database import Database
from ..history.entry import Entry
from ..history.runs import DONE, FAILED, Run, Runs
from .listed import Listed
from .one_recording import diagnosed

BATCH = 256
"""Recordings given to the pool at once; a list of a hundred thousand is not held there whole."""
THERE = 'there already'
"""Counted apart: what was written before, or stands in the list twice."""
Tell = Callable[[int, int, Run | None], None]
"""Told how many recordings are done, how many there are, and what the last one came to."""


def run_fleet(
    listed: Sequence[Listed],
    database: Database,
    pool: Pool,  # where recordings are diagnosed
    limits: Limits,  # of each of them
    *,
    # Directory for all that ``diagnose`` writes, a folder for each; workers must see it.
    keep: Path | None = None,
    again: bool = False,  # run what a limit or a crash ended before once more
    tell: Tell = lambda done, total, run: None,
) -> dict[str, int]:
    """Diagnose what is not in the database yet; return how many came to which state."""
    writing = _Writing(Runs(database))
    known = writing.runs.finished(again)
    tally: Counter[str] = Counter()

    def told(written: Iterable[Run | None]) -> None:
        for run in written:
            tally[THERE if run is None else run.state] += 1
            tell(tally.total(), len(listed), run)

    lines = iter(listed)
    while batch := list(islice(lines, BATCH)):
        tasks = list(_tasks(batch, known, limits, keep))
        if there := len(batch) - len(tasks):
            tally[THERE] += there
            tell(tally.total(), len(listed), None)
        for _, text in pool.run(tasks):
            told(writing.take(json.loads(text)))
    told(writing.last())
    for cell in sorted(writing.touched):
        with suppress(DataError):  # pages work it out again, and tell what is wrong with a cell
            writing.runs.look(cell)
    return dict(tally)


class _Writing:
    """
    Writes results one by one; what the database cannot take now waits.

    Attributes
    ----------
    touched : set of str
        Cells that have a new diagnosis.

    """

    def __init__(self, runs: Runs) -> None:
        self.runs = runs
        self.touched: set[str] = set()
        self._waiting: list[tuple[Run, Entry | None]] = []

    def take(self, result: Mapping[str, Any]) -> Iterator[Run | None]:
        """Write a result, and those that wait; yield what was written, None for what was there."""
        before = len(self._waiting)
        reported = Entry.of_plain(result['entry']) if result['entry'] else None
        self._waiting.append((Run(**result['run']), reported))
        # Once patience was in vain, results do not each wait for it again.
        yield from self._write(None if before == 0 else 0.0)

    def last(self) -> Iterator[Run | None]:
        """Write what still waits; what the database does not take now has failed, and can run again."""
        try:
            yield from self._write(None, quiet=False)
        except Unavailable as error:
            for run, _ in self._waiting:
                said = f'diagnosed, but not written; run it again: {error}'
                yield replace(run, state=FAILED, sentence=said)

    def _write(self, patience: float | None, *, quiet: bool = True) -> Iterator[Run | None]:
        while self._waiting:
            run, reported = self._waiting[0]
            try:
                written = self.runs.write(run, reported, patience)
            except Unavailable:
                if quiet:
                    return
                raise
            del self._waiting[0]
            if written is not None and written.state == DONE:
                self.touched.add(run.cell)
            yield written


def _tasks(
    batch: Sequence[Listed], known: set[str], limits: Limits, keep: Path | None
) -> Iterator[Task]:
    """Yield a task for each recording that is not known, and know it."""
    for each in batch:
        key = each.key()
        if key not in known:
            known.add(key)
            yield Task(diagnosed, (each, key, limits, str(keep) if keep else ''), each.recording)


class Threads:
    """
    Runs tasks that let a process do their work.

    Parameters
    ----------
    workers : int
        0 means one for every core.

    """

    def __init__(self, workers: int = 0) -> None:
        if workers < 0:
            raise DataError(f'the number of workers must not be negative, got {workers}')
        self._pool = ThreadPoolExecutor(workers or available_cores())

    def run(self, tasks: Sequence[Task]) -> Iterator[tuple[int, str]]:
        """Yield the number of each task and its result, in order of completion."""
        futures: dict[Future[str], int] = {
            self._pool.submit(call, task.function, task.arguments): k
            for k, task in enumerate(tasks)
        }
        for future in as_completed(futures):
            yield futures.pop(future), future.result()

    def close(self) -> None:
        """Begin nothing more, and end what runs."""
        self._pool.shutdown(wait=False, cancel_futures=True)
        Guarded.end_all()
        self._pool.shutdown()
