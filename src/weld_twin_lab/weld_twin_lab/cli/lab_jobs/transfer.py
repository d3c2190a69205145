# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings that are poor on purpose: never worse than a plain fit, and never sure and wrong.

Forty splits of two measured arms and a servo axis in motion; docs/transfer.md says where the data
come from. Writes transfer.json, transfer.md and a file per split; a run that was interrupted goes
on where it stopped. Remove the directory to begin anew. Exits with 1 when a goal is missed.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

from ...study import Study, options, study

OPTIONS = options("""
--ur5 DIR, required   holds grid.csv, random.csv
--ur10 DIR, required  holds series_c_random_poses.csv
--emps DIR, required  holds DATA_EMPS.mat
--only TEXT           only splits whose names contain this
""")


@study
def run(study: Study) -> bool:
    """Judge what is not judged yet, and print the goals."""
    from ...study import head
    from ...transfer.goals import goal_table, measures, page
    from ...transfer.judging import judge
    from ...transfer.servo_axis import judge_axis
    from ...transfer.splits import all_splits

    args, parts = study.args, 'splits'
    study.refuse_foreign('transfer.json', 'transfer.md', parts)
    part = study.parts(parts)
    chosen = [s for s in all_splits(Path(args.ur5), Path(args.ur10)) if args.only in s.name]
    entries = [part(split.name, partial(judge, split)) for split in chosen]
    if args.only in 'servo_axis':
        entries.append(part('servo_axis', partial(judge_axis, Path(args.emps))))
    goals = measures(entries)
    result = head('transfer/1', measures=[m._asdict() for m in goals], splits=entries)
    study.write('transfer', result, page(entries, goals), say=False)
    print(goal_table(goals))
    return all(m.reached is not False for m in goals)
