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
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.errors import DataError
from weld_twin_report.history import Database

Rows = dict[str, tuple[Any, ...]]
"""What a database holds of every run, by its key."""
COMPARED = ('cell', 'recording', 'state', 'sentence')
KILLED = (0.5, 6.0)
"""Seconds from the start of a run to its kill, drawn between these: a program starts within two."""
PROFILE = 'distributed.worker.profile.enabled'
"""Dask's setting by which workers look a hundred times a second at what they run; for nothing here."""
PATIENCE = 3600.0
"""Seconds after which a run that is not killed is taken to hang."""


def command(listed: Path, database: str, *words: str) -> list[str]:
    """Return the words of a fleet run."""
    return [
        sys.executable, '-m', 'weld_twin_nodes', 'history', 'run', str(listed), '--db', database, *words,
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
    with database.reading() as connection:
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
        from dask import config
        from distributed import LocalCluster
    except ImportError:
        raise DataError("a cluster needs Dask: pip install 'weld-twin[cluster]'") from None
    with (
        config.set({PROFILE: False}),
        LocalCluster(
            n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None
        ) as made,
    ):
        yield str(made.scheduler_address)


def kills(listed: Path, place: Path, times: int, seed: int) -> dict[str, Any]:
    """
    Kill runs of a list until so many were killed; return what was lost or written twice.

    A list that is done before begins anew with an empty database.

    Parameters
    ----------
    listed : Path
    place : Path
        Directory of the databases.
    times : int
        Kills.
    seed : int

    """
    rng = np.random.default_rng(seed)
    whole = place / 'whole.db'
    timed(listed, _fresh(whole), '--workers', '2')
    expected = rows(str(whole))
    moments: list[float] = []
    lost = differing = lists = 0
    while len(moments) < times:
        found = _killed(listed, _fresh(place / 'killed.db'), rng, times - len(moments))
        lists += 1
        moments += found.moments
        lost += found.lost
        differing += same(rows(str(place / 'killed.db')), expected)
    return {
        'kills': len(moments),
        'lists': lists,
        'rows': len(expected),
        'lost_or_rewritten': lost,
        'differing_rows': differing,
        'moments_s': moments,
    }


class Killed(NamedTuple):
    """A list that was done in spite of kills: their moments, and rows lost or rewritten."""

    moments: list[float]
    lost: int


def _killed(listed: Path, database: str, rng: np.random.Generator, most: int) -> Killed:
    """Run a list to its end, and kill the run at most so often."""
    before: Rows = {}
    moments: list[float] = []
    lost = 0
    while len(moments) < most:
        wait = float(rng.uniform(*KILLED))
        with subprocess.Popen(
            command(listed, database, '--workers', '2'),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        ) as process:
            try:
                process.wait(timeout=wait)
                break  # it was faster
            except subprocess.TimeoutExpired:
                process.kill()
        moments.append(wait)
        after = rows(database, with_cost=True) if Path(database).exists() else {}
        lost += sum(after.get(key) != row for key, row in before.items())
        before = after
    timed(listed, database, '--workers', '2')
    final = rows(database, with_cost=True)
    return Killed(moments, lost + sum(final.get(key) != row for key, row in before.items()))


def _fresh(file: Path) -> str:
    """Return the name of a database that is not there yet."""
    for name in (file, file.with_name(f'{file.name}-wal'), file.with_name(f'{file.name}-shm')):
        name.unlink(missing_ok=True)
    return str(file)


def costs(url: str) -> tuple[float, float, float]:
    """Return medians of what the first and the last third took [s], and the most memory [MB]."""
    database = Database(url)
    runs = database.table('runs')
    query = database.sql.select(runs.c.seconds, runs.c.memory).order_by(runs.c.id)
    with database.reading() as connection:
        found = np.array(connection.execute(query).all(), float).reshape(-1, 2)
    database.close()
    third = max(len(found) // 3, 1)
    first, last = (float(np.median(part)) for part in (found[:third, 0], found[-third:, 0]))
    return first, last, float(found[:, 1].max()) / 1e6


def same(one: Rows, other: Rows) -> int:
    """Return how many rows differ between two databases."""
    keys = one.keys() | other.keys()
    return sum(one.get(key) != other.get(key) for key in keys)
