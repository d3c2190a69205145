# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Do springs by measured efforts predict a real arm better than springs by the model's statics?

Leaves out stretches of time in turn, diagnoses the rest with and without efforts, and judges both on
the stretch, beside plain fits of frames and geometry. Writes efforts.md.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

PAGE = 'efforts.md'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    from weld_twin_nodes.cli.options import add_robot

    parser.add_argument('table', metavar='TABLE', help='stations with measured poses and efforts')
    add_robot(parser)
    parser.add_argument('--folds', type=int, default=5, metavar='N', help='stretches (default: 5)')
    parser.add_argument('--out', required=True, metavar='DIR', help='where the table goes')


def run(args: argparse.Namespace) -> int:
    """Judge every stretch, write and print the table."""
    from weld_twin_core.errors import ModelError
    from weld_twin_msgs_py.tables import read_table
    from weld_twin_nodes.cli.options import robot_of
    from weld_twin_nodes.offline.output_directory import write_owned

    from ...real_arms.by_effort import folds, table

    if args.folds < 2:
        raise ModelError(f'--folds {args.folds}: give two stretches or more')
    robot = robot_of(args)
    recording = read_table(args.table, robot).recording
    done = folds(recording, robot, args.folds, lambda text: print(text, file=sys.stderr))
    page = table(recording.name, done)
    write_owned(Path(args.out) / PAGE, page)
    print(page, end='')
    return 0
