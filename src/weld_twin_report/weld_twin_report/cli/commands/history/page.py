# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Write a page that ranks cells, and one for each cell."""

from __future__ import annotations

import argparse

from weld_twin_nodes.cli.options import add_output, output
from weld_twin_nodes.cli.parsing import Adder

from .database_options import opened

INDEX = 'index.html'

EXAMPLE = 'weld-twin history page --db plant.db --out plant'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    text = 'an SQLite file, or postgresql+psycopg://...'
    Adder(parser)('--db', 'URL', text, required=True)
    add_output(parser, 'directory for the pages')


def run(args: argparse.Namespace) -> int:
    """Write the pages."""
    from weld_twin_msgs_py.files.whole_files import write_text
    from weld_twin_nodes.offline.content_hash import digest
    from weld_twin_nodes.wording.quantities import counted
    from weld_twin_report.fleet.cell_page import cell_page, damaged_page
    from weld_twin_report.fleet.ranking_page import ranking_page
    from weld_twin_report.history.database import Damaged

    def file(cell: str) -> str:
        return f'cell_{digest(cell)[:16]}.html'

    with opened(args) as database, output(args, INDEX) as place:
        cells = database.cells()
        for cell in cells:
            try:
                page = cell_page(database, cell, INDEX)
            except Damaged as error:
                page = damaged_page(cell, str(error), INDEX)
            write_text(place / file(cell), page)
        write_text(place / INDEX, ranking_page(database, file))
    print(f'{args.out}/{INDEX}: {counted(len(cells), "cell")}')
    return 0
