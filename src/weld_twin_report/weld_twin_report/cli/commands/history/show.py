# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Show the diagnoses of a cell, or which cells there are."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from weld_twin_nodes.cli.parsing import Adder

from .database_options import add_database, opened

if TYPE_CHECKING:
    from rich.table import Table

    from weld_twin_report.history import Entry
    from weld_twin_report.history.verifications import Verified

WIDTH = 100
"""Columns of the table, whatever the terminal has."""

EXAMPLE = 'weld-twin history show --cell line3'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    Adder(parser)('--cell', 'NAME', 'left out: list the cells')
    add_database(parser)


def run(args: argparse.Namespace) -> int:
    """Print a table."""
    from rich.console import Console

    from weld_twin_report.history.verifications import verifications

    with opened(args) as database:
        if not args.cell:
            print('\n'.join(database.cells()) or 'no cell yet')
            return 0
        entries = database.entries(args.cell)
        verified = verifications(database, args.cell)
    console = Console(highlight=False, width=WIDTH)
    console.print(_table(entries))
    if verified:
        console.print(_verified(verified))
    return 0


def _verified(result: list[Verified]) -> Table:
    """Return what was measured after corrections, a row each."""
    from rich.table import Table

    from weld_twin_nodes.wording.quantities import millimetres
    from weld_twin_nodes.wording.words import cause

    table = Table('measured again', 'promise', 'promised', 'measured', 'did not go away', box=None)
    for at, _, content in result:
        still = [
            cause(site['effect'], site['joint'])
            for item in content['causes']
            if item['state'] not in ('gone', 'open')
            for site in item['sites']
        ]
        table.add_row(
            at.date().isoformat(),
            'kept' if content['kept'] else 'not kept',
            millimetres(content['promised']['rms_m']),
            millimetres(content['measured']['rms_m']),
            ', '.join(still),
        )
    return table


def _table(entries: list[Entry]) -> Table:
    from rich.table import Table

    from weld_twin_nodes.wording.quantities import millimetres, odds
    from weld_twin_nodes.wording.words import cause

    table = Table('recorded', 'status', 'sure', 'gap', 'left', 'causes', box=None)
    for entry in entries:
        causes = [cause(each['effect'], each.get('joint')) for each in entry.effects]
        table.add_row(
            entry.at.date().isoformat(),
            entry.status,
            '' if entry.confidence is None else odds(entry.confidence),
            millimetres(entry.gap_m),
            millimetres(entry.unexplained_m),
            ', '.join(causes),
        )
    return table
