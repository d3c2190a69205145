# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Methods of different make on the same sealed cases, by the same rules.

Puts cases of `weld-twin blind make` into an open form, has every method answer them in a process
of its own, and scores the answers. Anybody's method can enter: --enter NAME='COMMAND {case} {out}'.
"""

from __future__ import annotations

import argparse
from pathlib import Path


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
    parser.add_argument('--out', required=True, metavar='DIR')


def run(args: argparse.Namespace) -> int:
    """Run the contest and print the table."""
    import json

    from weld_twin_msgs_py.files.whole_files import write_text

    from ...contest import course, scores
    from ...contest.entrants.never_knows import answer as silent
    from ...contest.open_form import read_case

    cases, truths, out = Path(args.cases), Path(args.truths), Path(args.out)
    names = course.opened(cases, truths, out / 'cases')[: args.first or None]
    listed = [name.strip() for name in args.entrants.split(',') if name.strip()]
    methods = course.commands(listed or list(course.ENTRANTS), args.enter)
    known = {name: read_case(out / 'cases' / name) for name in names}
    truth = {
        name: scores.sealed(cases, truths, name, silent(case).predicted)
        for name, case in known.items()
    }
    counts = {name: case.times.size for name, case in known.items()}
    runs = course.run_all(out / 'cases', names, methods, out / 'answers', counts, print)
    text = scores.page(runs, truth, f'{len(names)} cases.')
    found = {method: scores.summary(said, truth) for method, said in runs.items()}
    troubles = {
        method: {name: run.trouble for name, run in said.items() if run.trouble}
        for method, said in runs.items()
    }
    content = {'methods': found, 'troubles': troubles, 'cases': names}
    write_text(out / 'contest.json', json.dumps(content, indent=1) + '\n', overwrite=True)
    write_text(out / 'contest.md', text, overwrite=True)
    print(text, end='')
    return 0
