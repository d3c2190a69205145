# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Methods of different make on the same sealed cases, by the same rules.

Puts cases of `weld-twin lab blind make` into an open form, has every method answer them in a process
of its own, and scores the answers. Anybody's method can enter: --enter NAME='COMMAND {case} {out}'.
With --ur5 and --ur10, stations of two measured arms are asked, too. A run that was stopped goes on:
what is in --out is not made again. Remove the directory of a method to have it answer anew.
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
--enter NAME=COMMAND    a further method; may be given again
--ur5 DIR               holds grid.csv, random.csv
--ur10 DIR              holds series_c_random_poses.csv
""")


@study
def run(study: Study) -> None:
    """Run the contest and print the tables."""
    from ...contest import arms, course

    args = study.args
    methods = course.commands(listed(args.entrants) or list(course.ENTRANTS), args.enter)
    content, table = _sealed(study, methods)
    errors, measured = _arms(study, methods) if args.ur5 and args.ur10 else ({}, {})
    content['arms_mean_m'] = errors
    text = arms.page(table, errors, measured)
    study.write('contest', content, text)


def _sealed(study: Study, methods: dict[str, list[str]]) -> tuple[dict[str, Any], str]:
    """Return what all methods are worth on the sealed cases, and the table."""
    from ...contest import course, scores
    from ...contest.entrants.never_knows import answer as silent
    from ...contest.open_form import read_case

    args, out = study.args, study.out
    cases, truths = Path(args.cases), Path(args.truths)
    names = course.opened(cases, truths, out / 'cases')[: args.first or None]
    known = {name: read_case(out / 'cases' / name) for name in names}
    truth = {
        name: scores.sealed(cases, truths, name, silent(case).predicted)
        for name, case in known.items()
    }
    counts = {name: case.times.size for name, case in known.items()}
    runs = course.run_all(out / 'cases', names, methods, out / 'answers', counts, study.tell)
    summaries = {method: scores.summary(said, truth) for method, said in runs.items()}
    troubles = {
        method: {name: run.trouble for name, run in said.items() if run.trouble}
        for method, said in runs.items()
    }
    content = {'methods': summaries, 'troubles': troubles, 'cases': names}
    return content, scores.page(runs, truth, f'{len(names)} cases.')


def _arms(study: Study, methods: dict[str, list[str]]) -> tuple[Errors, dict[str, Array]]:
    """Return the mean errors of all methods on the measured arms, and what was measured."""
    from ...contest import arms, course

    place, out = study.out / 'arms', study.out / 'arm_answers'
    measured = arms.arm_cases(Path(study.args.ur5), Path(study.args.ur10), place)
    counts = {name: len(rows) for name, rows in measured.items()}
    runs = course.run_all(place, list(measured), methods, out, counts, study.tell)
    return arms.lefts(runs, measured), measured
