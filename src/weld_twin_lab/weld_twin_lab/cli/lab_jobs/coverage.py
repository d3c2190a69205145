# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Predictions that say how sure they are: do nine of ten measured positions lie in 90 % regions?

Poor recordings of two measured arms, judged on poses inside and outside of them, and sealed cases
of the plant where they are given. Writes coverage.json, coverage.md and a file per recording; a run
that was interrupted goes on where it stopped.
"""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('--ur5', required=True, metavar='DIR', help='holds grid.csv')
    parser.add_argument(
        '--ur10', required=True, metavar='DIR', help='holds series_c_random_poses.csv'
    )
    parser.add_argument(
        '--cases',
        metavar='DIR',
        help='sealed cases: holds cases and truths, as weld-twin lab blind make writes them',
    )
    parser.add_argument('--out', required=True, metavar='DIR', help='where results go')


def run(args: argparse.Namespace) -> int:
    """Try all regions and print what they hold."""
    import sys

    from ...coverage.study import study
    from ...coverage.table import summary_table

    def tell(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    cases = None if args.cases is None else Path(args.cases)
    result = study(Path(args.ur5), Path(args.ur10), Path(args.out), cases, tell)
    print(summary_table(result['entries']))
    return 0
