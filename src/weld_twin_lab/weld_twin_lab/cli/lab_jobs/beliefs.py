# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What hangs on each tuned number of a diagnosis: every one moved by 25 % both ways.

Diagnoses cases whose truths are known, then decides or diagnoses anew with one number moved at a
time. Writes beliefs.json and beliefs.md. Stopped, it goes on where it was when run again.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..blind_jobs.job_options import add_pool, runner_of

RESULT, TABLE, STORE = 'beliefs.json', 'beliefs.md', 'done'
REFITTED = 10
"""Cases diagnosed anew for numbers that act before the verdict: some 10 minutes of one core."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('cases', metavar='DIR', help='cases made by blind make')
    parser.add_argument('--truths', required=True, metavar='DIR')
    parser.add_argument(
        '--refit',
        type=int,
        default=REFITTED,
        metavar='N',
        help=f'cases to diagnose anew where a number acts before the verdict (default: {REFITTED})',
    )
    parser.add_argument(
        '--only', default='', metavar='LIST', help='only these numbers, comma-separated'
    )
    add_pool(parser)
    parser.add_argument('--out', required=True, metavar='DIR', help='where the table goes')


def run(args: argparse.Namespace) -> int:
    """Move every number, write the table and print it."""
    import json

    from weld_twin_nodes.offline.output_directory import write_owned

    from ...blind.belief_study import study
    from ...blind.belief_table import table

    out = Path(args.out)
    only = [name for name in args.only.split(',') if name]
    with runner_of(args, out / STORE, 'deciding') as runner:
        result = study(Path(args.cases), Path(args.truths), runner, args.refit, only)
    text = table(result)
    write_owned(out / RESULT, json.dumps(result, indent=1) + '\n')
    write_owned(out / TABLE, text)
    print(text, end='')
    return 0
