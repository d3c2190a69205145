# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Make, diagnose and score in one go.

The truths lie beside the cases then; nothing but the code keeps the diagnosis from reading them.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from .job_options import add_draw, add_pool, kinds_of, runner_of, spans_of
from .score import print_score


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add_draw(parser)
    parser.add_argument('--out', required=True, metavar='DIR', help='where everything goes')
    parser.add_argument(
        '--reasons',
        default='',
        metavar='FILE',
        help='YAML file of case names and why they went wrong',
    )
    add_pool(parser)


def run(args: argparse.Namespace) -> int:
    """Run what is not done yet, and print the measures."""
    from ...blind.simulator import require_simulator

    require_simulator()
    from ...blind import layout
    from ...blind.diagnosing import diagnose_cases
    from ...blind.making import make
    from ...blind.score_files import read_reasons, write_score
    from ...blind.scoring import score

    out = Path(args.out)
    cases, truths, results = out / 'cases', out / 'truths', out / 'verdicts'
    with runner_of(args, truths / layout.DONE, 'making cases') as runner:
        sealed = make(cases, truths, args.seed, args.count, runner, kinds_of(args), spans_of(args))
    print(f'seal {sealed}', flush=True)
    with runner_of(args, results / layout.DONE, 'diagnosing') as runner:
        diagnose_cases(cases, results, runner, allow_readable=True)
    result = score(cases, truths, results, reasons=read_reasons(args.reasons))
    write_score(out, result)
    print_score(result)
    print(f'report: {out / layout.PAGE}')
    return 0
