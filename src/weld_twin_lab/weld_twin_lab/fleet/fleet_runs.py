# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Fleet runs as programs of their own: timed, on cores and on a cluster, and killed."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.errors import DataError
from weld_twin_nodes.history import Database

Rows = dict[str, tuple[Any, ...]]
"""What a database holds of every run, by its key."""
COMPARED = ('cell', 'recording', 'state', 'sentence')
KILLED = (0.5, 6.0)
"""Seconds from the start of a run, or from its first new row, to its kill; drawn between these."""
PATIENCE = 3600.0
"""Seconds after which a run that is not killed is taken to hang."""


def command(listed: Path, database: str, *words: str) -> list[str]:
    """Return the words of a fleet run."""
    return [
        sys.executable, '-m', 'weld_twin_nodes', 'fleet', 'run', str(listed), '--db', database, *words,
    ]  # fmt: skip


def timed(listed: Path, database: str, *words: str) -> float:
    """Return how long a run takes [s]."""
    began = time.perf_counter()
    done = subprocess.run(
        command(listed, database, *words),
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    if done.returncode not in (0, 1):
        raise DataError(
            f'the fleet run ended with {done.returncode}: {done.stderr.strip()[-300:]}'
        )
    return time.perf_counter() - began


def rows(url: str, *, with_cost: bool = False) -> Rows:
    """
    Return every run with its verdict; with its number and its cost, to see that it was not rewritten.

    Raises
    ------
    DataError
        A key or a diagnosis is there twice.

    """
    database = Database(url)
    runs, verdicts = database.table('runs'), database.table('verdicts')
    query = database.sql.select(runs, verdicts).outerjoin(
        verdicts, verdicts.c.id == runs.c.verdict_id
    )
    with database.transaction() as connection:
        found = connection.execute(query).all()
        count = connection.execute(database.sql.select(database.sql.func.count(verdicts.c.id)))
        diagnoses = int(count.scalar_one())
    database.close()
    runs_columns, verdict_columns = len(runs.c), list(verdicts.c.keys())
    out: Rows = {}
    for row in found:
        run = dict(zip(runs.c.keys(), row[:runs_columns], strict=True))
        told = dict(zip(verdict_columns, row[runs_columns:], strict=True))
        passing = {'id', 'cell_id'}
        kept = [repr(value) for name, value in told.items() if name not in passing]
        cost = (run['id'], run['seconds'], told['id']) if with_cost else ()
        if run['key'] in out:
            raise DataError(f'the run {run["key"]} is there twice')
        out[run['key']] = (*(run[name] for name in COMPARED), *kept, *cost)
    if diagnoses != sum(row[2] == 'done' for row in out.values()):
        raise DataError('there are diagnoses without a run, or twice')
    return out


@contextmanager
def cluster(workers: int) -> Iterator[str]:
    """Yield the address of a Dask cluster on this machine, with one thread for each worker."""
    try:
        from distributed import LocalCluster
    except ImportError:
        raise DataError("a cluster needs Dask: pip install 'weld-twin[cluster]'") from None
    with LocalCluster(
        n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None
    ) as made:
        yield str(made.scheduler_address)


def kills(listed: Path, database: str, times: int, seed: int) -> dict[str, Any]:
    """
    Kill a run again and again, then let it end; return what was lost or written twice.

    Parameters
    ----------
    listed : Path
    database : str
    times : int
        Kills; fewer where the list is done before.
    seed : int

    """
    rng = np.random.default_rng(seed)
    before: Rows = {}
    killed = lost = 0
    moments = []
    while killed < times:
        with subprocess.Popen(
            command(listed, database, '--workers', '2'),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        ) as process:
            wait = float(rng.uniform(*KILLED))
            try:
                process.wait(timeout=wait)
                break  # it was faster
            except subprocess.TimeoutExpired:
                process.kill()
        killed += 1
        moments.append(wait)
        after = rows(database, with_cost=True) if Path(database).exists() else {}
        lost += sum(after.get(key) != row for key, row in before.items())
        before = after
    timed(listed, database, '--workers', '2')
    final = rows(database, with_cost=True)
    lost += sum(final.get(key) != row for key, row in before.items())
    return {'kills': killed, 'lost_or_rewritten': lost, 'rows': len(final), 'moments_s': moments}


def same(one: Rows, other: Rows) -> int:
    """Return how many rows differ between two databases."""
    keys = one.keys() | other.keys()
    return sum(one.get(key) != other.get(key) for key in keys)
