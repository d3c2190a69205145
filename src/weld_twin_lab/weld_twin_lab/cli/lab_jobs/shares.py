# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How often the 90 % interval of a share holds the true share, from tables of cases.

A table is what this job makes with --cases: cases with one, two or three causes, however much they
overlap. Counted are causes that were named rightly, frames known. Stopped, it goes on when run
again.
"""

from __future__ import annotations

from pathlib import Path

from ...study import Study, option, options, study

TABLE = 'shares.jsonl'

add_arguments = options(
    option('tables', [], 'TABLE', 'tables kept from other runs', nargs='*'),
    option('--cases', 0, 'N', 'look at the first N cases of a seed'),
    option('--seed', 1, 'S', 'their seed'),
    option(
        '--causes',
        [1, 2, 3],
        'K',
        'only cases with so many causes (default: 1 2 3)',
        type=int,
        nargs='+',
    ),
    option('--out', None, 'DIR', f'where {TABLE} goes; needed with --cases'),
    out='',
    pool=True,
)


@study
def run(study: Study) -> None:
    """Make what is not made yet, count and print."""
    from weld_twin_core.errors import DataError

    from ...belief.rows import read_rows, write_rows
    from ...belief.share_cover import cover_table, told_and_true
    from ...belief.share_trial import rows_of
    from ...blind.simulator import require_simulator

    args = study.args
    if bool(args.cases) is not bool(args.out) or not (args.cases or args.tables):
        raise DataError('give tables to read, or --cases with --out, or both')
    rows = [row for table in args.tables for row in read_rows(Path(table))]
    if args.cases:
        require_simulator()
        with study.runner('diagnosing') as runner:
            made = rows_of(args.seed, args.cases, runner, args.causes)
        write_rows(study.out / TABLE, made)
        rows += made
    print(cover_table(told_and_true(rows)), end='')
