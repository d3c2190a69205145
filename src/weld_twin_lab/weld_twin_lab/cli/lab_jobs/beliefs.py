# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What hangs on each tuned number of a diagnosis: every one moved by 25 % both ways.

Diagnoses cases whose truths are known, then decides or diagnoses anew with one number moved at a
time. Writes beliefs.json and beliefs.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path

RESULT, TABLE = 'beliefs.json', 'beliefs.md'
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
    parser.add_argument('--out', required=True, metavar='DIR', help='where the table goes')


def run(args: argparse.Namespace) -> int:
    """Move every number, write the table and print it."""
    import json
    import sys

    from weld_twin_nodes.offline.output_directory import new_directory

    from ...blind.belief_study import study
    from ...blind.belief_table import table

    def tell(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    only = [name for name in args.only.split(',') if name]
    with new_directory(args.out, mark=RESULT) as place:
        result = study(Path(args.cases), Path(args.truths), args.refit, only, tell)
        (place / RESULT).write_text(json.dumps(result, indent=1) + '\n', encoding='utf-8')
        (place / TABLE).write_text(table(result), encoding='utf-8')
    print(table(result))
    return 0
