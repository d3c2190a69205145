# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Time the pages of cells over a database of many diagnoses, on SQLite and on PostgreSQL.

The diagnoses are made up. Where PostgreSQL is not installed, the last line says so.
"""

from __future__ import annotations

from ...study import Study, option, options, study

add_arguments = options(
    option('--cells', 200, 'N', 'cells in the database (default: 200)'),
    option('--diagnoses', 50, 'N', 'of every cell'),
    out='directory for pages.md',
)


@study
def run(study: Study) -> bool:
    """Fill the databases, time the pages, write the table."""
    from ...fleet.page_times import GOAL, page_times, table

    cells, diagnoses = study.args.cells, study.args.diagnoses
    rows, lacking = page_times(cells, diagnoses)
    study.write('pages', page=table(rows, cells, diagnoses))
    if lacking:
        print(lacking)
    return all(row.seconds <= GOAL for row in rows if row.is_page)
