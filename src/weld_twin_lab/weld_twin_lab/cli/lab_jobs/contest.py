# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Methods of different make on the same sealed cases, by the same rules.

Puts cases of `weld-twin lab blind make` into an open form, has every method answer them in a process
of its own, and scores the answers. Anybody's method can enter: --enter NAME='COMMAND {case} {out}'.
With --ur5 and --ur10, stations of two measured arms are asked, too. A run that was stopped goes on:
what is in --out is not made again. Remove the directory of a method to have it answer anew.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from weld_twin_core.arrays import Array

    from ...contest.arms import Errors
    from ...contest.processes import Starter


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('--cases', required=True, metavar='DIR', help='as blind make wrote them')
    parser.add_argument('--truths', required=True, metavar='DIR', help='their truths')
    parser.add_argument('--first', type=int, default=0, metavar='N', help='only so many cases')
    parser.add_argument(
        '--entrants', default='', metavar='LIST', help='comma-separated (default: all)'
    )
    parser.add_argument(
        '--enter', action='append', default=[], metavar='NAME=COMMAND', help='a further method'
    )
    parser.add_argument('--ur5', metavar='DIR', help='holds grid.csv, random.csv')
    parser.add_argument('--ur10', metavar='DIR', help='holds series_c_random_poses.csv')
    parser.add_argument('--out', required=True, metavar='DIR')


def run(args: argparse.Namespace) -> int:
    """Run the contest and print the tables."""
    import json

    from weld_twin_nodes.offline.output_directory import write_owned

    from ...contest import course, told

    out = Path(args.out)
    listed = [name.strip() for name in args.entrants.split(',') if name.strip()]
    methods = course.commands(listed or list(course.ENTRANTS), args.enter)
    content, table = _sealed(args, methods)
    errors, measured = _arms(args, methods) if args.ur5 and args.ur10 else ({}, {})
    content['arms_mean_m'] = errors
    text = told.page(table, content['methods'], content['closer'], errors, measured)
    write_owned(out / 'contest.json', json.dumps(content, indent=1) + '\n')
    write_owned(out / 'contest.md', text)
    print(text, end='')
    return 0


def _sealed(args: argparse.Namespace, methods: dict[str, Starter]) -> tuple[dict[str, Any], str]:
    """Return what all methods are worth on the sealed cases, and the table."""
    from ...contest import course, scores, told
    from ...contest.entrants.never_knows import answer as silent
    from ...contest.open_form import read_case

    cases, truths, out = Path(args.cases), Path(args.truths), Path(args.out)
    names = course.opened(cases, truths, out / 'cases')[: args.first or None]
    known = {name: read_case(out / 'cases' / name) for name in names}
    truth = {
        name: scores.sealed(cases, truths, name, silent(case).predicted)
        for name, case in known.items()
    }
    counts = {name: case.times.size for name, case in known.items()}
    runs = course.run_all(out / 'cases', names, methods, out / 'answers', counts, _tell)
    found = {method: scores.summary(said, truth) for method, said in runs.items()}
    troubles = {
        method: {name: run.trouble for name, run in said.items() if run.trouble}
        for method, said in runs.items()
    }
    near = told.closer(runs, truth)
    content = {'methods': found, 'troubles': troubles, 'closer': near, 'cases': names}
    return content, scores.page(runs, truth, f'{len(names)} cases.')


def _arms(
    args: argparse.Namespace, methods: dict[str, Starter]
) -> tuple[Errors, dict[str, Array]]:
    """Return the mean errors of all methods on the measured arms, and what was measured."""
    from ...contest import arms, course

    place, out = Path(args.out) / 'arms', Path(args.out) / 'arm_answers'
    measured = arms.arm_cases(Path(args.ur5), Path(args.ur10), place)
    counts = {name: len(rows) for name, rows in measured.items()}
    runs = course.run_all(place, list(measured), methods, out, counts, _tell)
    return arms.lefts(runs, measured), measured


def _tell(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
