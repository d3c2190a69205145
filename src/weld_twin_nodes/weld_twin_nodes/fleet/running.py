# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A list of recordings diagnosed into a database: resumable, each written once.

Workers diagnose and know nothing of the database. This process writes each result, verdict and
record of the run, in one transaction, and what is written is not asked for again. So a kill at any
instant costs what was running then, and nothing else.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from itertools import islice
from pathlib import Path

from ..guarded import Limits
from ..history.database import Database
from ..history.plain_entry import entry
from ..history.runs import Run, Runs
from ..offline.task_pool import Pool, Task
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
    pool: Pool,
    limits: Limits,
    *,
    keep: Path | None = None,
    again: bool = False,
    tell: Tell = lambda done, total, run: None,
) -> dict[str, int]:
    """
    Diagnose what is not in the database yet; return how many came to which state.

    Parameters
    ----------
    listed : sequence of Listed
    database : Database
    pool : Pool
        Where recordings are diagnosed.
    limits : Limits
        Of each of them.
    keep : Path, optional
        Directory for all that ``diagnose`` writes, a folder for each; workers must see it.
    again : bool
        Run what a limit or a crash ended before once more.
    tell : callable

    """
    runs = Runs(database)
    known = runs.finished(again)
    tally: Counter[str] = Counter()
    touched: set[str] = set()
    lines = iter(listed)
    while batch := list(islice(lines, BATCH)):
        tasks = list(_tasks(batch, known, limits, keep))
        if there := len(batch) - len(tasks):
            tally[THERE] += there
            tell(tally.total(), len(listed), None)
        for _, text in pool.run(tasks):
            result = json.loads(text)
            run = Run(**result['run'])
            runs.write(run, entry(result['entry']) if result['entry'] else None)
            tally[run.state] += 1
            if result['entry']:
                touched.add(run.cell)
            tell(tally.total(), len(listed), run)
    for cell in sorted(touched):
        # All its diagnoses may have been refused, as those of another robot.
        if cell in database.cells():
            runs.look(cell)
    return dict(tally)


def _tasks(
    batch: Sequence[Listed], known: set[str], limits: Limits, keep: Path | None
) -> Iterator[Task]:
    """Yield a task for each recording that is not known, and know it."""
    for each in batch:
        key = each.key()
        if key not in known:
            known.add(key)
            yield Task(diagnosed, (each, key, limits, str(keep) if keep else ''), each.recording)
