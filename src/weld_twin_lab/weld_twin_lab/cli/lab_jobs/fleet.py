# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Run a fleet of short recordings on one core, on two, on a cluster of two; and kill it again and again.

The rows of all databases must be the same. What is killed goes on, and must lose and rewrite nothing.
Parts that are done are not run again, so a job that was interrupted goes on. The machine must be quiet.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

RESULT, TABLE = 'fleet.json', 'fleet.md'
MISSED = 1
"""Exit code where rows differ, something was lost, or two workers are not fast enough."""
SPEED = 1.8
"""Two workers beside one, at least."""
MANY, PAPER_CORES = 100_000, 200
"""Recordings and cores of the figure on paper."""
WORKERS = {'one': 1, 'two': 2, 'cluster': 2}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        '--out', required=True, metavar='DIR', help='recordings, databases, result'
    )
    parser.add_argument('--recordings', type=int, default=300, metavar='N', help='0: no timing')
    parser.add_argument('--kills', type=int, default=50, metavar='N', help='0: no kills')
    parser.add_argument(
        '--kill-recordings', type=int, default=30, metavar='N', help='of the run that is killed'
    )
    parser.add_argument('--no-cluster', action='store_true')


def run(args: argparse.Namespace) -> int:
    """Run what is not done yet, compare, write the results, print the table."""
    from weld_twin_nodes.offline.output_directory import write_owned

    from ...fleet.run_pages import fleet_page

    out = Path(args.out)
    (out / 'done').mkdir(parents=True, exist_ok=True)
    result: dict[str, Any] = {}
    if args.recordings:
        result['speed'] = _speed(out, args.recordings, not args.no_cluster)
    if args.kills:
        result['kills'] = _kills(out, args.kill_recordings, args.kills)
    text = fleet_page(result)
    write_owned(out / RESULT, json.dumps(result, indent=1) + '\n')
    write_owned(out / TABLE, text)
    print(text)
    speed, kills = result.get('speed', {}), result.get('kills', {})
    fine = speed.get('differing_rows', 0) == 0 and kills.get('lost_or_rewritten', 0) == 0
    fast = min(speed.get('times_one_worker', {'': SPEED}).values()) >= SPEED
    return 0 if fine and fast and kills.get('differing_rows', 0) == 0 else MISSED


def _once(out: Path, name: str, work: Callable[[], Any]) -> Any:
    """Return what a part came to: what was kept of it, so that an interrupted job goes on."""
    from weld_twin_msgs_py.files.whole_files import write_text

    file = out / 'done' / f'{name}.json'
    if not file.exists():
        print(f'{name} ...', file=sys.stderr, flush=True)
        write_text(file, json.dumps(work()) + '\n', overwrite=True)
    return json.loads(file.read_text(encoding='utf-8'))


def _speed(out: Path, count: int, with_cluster: bool) -> dict[str, Any]:
    from ...fleet.fleet_runs import costs, rows, same
    from ...fleet.made_list import make_list

    print(f'making {count} recordings ...', file=sys.stderr, flush=True)
    listed = make_list(out / 'recordings', count)
    names = ['one', 'two', *(['cluster'] * with_cluster)]
    files = {name: out / f'{name}_{count}.db' for name in names}
    took = {
        name: _once(out, f'{name}_{count}', partial(_part, name, listed, files[name]))
        for name in names
    }
    found = {name: rows(str(file)) for name, file in files.items()}
    first, last, memory = costs(str(files['one']))
    return {
        'recordings': count,
        'seconds': took,
        'times_one_worker': {name: took['one'] / took[name] for name in names[1:]},
        'differing_rows': sum(same(found['one'], found[name]) for name in names[1:]),
        'states': dict(Counter(str(row[2]) for row in found['one'].values())),
        'first_third_s': first,
        'last_third_s': last,
        'memory_mb': memory,
        'paper_hours': MANY * took['one'] / count / PAPER_CORES / 3600,
    }


def _part(name: str, listed: Path, file: Path) -> float:
    """Return how long the list takes in one way, with an empty database [s]."""
    from ...fleet.fleet_runs import cluster, timed

    file.unlink(missing_ok=True)
    if name != 'cluster':
        return timed(listed, str(file), '--workers', str(WORKERS[name]))
    with cluster(WORKERS[name]) as address:
        return timed(listed, str(file), '--scheduler', address)


def _kills(out: Path, count: int, times: int) -> dict[str, Any]:
    from ...fleet.fleet_runs import kills
    from ...fleet.made_list import make_list

    listed = make_list(out / 'recordings', count)
    done: dict[str, Any] = _once(
        out, f'kills_{times}_{count}', lambda: kills(listed, out, times, seed=1)
    )
    return done
