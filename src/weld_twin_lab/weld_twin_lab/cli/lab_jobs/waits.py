# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What people wait for: whole commands started cold, beside those of another checkout.

Runs each command here and there in turn. Ratios of pairs count: the machine's own speed drifts.
Writes waits.json and waits.md. With --only, the other rows of a waits.json in --out stay as they
are; every row says when and with which versions it was measured.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ...benchmark.waiting import Entry

WAITS = 'waits.json'


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
    import sys
    from tempfile import TemporaryDirectory

    from ...benchmark.waiting import measured, summary

    out = Path(args.out)
    kept = _kept(out / WAITS) if args.only else []
    base = None if args.base is None else Path(args.base)

    def keep(entry: Entry) -> None:
        nonlocal kept
        print(f'{entry["job"]}: {entry}', file=sys.stderr, flush=True)
        kept = _written(out, kept, entry)

    with TemporaryDirectory() as folder:
        measured(base, Path(folder), max(args.runs, 1), args.only, keep)
    print(summary(kept))
    return 0


def _kept(file: Path) -> list[Entry]:
    """Return the rows that were measured before; none where there are none."""
    import json

    from weld_twin_core.errors import DataError

    if not file.exists():
        return []
    try:
        found: list[Entry] = json.loads(file.read_text(encoding='utf-8'))
    except ValueError:
        raise DataError(f"'{file}' is damaged; remove it to measure all jobs anew") from None
    return found


def _written(out: Path, kept: list[Entry], entry: Entry) -> list[Entry]:
    """Write the rows with a new one among them; return them."""
    import json

    from weld_twin_nodes.offline.output_directory import write_owned

    from ...benchmark.waiting import merged, page

    rows = merged(kept, [entry])
    write_owned(out / WAITS, json.dumps(rows, indent=1) + '\n')
    write_owned(out / 'waits.md', page(rows))
    return rows
