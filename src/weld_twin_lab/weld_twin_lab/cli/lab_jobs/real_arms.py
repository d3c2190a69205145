# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Real arms that nobody tuned on: which causes are told, and do unseen data bear them out?

Diagnoses some sixty parts of third-party recordings, and takes every kind that is told out of a plain
fit of all kinds: unseen data must get worse. Writes real_arms.json and real_arms.md. Stopped, it
goes on where it was when run again.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..blind_jobs.job_options import add_pool, runner_of

RESULTS, PAGE, STORE = 'real_arms.json', 'real_arms.md', 'done'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        '--data', required=True, metavar='DIR', help='holds ur5_laser_tracker, emps, mukca, ...'
    )
    parser.add_argument(
        '--only', default='', metavar='TEXT', help='only rows whose names contain this'
    )
    add_pool(parser)
    parser.add_argument('--out', required=True, metavar='DIR', help='where results go')


def run(args: argparse.Namespace) -> int:
    """Judge what is not judged yet, write and print the table."""
    from weld_twin_core.errors import DataError
    from weld_twin_nodes.offline.output_directory import write_owned
    from weld_twin_nodes.offline.task_pool import Task

    from ...blind.diagnosing import engine_digest
    from ...parts import write_results
    from ...real_arms.rows import plans
    from ...real_arms.study import judged, summary, table

    out, data = Path(args.out), Path(args.data)
    if not data.is_dir():
        raise DataError(f"'{data}' is no directory; --data names the parent of the recordings")
    names = [plan.name for plan in plans() if args.only in plan.name]
    tasks = [Task(judged, (str(data), name), name) for name in names]
    with runner_of(args, out / STORE / engine_digest()[:8], 'diagnosing') as runner:
        entries = list(runner.run(tasks))
    told = table(entries)
    result = {'summary': summary(entries), 'rows': entries}
    write_results(out / RESULTS, result)
    write_owned(out / PAGE, told)
    print(told, end='')
    return 0
