# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Run a fleet of short recordings on one core, on two, on a cluster of two; and kill it again and again.

The rows of all databases must be the same. What is killed goes on, and must lose and rewrite nothing.
Parts that are done are not run again, so a job that was interrupted goes on. The machine must be quiet.
"""

from __future__ import annotations

from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

from ...study import DONE, Study, option, options, study

SPEED = 1.8
"""Two workers beside one, at least."""
MANY, PAPER_CORES = 100_000, 200
"""Recordings and cores of the figure on paper."""
WORKERS = {'one': 1, 'two': 2, 'cluster': 2}


add_arguments = options(
    option('--recordings', 300, 'N', '0: no timing'),
    option('--kills', 50, 'N', '0: no kills'),
    option('--kill-recordings', 30, 'N', 'of the run that is killed'),
    option('--no-cluster', False, None, 'leave the cluster out'),
    out='recordings, databases, result',
)


@study
def run(study: Study) -> bool:
    """Run what is not done yet, compare, write the results, print the table."""
    from ...fleet.run_pages import fleet_page

    args = study.args
    result: dict[str, Any] = {}
    if args.recordings:
        result['speed'] = _speed(study, args.recordings, not args.no_cluster)
    if args.kills:
        result['kills'] = _kills(study, args.kill_recordings, args.kills)
    study.write('fleet', result, fleet_page(result))
    speed, kills = result.get('speed', {}), result.get('kills', {})
    fine = speed.get('differing_rows', 0) == 0 and kills.get('lost_or_rewritten', 0) == 0
    fast = min(speed.get('times_one_worker', {'': SPEED}).values()) >= SPEED
    return bool(fine and fast and kills.get('differing_rows', 0) == 0)


def _speed(study: Study, count: int, with_cluster: bool) -> dict[str, Any]:
    from ...fleet.fleet_runs import costs, rows, same
    from ...fleet.made_list import make_list

    out, part = study.out, study.parts(DONE)
    study.tell(f'making {count} recordings ...')
    listed = make_list(out / 'recordings', count)
    names = ['one', 'two', *(['cluster'] * with_cluster)]
    files = {name: out / f'{name}_{count}.db' for name in names}
    took = {
        name: part(f'{name}_{count}', partial(_part, name, listed, files[name])) for name in names
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


def _kills(study: Study, count: int, times: int) -> Any:
    from ...fleet.fleet_runs import kills
    from ...fleet.made_list import make_list

    out = study.out
    listed = make_list(out / 'recordings', count)
    return study.parts(DONE)(f'kills_{times}_{count}', lambda: kills(listed, out, times, seed=1))
