# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What an engine says of cells with one to six causes, beside what other engines said.

Draws sealed cells, diagnoses them with the engine at hand and keeps its answers in a small table.
Tables of other engines, made by the same command on their code, are set beside it. Stopped, it goes
on where it was when run again.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...study import Study, options, require_simulator, study

TABLE, GROWING = 'answers.jsonl', 'growing'

OPTIONS = options(
    """
--cases N                diagnose the first N cells of a seed [default: 0]
--seed N                 their seed [default: 1]
--beside NAME=TABLE ...  tables that other engines made of the same cells
--growing                diagnose every cell with one to four recordings, and in reverse: does more
  data hurt?
""",
    out='where everything goes',
    pool=True,
)


@study
def run(study: Study) -> None:
    """Make what is not made yet, score, write and print the page."""
    from weld_twin_core.errors import DataError

    from ...belief.baseline import page
    from ...belief.rows import read_rows, write_rows

    if study.args.growing:
        _growing(study)
        return
    tables = {}
    for item in study.args.beside:
        name, _, table = item.partition('=')
        if not table:
            raise DataError(f'--beside takes NAME=TABLE, got {item!r}')
        tables[name] = read_rows(Path(table))
    if study.args.cases:
        tables['this engine'] = _answers(study)
        write_rows(study.out / TABLE, tables['this engine'])
    if not tables:
        raise DataError('there is nothing to score; give --cases, or --beside, or both')
    study.write('baseline', page=page(tables))


def _answers(study: Study) -> list[dict[str, Any]]:
    """Return what the engine at hand answers."""
    from weld_twin_nodes.offline.task_pool import Task

    from ...belief.baseline import brief
    from ...belief.mix import SEVERAL
    from ...belief.trial import tried

    require_simulator()
    args = study.args
    tasks = [Task(tried, (args.seed, k, SEVERAL), f'cell {k}') for k in range(args.cases)]
    return [brief(row) for row in study.tasks(tasks, 'diagnosing')]


def _growing(study: Study) -> None:
    """Diagnose every cell with more and more recordings, and write and print what that did."""
    from weld_twin_core.errors import DataError
    from weld_twin_nodes.offline.task_pool import Task

    from ...belief.growing import grown, page
    from ...belief.rows import write_rows

    args = study.args
    if not args.cases or args.beside:
        raise DataError('--growing takes --cases and no --beside')
    require_simulator()
    tasks = [Task(grown, (args.seed, k), f'cell {k}') for k in range(args.cases)]
    rows = study.tasks(tasks, 'diagnosing')
    write_rows(study.out / f'{GROWING}.jsonl', rows)
    study.write(GROWING, page=page(rows))
