# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The option that names the database of the history, and the database."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from weld_twin_nodes.cli.parsing import Adder

if TYPE_CHECKING:
    from weld_twin_report.history import Database

DATABASE = 'weld_twin_history.db'


def add_database(parser: argparse.ArgumentParser) -> None:
    """Add the option that names the database."""
    text = (
        'an SQLite file, or a URL such as postgresql+psycopg://user@host/name (default: {default})'
    )
    Adder(parser)('--db', 'URL', text, default=DATABASE)


@contextmanager
def opened(args: argparse.Namespace, *, make: bool = False) -> Iterator[Database]:
    """Yield the database of the options; ``make`` it where there is none yet."""
    from weld_twin_report.history import Database

    database = Database(args.db, make=make)
    try:
        yield database
    finally:
        database.close()
