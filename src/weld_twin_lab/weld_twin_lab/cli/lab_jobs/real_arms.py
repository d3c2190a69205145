# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Real arms that nobody tuned on: which causes are told, and do unseen data bear them out?

Diagnoses some sixty parts of third-party recordings, and takes every kind that is told out of a plain
fit of all kinds: unseen data must get worse. Writes real_arms.json, real_arms.md and told.jsonl, a
table that 'lab belief --learn-from' takes. Stopped, it goes on where it was when run again.
"""

from __future__ import annotations

from pathlib import Path

from ...study import Study, options, study

OPTIONS = options(
    """
--data DIR, required  holds ur5_laser_tracker, emps, mukca, ...
--only TEXT           only rows whose names contain this
""",
    pool=True,
)


@study
def run(study: Study) -> None:
    """Judge what is not judged yet, write and print the table."""
    from weld_twin_core.errors import DataError
    from weld_twin_nodes.offline.task_pool import Task

    from ...belief.rows import write_rows
    from ...real_arms.rows import plans
    from ...real_arms.study import judged, summary, table, taught

    data = Path(study.args.data)
    if not data.is_dir():
        raise DataError(f"'{data}' is no directory; --data names the parent of the recordings")
    names = [plan.name for plan in plans() if study.args.only in plan.name]
    tasks = [Task(judged, (str(data), name), name) for name in names]
    entries = study.tasks(tasks, 'diagnosing')
    study.write('real_arms', {'summary': summary(entries), 'rows': entries}, table(entries))
    write_rows(study.out / 'told.jsonl', taught(entries))
