# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How often the 90 % interval of a share holds the true share, from tables of cases.

A table is what `weld-twin lab belief` keeps: cases.jsonl, held_out.jsonl. Counted are causes that
were named, frames known; of several causes only those whose squares add up to the squared gap.
"""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('tables', nargs='+', metavar='TABLE', help='cases.jsonl and the like')


def run(args: argparse.Namespace) -> int:
    """Count and print."""
    from ...belief.rows import read_rows
    from ...belief.share_cover import cover_table, told_and_true

    rows = [row for table in args.tables for row in read_rows(Path(table))]
    print(cover_table(told_and_true(rows)), end='')
    return 0
