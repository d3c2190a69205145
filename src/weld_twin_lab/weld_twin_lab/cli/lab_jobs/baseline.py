# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What an engine says of cells with one to six causes, beside what other engines said.

Draws sealed cells, diagnoses them with the engine at hand and keeps its answers in a small table.
Tables of other engines, made by the same command on their code, are set beside it. Stopped, it goes
on where it was when run again.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..blind_jobs.job_options import add_pool, runner_of

TABLE, PAGE, STORE = 'answers.jsonl', 'baseline.md', 'done'
GROWING = 'growing'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        '--cases', type=int, default=0, metavar='N', help='diagnose the first N cells of a seed'
    )
    parser.add_argument('--seed', type=int, default=1, metavar='S', help='their seed')
    parser.add_argument(
        '--beside',
        nargs='*',
        default=[],
        metavar='NAME=TABLE',
        help='tables that other engines made of the same cells',
    )
    parser.add_argument(
        '--growing',
        action='store_true',
        help='diagnose every cell with one to four recordings, and in reverse: does more data hurt?',
    )
    parser.add_argument(
        '--without',
        nargs='*',
        default=[],
        metavar='NAME',
        help='take mechanisms of the diagnosis out: what are they worth?',
    )
    add_pool(parser)
    parser.add_argument('--out', required=True, metavar='DIR', help='where everything goes')


def run(args: argparse.Namespace) -> int:
    """Make what is not made yet, score, write and print the page."""
    from weld_twin_core.errors import DataError
    from weld_twin_msgs_py.files.whole_files import write_text
    from weld_twin_nodes.offline.task_pool import Task

    from ...belief.baseline import brief, page
    from ...belief.rows import read_rows, write_rows
    from ...belief.switches import tried_without, without
    from ...belief.trial import SEVERAL
    from ...blind.diagnosing import engine_digest
    from ...blind.simulator import require_simulator

    if args.growing:
        return _growing(args)
    tables = {}
    for item in args.beside:
        name, _, table = item.partition('=')
        if not table:
            raise DataError(f'--beside takes NAME=TABLE, got {item!r}')
        tables[name] = read_rows(Path(table))
    out = Path(args.out)
    if args.cases:
        require_simulator()
        out_of_it = tuple(sorted(args.without))
        with without(out_of_it):  # refuses a name that is none before anything is made
            engine = '-'.join((engine_digest()[:8], *out_of_it))
        tasks = [
            Task(tried_without, (args.seed, k, SEVERAL, out_of_it), f'cell {k}')
            for k in range(args.cases)
        ]
        with runner_of(args, out / STORE / engine, 'diagnosing') as runner:
            tables['this engine'] = [brief(row) for row in runner.run(tasks)]
        write_rows(out / TABLE, tables['this engine'])
    if not tables:
        raise DataError('there is nothing to score; give --cases, or --beside, or both')
    told = page(tables)
    write_text(out / PAGE, told, overwrite=True)
    print(told, end='')
    return 0


def _growing(args: argparse.Namespace) -> int:
    """Diagnose every cell with more and more recordings, and write and print what that did."""
    from weld_twin_core.errors import DataError
    from weld_twin_msgs_py.files.whole_files import write_text
    from weld_twin_nodes.offline.task_pool import Task

    from ...belief.growing import grown, page
    from ...belief.rows import write_rows
    from ...blind.diagnosing import engine_digest
    from ...blind.simulator import require_simulator

    if not args.cases or args.beside:
        raise DataError('--growing takes --cases and no --beside')
    require_simulator()
    out, engine = Path(args.out), engine_digest()[:8]
    tasks = [Task(grown, (args.seed, k), f'cell {k}') for k in range(args.cases)]
    with runner_of(args, out / STORE / GROWING / engine, 'diagnosing') as runner:
        rows = runner.run(tasks)
    write_rows(out / f'{GROWING}.jsonl', rows)
    told = page(rows)
    write_text(out / f'{GROWING}.md', told, overwrite=True)
    print(told, end='')
    return 0
