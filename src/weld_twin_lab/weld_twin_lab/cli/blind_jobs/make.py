# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Make cases and seal their truths.

Prints the seal, a hash over all cases and truths; publish it before anybody diagnoses.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from .job_options import add_draw, add_pool, kinds_of, runner_of, spans_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add_draw(parser)
    parser.add_argument('--out', required=True, metavar='DIR', help='where the recordings go')
    parser.add_argument(
        '--truths',
        required=True,
        metavar='DIR',
        help='where the truths go; keep it where a diagnosis cannot read',
    )
    add_pool(parser)


def run(args: argparse.Namespace) -> int:
    """Make the cases and print the seal."""
    from ...blind.simulator import require_simulator

    require_simulator()
    from ...blind import layout
    from ...blind.making import make

    cases, truths = Path(args.out), Path(args.truths)
    with runner_of(args, truths / layout.DONE, 'making cases') as runner:
        sealed = make(cases, truths, args.seed, args.count, runner, kinds_of(args), spans_of(args))
    print(f'seal {sealed}')
    return 0
