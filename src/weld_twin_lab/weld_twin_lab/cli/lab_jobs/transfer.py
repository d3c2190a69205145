# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings that are poor on purpose: never worse than a plain fit, and never sure and wrong.

Forty splits of two measured arms and a servo axis in motion; docs/transfer.md says where the data
come from. Writes transfer.json, transfer.md and a file per split; a run that was interrupted goes
on where it stopped. Remove the directory to begin anew. Exits with 1 when a goal is missed.
"""

from __future__ import annotations

from pathlib import Path

from ...study import REQUIRED, Study, option, options, study

add_arguments = options(
    option('--ur5', REQUIRED, 'DIR', 'holds grid.csv, random.csv'),
    option('--ur10', REQUIRED, 'DIR', 'holds series_c_random_poses.csv'),
    option('--emps', REQUIRED, 'DIR', 'holds DATA_EMPS.mat'),
    option('--only', '', 'TEXT', 'only splits whose names contain this'),
)


@study
def run(study: Study) -> bool:
    """Judge what is not judged yet, and print the goals."""
    from ...study import head
    from ...transfer.goals import measures
    from ...transfer.study import NAME, PARTS, entries_of
    from ...transfer.tables import goal_table, page

    args = study.args
    study.refuse_foreign(f'{NAME}.json', f'{NAME}.md', PARTS)
    ur5, ur10, emps = (Path(place) for place in (args.ur5, args.ur10, args.emps))
    entries = entries_of(ur5, ur10, emps, args.only, study.parts(PARTS))
    found = measures(entries)
    result = head('transfer/1', measures=[m._asdict() for m in found], splits=entries)
    study.write(NAME, result, page(entries, found), say=False)
    print(goal_table(found))
    return all(m.reached is not False for m in found)
