# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Put known causes into real recordings, diagnose and score.

Noise, outliers and clocks stay those of the real cell; what a cause does to the tool comes from
the simulator and is added. Every bag is also diagnosed as it is.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from .job_options import add_pool, runner_of
from .score import print_score


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('bags', nargs='+', metavar='BAG', help='real recordings of one robot')
    parser.add_argument('--robot', required=True, metavar='R', help='bundled robot or robot file')
    parser.add_argument(
        '--align',
        default='',
        metavar='FRAMES',
        help='frames that are not known: base, tool, or base,tool',
    )
    parser.add_argument(
        '--cases', type=int, default=40, metavar='N', dest='count', help='how many (default: 40)'
    )
    parser.add_argument('--seed', type=int, required=True, metavar='S')
    parser.add_argument('--out', required=True, metavar='DIR', help='where everything goes')
    add_pool(parser)


def run(args: argparse.Namespace) -> int:
    """Make, diagnose, score, and print the measures."""
    from ...blind.simulator import require_simulator

    require_simulator()
    from ...blind import layout
    from ...blind.diagnosing import diagnose_cases
    from ...blind.real_motion import make_semi_real
    from ...blind.score_files import write_score
    from ...blind.scoring import score

    out = Path(args.out)
    cases, truths, results = out / 'cases', out / 'truths', out / 'verdicts'
    align = [frame.strip() for frame in args.align.split(',') if frame.strip()]
    with runner_of(args, truths / layout.DONE, 'making cases') as runner:
        sealed = make_semi_real(
            cases, truths, args.bags, args.robot, align, args.seed, args.count, runner
        )
    print(f'seal {sealed}', flush=True)
    with runner_of(args, results / layout.DONE, 'diagnosing') as runner:
        diagnose_cases(cases, results, runner, allow_readable=True, with_holdout=False)
    result = score(cases, truths, results)
    write_score(out, result)
    print_score(result)
    print(f'report: {out / layout.PAGE}')
    return 0
