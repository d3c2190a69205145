# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Explain a real UR5 and a real UR10 that a laser tracker measured, on poses never fitted.

Needs the two published data sets; docs/real_robots.md says where they come from. Writes
results.json, a page per robot (ur5.html, ur10.html) and every diagnosis.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from weld_twin_nodes.cli.options import add_output, output


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('--ur5', required=True, metavar='DIR', help='holds grid.csv, random.csv')
    parser.add_argument(
        '--ur10', required=True, metavar='DIR', help='holds series_c_random_poses.csv'
    )
    add_output(parser, 'where results go')


def run(args: argparse.Namespace) -> int:
    """Diagnose, judge, write, and print one line for each split."""
    import sys

    from ..real_robots.arm_study import RESULTS, study

    def tell(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    with output(args, RESULTS) as place:
        results = study(Path(args.ur5), Path(args.ur10), place, tell)
    for robot in results['robots'].values():
        for name, split in robot['splits'].items():
            got = split['got']
            print(
                f'{name}: mean {got["mean_m"] * 1e3:.4f} mm, max {got["max_m"] * 1e3:.4f} mm, '
                f'goal {"reached" if split["reached"] else "missed"}'
            )
    return 0
