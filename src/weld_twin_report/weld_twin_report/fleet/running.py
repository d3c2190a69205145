# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A list of recordings, a line each, diagnosed into a database: resumable, each written once.

This process writes each result, verdict and record of the run, in one transaction: a kill at any
instant costs what was running then, and nothing else. What a database cannot take now is kept, and
written as soon as it can.
"""

import csv
import json
import shutil
import tempfile
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from contextlib import suppress
from dataclasses import asdict, dataclass, fields, replace
from datetime import datetime
from itertools import islice
from pathlib import Path
from typing import Any

from weld_twin_core import __version__
from weld_twin_core.errors import DataError, TwinError
from weld_twin_msgs_py.files.input_files import hashed
from weld_twin_msgs_py.files.scratch import Scratch
from weld_twin_msgs_py.robots.load import as_file
from weld_twin_nodes.offline.output_directory import new_directory
from weld_twin_nodes.offline.task_pool import Pool, Task, available_cores, call, digest

from ..guarded import Guarded, Limits, Outcome
from ..history import Unavailable, entry_of
from ..history.database import Database
from ..history.entry import Entry, instant
from ..history.runs import DONE, FAILED, REFUSED, UNSOUND, Run, Runs
from ..history.schema import not_a_cell
from ..report.diagnosis_files import RESULT

LONGEST = 1_000_000
"""Lines of a list; ten weeks of a hundred thousand cells."""
NEEDED = ('cell', 'recording', 'robot')
PATHS = ('recording', 'effects_known', 'contacts')
"""Columns that name files; relative to the folder of the list."""
YES = {'yes': True, 'true': True, '1': True, 'no': False, 'false': False, '0': False, '': False}


@dataclass(frozen=True)
class Listed:
    """One line of the list; every attribute is a column, and an option of ``diagnose``."""

    cell: str
    recording: str
    robot: str
    at: str = ''  # when it was recorded, ISO 8601; empty where the stamps are dates
    align: str = ''
    effects_known: str = ''
    base_link: str = ''
    tip_link: str = ''
    contacts: str = ''  # empty for none
    apply: bool = False  # whether a mistake in data or set-up is corrected

    @property
    def date(self) -> datetime | None:
        """Return the instant that `at` names, UTC where it does not say; None for none."""
        return instant(self.at) if self.at else None

    def words(self, out: Path) -> list[str]:
        """Return the words of the command that diagnoses it."""
        words = ['diagnose', self.recording, '--robot', self.robot, '--out', str(out)]
        for name in ('align', 'effects_known', 'base_link', 'tip_link', 'contacts'):
            if value := getattr(self, name):
                words += [f'--{name.replace("_", "-")}', value]
        return words + ['--apply'] * self.apply

    def key(self) -> str:
        """Return what tells this request from any other, content of files included that are there."""
        files = [self.recording, self.robot, self.effects_known, self.contacts]
        contents = [_content(name) for name in files]
        rest = (self.cell, self.at, self.align, self.base_link, self.tip_link, str(self.apply))
        return digest(__version__, *contents, *rest)


def _content(name: str) -> str:
    """Return what tells the content of a file; its name where there is none that can be read."""
    try:
        return hashed('recording', name).sha256 if name and Path(name).exists() else name
    except (OSError, TwinError):
        return name


def read_list(path: Path | str) -> list[Listed]:
    file = Path(path)
    names = [field.name for field in fields(Listed)]
    try:
        with file.open(newline='', encoding='utf-8-sig') as stream:
            rows = csv.DictReader(stream, strict=True)
            heads = list(rows.fieldnames or [])
            _check_heads(file, heads, names)
            out: list[Listed] = []
            for row in rows:
                if len(out) >= LONGEST:
                    raise DataError(f"'{file}' has more than {LONGEST} lines; split it")
                out.append(_line(file, rows.line_num, row))
    except (csv.Error, UnicodeDecodeError) as error:
        raise DataError(f"'{file}' is no table of text with commas: {error}") from None
    if not out:
        raise DataError(f"'{file}' names no recording")
    return out


def _check_heads(file: Path, heads: list[str], names: list[str]) -> None:
    for name in NEEDED:
        if name not in heads:
            raise DataError(f"'{file}' has no column {name!r}; it needs {', '.join(NEEDED)}")
    for name in heads:
        if name not in names:
            raise DataError(
                f"'{file}': column {name!r} is not known; there are {', '.join(names)}"
            )


def _line(file: Path, number: int, row: Mapping[str | None, str | None]) -> Listed:
    if None in row or None in row.values():
        raise DataError(f"'{file}' line {number} has not as many cells as the first line")
    values = {str(name): str(value).strip() for name, value in row.items()}
    for name in NEEDED:
        if not values[name]:
            raise DataError(f"'{file}' line {number} has no {name}")
    if why := not_a_cell(values['cell']):
        raise DataError(f"'{file}' line {number}: {why}")
    for name in PATHS:
        if values.get(name):
            values[name] = str(file.parent / values[name])
    if (file.parent / values['robot']).is_file():
        values['robot'] = str(file.parent / values['robot'])
    else:
        values['robot'] = as_file(values['robot'])
    apply = YES.get(values.pop('apply', '').lower())
    if apply is None:
        raise DataError(f"'{file}' line {number}: apply is yes or no")
    listed = Listed(**values, apply=apply)
    try:
        _ = listed.date
    except DataError as error:
        raise DataError(f"'{file}' line {number}: {error}") from None
    return listed


BATCH = 256
"""Recordings given to the pool at once; a list of a hundred thousand is not held there whole."""
THERE = 'there already'
"""Counted apart: what was written before, or stands in the list twice."""
Tell = Callable[[int, int, Run | None], None]
"""Called with how many recordings are done, how many there are, and what the last one came to."""


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

    def count(written: Iterable[Run | None]) -> None:
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
            count(writing.take(json.loads(text)))
    count(writing.last())
    for cell in sorted(writing.touched):
        with suppress(DataError):  # pages work it out again, and tell what is wrong with a cell
            writing.runs.look(cell)
    return dict(tally)


class _Writing:
    """Writes results one by one; what the database cannot take now waits."""

    def __init__(self, runs: Runs) -> None:
        self.runs = runs
        self.touched: set[str] = set()
        self._waiting: list[tuple[Run, Entry | None]] = []

    def take(self, result: Mapping[str, Any]) -> Iterator[Run | None]:
        """Write a result, and those that wait; yield what was written, None for what was there."""
        before = len(self._waiting)
        entry = Entry.of_plain(result['entry']) if result['entry'] else None
        self._waiting.append((Run(**result['run']), entry))
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
            run, entry = self._waiting[0]
            try:
                written = self.runs.write(run, entry, patience)
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
    """Runs tasks that let a process do their work, so many at once; 0 for every core."""

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
    """Return how a recording went, and its entry; ``keep`` what the command wrote, if anywhere."""
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
        from weld_twin_msgs_py.files.diagnosis_model import read_diagnosis

        faults = read_diagnosis(out / 'diagnosis.json').get('unsound') or []
        return state, (str(faults[0]['sentence']) if faults else 'data or set-up are wrong'), None
    if state != DONE:
        return state, done.said.removeprefix('weld-twin: '), None
    try:
        entry = entry_of(out, listed.date)
    except TwinError as error:
        return REFUSED, str(error).replace(f'{out}/diagnosis.json', listed.recording), None
    return state, entry.status, entry.plain()


def _warm(limits: Limits) -> Guarded:
    """Return this thread's own warm process; it ends with the thread's process."""
    known: tuple[Limits, Guarded] | None = getattr(_mine, 'warm', None)
    if known is None or known[0] != limits:
        if known is not None:
            known[1].close()
        known = _mine.warm = (limits, Guarded(limits))
    return known[1]
