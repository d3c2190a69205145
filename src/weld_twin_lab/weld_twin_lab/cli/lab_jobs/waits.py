# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What people wait for: whole commands started cold, beside those of another checkout.

Runs each command here and there in turn. Ratios of pairs count: the machine's own speed drifts.
Writes waits.json and waits.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        '--base', metavar='DIR', help='another checkout, after make setup; left out, only this'
    )
    parser.add_argument('--out', required=True, metavar='DIR', help='where results go')
    parser.add_argument(
        '--runs', type=int, default=3, metavar='N', help='pairs of runs (default: %(default)s)'
    )
    parser.add_argument(
        '--only', nargs='+', default=[], metavar='TEXT', help='jobs whose name has one of these'
    )


def run(args: argparse.Namespace) -> int:
    """Measure all jobs and print the table."""
    import json
    import sys
    from tempfile import TemporaryDirectory

    from weld_twin_msgs_py.files.whole_files import write_text

    from ...benchmark.waiting import measured, page, summary

    def tell(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    out = Path(args.out)
    out.mkdir(parents=True, exist_ok=True)
    base = None if args.base is None else Path(args.base)
    with TemporaryDirectory() as folder:
        entries = measured(base, Path(folder), max(args.runs, 1), args.only, tell)
    write_text(out / 'waits.json', json.dumps(entries, indent=1) + '\n')
    write_text(out / 'waits.md', page(entries))
    print(summary(entries))
    return 0
