# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Methods of different make on the same sealed cases, by the same rules.

Has every method answer cases of `weld-twin lab blind make` in a process of its own, and scores the
answers. With --ur5 and --ur10, stations of two measured arms are asked, too. A run that was stopped
goes on: what is in --out is not made again. Remove the directory of a method to have it answer anew.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...study import Study, listed, options, study

if TYPE_CHECKING:
    from weld_twin_core.arrays import Array

    from ...contest.arms import Errors

OPTIONS = options("""
--cases DIR, required   as blind make wrote them
--truths DIR, required  their truths
--first N               only so many cases [default: 0]
--entrants LIST         comma-separated; left out, all
--ur5 DIR               holds grid.csv, random.csv
--ur10 DIR              holds series_c_random_poses.csv
""")


@study
def run(study: Study) -> None:
    """Run the contest and print the tables."""
    from ...contest import arms, course
    from ...contest.entrants import ENTRANTS

    args = study.args
    methods = listed(args.entrants) or list(ENTRANTS)
    course.loaded(methods)
    content, table = _sealed(study, methods)
    errors, measured = _arms(study, methods) if args.ur5 and args.ur10 else ({}, {})
    content['arms_mean_m'] = errors
    study.write('contest', content, arms.page(table, errors, measured))


def _sealed(study: Study, methods: list[str]) -> tuple[dict[str, Any], str]:
    """Return what all methods are worth on the sealed cases, and the table."""
    from ...contest import course, scores
    from ...contest.case import case_at
    from ...contest.entrants.learners import never_knows

    args, seen = study.args, study.out / 'cases'
    cases, truths = Path(args.cases), Path(args.truths)
    names = course.opened(cases, truths, seen)[: args.first or None]
    truth = {
        name: scores.sealed(cases, truths, name, never_knows(case_at(seen / name)).predicted)
        for name in names
    }
    runs = course.run_all(seen, names, methods, study.out / 'answers', study.tell)
    troubles = {
        method: {name: run.trouble for name, run in said.items() if run.trouble}
        for method, said in runs.items()
    }
    summaries = {method: scores.summary(said, truth) for method, said in runs.items()}
    content = {'methods': summaries, 'troubles': troubles, 'cases': names}
    return content, scores.page(summaries, f'{len(names)} cases.')


def _arms(study: Study, methods: list[str]) -> tuple[Errors, dict[str, Array]]:
    """Return the mean errors of all methods on the measured arms, and what was measured."""
    from ...contest import arms, course

    place, out = study.out / 'arms', study.out / 'arm_answers'
    measured = arms.arm_cases(Path(study.args.ur5), Path(study.args.ur10), place)
    runs = course.run_all(place, list(measured), methods, out, study.tell)
    return arms.lefts(runs, measured), measured
