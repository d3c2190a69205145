# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Real arms that nobody tuned on: which causes are told, and do unseen data bear them out?

Diagnoses some sixty parts of third-party recordings, and takes every kind that is told out of a plain
fit of all kinds: unseen data must get worse. Writes real_arms.json, real_arms.md and told.jsonl, a
table that 'lab belief --learn-from' takes. With --poor, forty splits of two arms and a servo axis that
are poor on purpose are judged beside plain fits: poor.json, poor.md, and exit code 1 when a goal is
missed. Stopped, it goes on where it was when run again.
"""

from __future__ import annotations

from pathlib import Path

from ...study import Study, head, options, study

OPTIONS = options(
    """
--data DIR, required  holds ur5_laser_tracker, emps, mukca, ...
--only TEXT           only rows whose names contain this
--poor                judge recordings that are poor on purpose
""",
    pool=True,
)


@study
def run(study: Study) -> bool:
    """Judge what is not judged yet, write and print the table."""
    from weld_twin_core.errors import DataError
    from weld_twin_nodes.offline.task_pool import Task

    from ...belief.rows import write_rows
    from ...real_arms import goals, poor
    from ...real_arms.rows import plans
    from ...real_arms.study import judged, summary, table, taught

    data = study.args.data
    if not Path(data).is_dir():
        raise DataError(f"'{data}' is no directory; --data names the parent of the recordings")
    every = poor.names(data) if study.args.poor else [plan.name for plan in plans()]
    judge = poor.judged if study.args.poor else judged
    tasks = [Task(judge, (data, name), name) for name in every if study.args.only in name]
    entries = study.tasks(tasks, 'diagnosing')
    if study.args.poor:
        measures = goals.measures(entries)
        result = head('transfer/1', measures=[m._asdict() for m in measures], splits=entries)
        study.write('poor', result, goals.page(entries, measures))
        return all(m.reached is not False for m in measures)
    study.write('real_arms', {'summary': summary(entries), 'rows': entries}, table(entries))
    write_rows(study.out / 'told.jsonl', taught(entries))
    return True
