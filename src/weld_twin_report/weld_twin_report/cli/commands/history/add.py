# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Add diagnoses to the history of a cell."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from weld_twin_nodes.cli.parsing import Adder

from .database_options import add_database, opened

if TYPE_CHECKING:
    from sqlalchemy import Connection

EXAMPLE = 'weld-twin history add found --cell line3 --at 2026-03-31'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add = Adder(parser)
    text = 'diagnosis.json, or the directory that diagnose wrote; or what verify wrote'
    add('diagnoses', 'DIAGNOSIS', text, nargs='+')
    add('--cell', 'NAME', 'whose history it is', required=True)
    text = 'when it was recorded, such as 2026-03-31; left out, the stamps of the recording tell'
    add('--at', 'DATE', text)
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
