# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Investigations: do the experiments that are asked for decide?

Cells of the plant with sealed causes are recorded on poor motions. Those that the diagnosis leaves
open, or gets wrong, are investigated: the plant runs what is asked, three experiments and five minutes
at most. Beside it the same minutes are spent on random motion, on a rich motion that is always the same,
and on D-optimal postures. Writes investigate.json and investigate.md; a run that was interrupted goes on
where it stopped, and one with --minutes writes what there is after so long.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..blind_jobs.job_options import add_pool, runner_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('--out', required=True, metavar='DIR', help='where results go')
    parser.add_argument('--seed', type=int, default=1, metavar='N', help='decides the cells')
    parser.add_argument(
        '--cells', type=int, default=120, metavar='N', help='cells that are left open at first'
    )
    parser.add_argument(
        '--alone', action='store_true', help='leave out what the minutes come to otherwise'
    )
    parser.add_argument(
        '--minutes',
        type=float,
        default=float('inf'),
        metavar='M',
        help='begin no further cells after so many minutes, and write what there is',
    )
    add_pool(parser)


def run(args: argparse.Namespace) -> int:
    """Investigate what is not done yet, and print the tables."""
    import sys

    from ...blind.diagnosing import engine_digest
    from ...experiments.study import PARTS, TABLE, study

    def tell(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    out = Path(args.out)
    with runner_of(args, out / PARTS, 'investigating') as runner:
        study(
            out,
            args.seed,
            args.cells,
            runner,
            engine_digest(),
            tell,
            alone=args.alone,
            minutes=args.minutes,
        )
    print((out / TABLE).read_text(encoding='utf-8'))
    return 0
