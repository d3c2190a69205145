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
import shutil
import tempfile
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from contextlib import suppress
from dataclasses import asdict, replace
from itertools import islice
from pathlib import Path
from typing import Any

from weld_twin_core.errors import DataError, TwinError
from weld_twin_msgs_py.files.scratch import Scratch
from weld_twin_nodes.offline.output_directory import new_directory
from weld_twin_nodes.offline.task_pool import Pool, Task, available_cores, call

from ..guarded import Guarded, Limits, Outcome
from ..history import Unavailable, entry_of
from ..history.database import Database
from ..history.entry import Entry
from ..history.runs import DONE, FAILED, REFUSED, UNSOUND, Run, Runs
from ..report.diagnosis_files import RESULT
from .listed import Listed

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

    workers: 0 means one for every core.
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


STATES = {0: DONE, 2: REFUSED, 3: UNSOUND}
"""By the exit code of ``diagnose``; any other is a failure."""
_mine = threading.local()


def diagnosed(listed: Listed, key: str, limits: Limits, keep: str) -> dict[str, Any]:
    """
    Return how a recording went, and its entry.

    ``key``: of the run. ``keep``: directory for what the command wrote; empty to keep nothing.
    """
    done, entry = Outcome(-1, '', 0.0), None
    try:
        with Scratch(Path(tempfile.gettempdir()), 'weld_twin-fleet-') as place:
            out = place / 'found'
            done = _warm(limits).run(listed.words(out))
            state, sentence, entry = _read(listed, done, out)
            if keep and out.is_dir():
                with new_directory(Path(keep) / key, mark=RESULT, force=True) as kept:
                    shutil.copytree(out, kept, dirs_exist_ok=True)
    except (OSError, DataError) as error:  # the disk is full: this can run again, the others go on
        said = str(error)
        if isinstance(error, OSError):
            where = f" '{error.filename}'" if error.filename else ''
            said = f'{error.strerror or error}{where}'
        state, sentence, entry = FAILED, said, None
    run = Run(key, listed.cell, listed.recording, state, sentence, done.seconds, done.memory)
    return {'run': asdict(run), 'entry': entry}


def _read(listed: Listed, done: Outcome, out: Path) -> tuple[str, str, dict[str, Any] | None]:
    """Return state, sentence and entry of what the command left."""
    state = STATES.get(done.code, FAILED)
    if done.disk_full:
        state = FAILED
    if state == UNSOUND:
        return state, _unsound(out), None
    if state != DONE:
        return state, done.said.removeprefix('weld-twin: '), None
    try:
        entry = entry_of(out, listed.date)
    except TwinError as error:
        return REFUSED, str(error).replace(f'{out}/diagnosis.json', listed.recording), None
    return state, entry.status, entry.plain()


def _unsound(out: Path) -> str:
    """Return what is wrong with data or set-up."""
    from weld_twin_msgs_py.files.diagnosis_model import read_diagnosis

    reported = read_diagnosis(out / 'diagnosis.json').get('unsound') or []
    return str(reported[0]['sentence']) if reported else 'data or set-up are wrong'


def _warm(limits: Limits) -> Guarded:
    """Return this thread's own warm process; it ends with the thread's process."""
    known: tuple[Limits, Guarded] | None = getattr(_mine, 'warm', None)
    if known is None or known[0] != limits:
        if known is not None:
            known[1].close()
        known = _mine.warm = (limits, Guarded(limits))
    return known[1]
