# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Promises with an interval: do nine of ten lie in theirs, and how wide are they?

Poor recordings of two measured arms, judged on poses inside and outside of them; cells of the plant,
whose poses are judged where the tool really is, with shrinks, shares and parameters; programs before and
after they are corrected; arms that touched things; wear foretold; plans of a first measurement. Writes
coverage.json and coverage.md; a run that was interrupted goes on where it stopped.
"""

from __future__ import annotations

from ...study import Study, options, study

OPTIONS = options(
    """
--ur5 DIR    holds grid.csv; with --ur10
--ur10 DIR   holds series_c_random_poses.csv
--cases N    the first N sealed cases of a seed [default: 0]
--seams N    seams of every language of programs [default: 0]
--touches N  arms that touch things [default: 0]
--cells N    cells that live through ten years each [default: 0]
--plans N    plans of a first measurement [default: 0]
--seed N     of all that is drawn [default: 1]
""",
    pool=True,
)


@study
def run(study: Study) -> None:
    """Try what is not tried yet, and print what it holds."""
    from weld_twin_core.errors import DataError

    from ...coverage.study import tasks_of
    from ...coverage.table import page
    from ...study import head

    args = study.args
    drawn = args.cases, args.seams, args.touches, args.cells, args.plans
    if bool(args.ur5) is not bool(args.ur10) or not (args.ur5 or any(drawn)):
        raise DataError('give --ur5 and --ur10, or how many of what is to be drawn, or both')
    entries = [e for e in study.tasks(tasks_of(args), 'holding promises') if e is not None]
    study.write('coverage', head('coverage/3', entries=entries), page(entries))
