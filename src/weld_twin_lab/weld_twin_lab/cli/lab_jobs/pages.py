# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Time the pages of cells over a database of many diagnoses, on SQLite and on PostgreSQL.

The diagnoses are made up. Where PostgreSQL is not installed, the last line says so.
"""

from __future__ import annotations

import argparse
from pathlib import Path

TABLE = 'pages.md'
MISSED = 1
"""Exit code where a page takes longer than a second."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('--out', required=True, metavar='DIR', help='directory for pages.md')
    parser.add_argument('--cells', type=int, default=200, metavar='N')
    parser.add_argument('--diagnoses', type=int, default=50, metavar='N', help='of every cell')


def run(args: argparse.Namespace) -> int:
    """Fill the databases, time the pages, write the table."""
    from weld_twin_nodes.offline.output_directory import write_owned

    from ...fleet.page_times import GOAL, page_times, table

    rows, lacking = page_times(args.cells, args.diagnoses)
    out = Path(args.out)
    out.mkdir(parents=True, exist_ok=True)
    text = table(rows, args.cells, args.diagnoses)
    write_owned(out / TABLE, text)
    print(text)
    if lacking:
        print(lacking)
    return 0 if all(row.seconds <= GOAL for row in rows if row.is_page) else MISSED
