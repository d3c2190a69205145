# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Add diagnoses to the history of a cell; what is in it already is left as it is."""

from __future__ import annotations

import argparse

from . import add_database, date_of, opened


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
    from weld_twin_nodes.history import entry_of
    from weld_twin_nodes.history.verifications import Verified, add_verified, verified_of

    if args.at and len(args.diagnoses) > 1:
        raise DataError('--at is the date of one diagnosis; add them one by one')
    at = date_of(args.at) if args.at else None
    # All are read before the first is written, so that a bad one leaves nothing half done.
    entries = [verified_of(path, at) or entry_of(path, at) for path in args.diagnoses]
    with opened(args) as database:
        for path, entry in zip(args.diagnoses, entries, strict=True):
            if isinstance(entry, Verified):
                new = add_verified(database, args.cell, entry)
                what = 'promise kept' if entry.content['kept'] else 'promise not kept'
            else:
                new, what = database.add(args.cell, entry), entry.status
            said = 'added' if new else 'was there already'
            print(f'{args.cell}: {path}, {entry.at.date()}, {what}: {said}')
    return 0
