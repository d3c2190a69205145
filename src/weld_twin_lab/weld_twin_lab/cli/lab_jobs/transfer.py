# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings that are poor on purpose: never worse than a plain fit, and never sure and wrong.

Forty splits of two measured arms and a servo axis in motion; docs/transfer.md says where the data
come from. Writes transfer.json, transfer.md and a file per split; a run that was interrupted goes
on where it stopped. Remove the directory to begin anew. Exits with 1 when a goal is missed.
"""

from __future__ import annotations

import argparse
from pathlib import Path

MISSED = 1
"""Exit code when a measure was not reached."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('--ur5', required=True, metavar='DIR', help='holds grid.csv, random.csv')
    parser.add_argument(
        '--ur10', required=True, metavar='DIR', help='holds series_c_random_poses.csv'
    )
    parser.add_argument('--emps', required=True, metavar='DIR', help='holds DATA_EMPS.mat')
    parser.add_argument('--out', required=True, metavar='DIR', help='where results go')
    parser.add_argument(
        '--only', default='', metavar='TEXT', help='only splits whose names contain this'
    )


def run(args: argparse.Namespace) -> int:
    """Judge what is not judged yet, and print the goals."""
    import sys

    from ...transfer.goals import measures
    from ...transfer.study import study
    from ...transfer.tables import goal_table

    def tell(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    ur5, ur10, emps, out = (Path(place) for place in (args.ur5, args.ur10, args.emps, args.out))
    result = study(ur5, ur10, emps, out, args.only, tell)
    found = measures(result['splits'])
    print(goal_table(found))
    return 0 if all(m.reached is not False for m in found) else MISSED
