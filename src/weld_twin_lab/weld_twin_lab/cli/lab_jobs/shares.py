# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How often the 90 % interval of a share holds the true share, from tables of cases.

A table is what this job makes with --cases: cases with one, two or three causes, however much they
overlap. Counted are causes that were named rightly, frames known. Stopped, it goes on when run
again.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..blind_jobs.job_options import add_pool, runner_of

TABLE, STORE = 'shares.jsonl', 'done'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('tables', nargs='*', metavar='TABLE', help='tables kept from other runs')
    parser.add_argument(
        '--cases', type=int, default=0, metavar='N', help='look at the first N cases of a seed'
    )
    parser.add_argument('--seed', type=int, default=1, metavar='S', help='their seed')
    parser.add_argument(
        '--causes',
        type=int,
        nargs='+',
        default=[1, 2, 3],
        metavar='K',
        help='only cases with so many causes (default: 1 2 3)',
    )
    add_pool(parser)
    parser.add_argument('--out', metavar='DIR', help=f'where {TABLE} goes; needed with --cases')


def run(args: argparse.Namespace) -> int:
    """Make what is not made yet, count and print."""
    from weld_twin_core.errors import DataError

    from ...belief.rows import read_rows, write_rows
    from ...belief.share_cover import cover_table, told_and_true
    from ...belief.share_trial import rows_of
    from ...blind.simulator import require_simulator

    if bool(args.cases) is not bool(args.out) or not (args.cases or args.tables):
        raise DataError('give tables to read, or --cases with --out, or both')
    rows = [row for table in args.tables for row in read_rows(Path(table))]
    if args.cases:
        require_simulator()
        out = Path(args.out)
        with runner_of(args, out / STORE, 'diagnosing') as runner:
            made = rows_of(args.seed, args.cases, runner, args.causes)
        write_rows(out / TABLE, made)
        rows += made
    print(cover_table(told_and_true(rows)), end='')
    return 0
