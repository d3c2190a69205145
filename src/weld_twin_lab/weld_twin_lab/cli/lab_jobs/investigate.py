# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Investigations: do the experiments that are asked for decide?

Cells of the plant with sealed causes are recorded on poor motions. Those that the diagnosis leaves
open, or gets wrong, are investigated: the plant runs what is asked, three experiments and five minutes
at most. Beside it the same minutes are spent on random motion, on a rich motion that is always the same,
and on D-optimal postures. Writes investigate.json, investigate.md and a file per cell; a run that was
interrupted goes on where it stopped.
"""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('--out', required=True, metavar='DIR', help='where results go')
    parser.add_argument('--seed', type=int, default=1, metavar='N', help='decides the cells')
    parser.add_argument(
        '--cells', type=int, default=120, metavar='N', help='cells that are left open at first'
    )
    parser.add_argument(
        '--alone',
        action='store_true',
        help='leave out what the others come to; a later run without this word adds it',
    )


def run(args: argparse.Namespace) -> int:
    """Investigate what is not done yet, and print the tables."""
    import sys

    from ...experiments.study import TABLE, study

    def tell(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    out = Path(args.out)
    study(out, args.seed, args.cells, tell, alone=args.alone)
    print((out / TABLE).read_text(encoding='utf-8'))
    return 0
