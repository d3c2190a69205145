# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Add diagnoses to the history of a cell; what is in it already is left as it is."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from . import add_database, opened

if TYPE_CHECKING:
    from sqlalchemy import Connection


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        'diagnoses',
        metavar='DIAGNOSIS',
        nargs='+',
        help='diagnosis.json, or the directory that diagnose wrote; or what verify wrote',
    )
    parser.add_argument('--cell', required=True, metavar='NAME', help='whose history it is')
    parser.add_argument(
        '--at',
        metavar='DATE',
        help='when it was recorded, such as 2026-03-31; left out, the stamps of the recording tell',
    )
    add_database(parser)


def run(args: argparse.Namespace) -> int:
    """Add them in the order given."""
    from weld_twin_core.errors import DataError
    from weld_twin_report.history.entry import entry_of, instant
    from weld_twin_report.history.verifications import Verified, put_verified, verified_of

    if args.at and len(args.diagnoses) > 1:
        raise DataError('--at is the date of one diagnosis; add them one by one')
    at = instant(args.at) if args.at else None
    # All are read before the first is written, and all are written or none.
    entries = [verified_of(path, at) or entry_of(path, at) for path in args.diagnoses]

    def written(connection: Connection) -> list[int | None]:
        return [
            put_verified(database, connection, args.cell, entry)
            if isinstance(entry, Verified)
            else database.put(connection, args.cell, entry)
            for entry in entries
        ]

    with opened(args, make=True) as database:
        made = database.write(written)
    for path, entry, number in zip(args.diagnoses, entries, made, strict=True):
        said = 'was there already' if number is None else 'added'
        print(f'{args.cell}: {path}, {entry.at.date()}, {entry.status}: {said}')
    return 0
