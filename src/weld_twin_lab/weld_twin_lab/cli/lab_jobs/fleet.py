# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Run a fleet of short recordings on one core, on two, on a cluster of two; and kill it again and again.

The rows of all databases must be the same. What is killed goes on, and must lose and rewrite nothing.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

RESULT = 'fleet.json'
MISSED = 1
"""Exit code where rows differ, something was lost, or two workers are not fast enough."""
SPEED = 1.8
"""Two workers beside one, at least."""
MANY = 100_000
"""Recordings of the figure on paper."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        '--out', required=True, metavar='DIR', help='recordings, databases, result'
    )
    parser.add_argument('--recordings', type=int, default=300, metavar='N', help='0: no timing')
    parser.add_argument('--kills', type=int, default=50, metavar='N', help='0: no kills')
    parser.add_argument(
        '--kill-recordings', type=int, default=60, metavar='N', help='of the run that is killed'
    )
    parser.add_argument('--no-cluster', action='store_true')


def run(args: argparse.Namespace) -> int:
    """Run, compare, write the result."""
    from weld_twin_msgs_py.files.whole_files import write_text

    out = Path(args.out)
    out.mkdir(parents=True, exist_ok=True)
    result: dict[str, Any] = {}
    if args.recordings:
        result['speed'] = _speed(out, args.recordings, not args.no_cluster)
    if args.kills:
        result['kills'] = _kills(out, args.kill_recordings, args.kills)
    text = json.dumps(result, indent=1)
    write_text(out / RESULT, text + '\n', overwrite=True)
    print(text)
    speed, kills = result.get('speed', {}), result.get('kills', {})
    fine = speed.get('differing_rows', 0) == 0 and kills.get('lost_or_rewritten', 0) == 0
    fast = min(speed.get('times_one_worker', {'': SPEED}).values()) >= SPEED
    return 0 if fine and fast and kills.get('differing_rows', 0) == 0 else MISSED


def _speed(out: Path, count: int, with_cluster: bool) -> dict[str, Any]:
    from ...fleet.fleet_runs import cluster, rows, same, timed
    from ...fleet.made_list import make_list

    listed = make_list(out / 'recordings', count)
    names = ['one', 'two', *(['cluster'] * with_cluster)]
    files = {name: out / f'{name}.db' for name in names}
    for file in files.values():
        file.unlink(missing_ok=True)
    took = {
        name: timed(listed, str(files[name]), '--workers', str(k + 1))
        for k, name in enumerate(names[:2])
    }
    if with_cluster:
        with cluster(2) as address:
            took['cluster'] = timed(listed, str(files['cluster']), '--scheduler', address)
    found = {name: rows(str(file)) for name, file in files.items()}
    each = took['one'] / count
    return {
        'recordings': count,
        'seconds': took,
        'times_one_worker': {name: took['one'] / took[name] for name in names[1:]},
        'differing_rows': sum(same(found['one'], found[name]) for name in names[1:]),
        'seconds_each': each,
        'paper_hours_for_100000_on_200_cores': MANY * each / 200 / 3600,
        'memory_mb': _memory(files['two']),
    }


def _memory(file: Path) -> float:
    """Return the most that a recording needed [MB]."""
    from weld_twin_nodes.history import Database

    database = Database(str(file))
    query = database.sql.select(database.sql.func.max(database.table('runs').c.memory))
    with database.transaction() as connection:
        found = connection.execute(query).scalar_one()
    database.close()
    return float(found or 0) / 1e6


def _kills(out: Path, count: int, times: int) -> dict[str, Any]:
    from ...fleet.fleet_runs import kills, rows, same, timed
    from ...fleet.made_list import make_list

    listed = make_list(out / 'recordings', count)
    killed, whole = out / 'killed.db', out / 'whole.db'
    for file in (killed, whole):
        file.unlink(missing_ok=True)
    found = kills(listed, str(killed), times, seed=1)
    timed(listed, str(whole), '--workers', '2')
    found['differing_rows'] = same(rows(str(killed)), rows(str(whole)))
    return found
