# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Diagnose cases from their recordings alone.

Refuses to run where the truths could be read. Stopped, it goes on where it was when run again.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from .job_options import add_pool, runner_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('cases', metavar='DIR', help='cases made by blind make')
    parser.add_argument('--out', required=True, metavar='DIR', help='where the verdicts go')
    parser.add_argument(
        '--allow-readable',
        action='store_true',
        help='go on although truths lie within reach; the score tells',
    )
    parser.add_argument(
        '--without-holdout',
        action='store_true',
        help='judge the shrink on stretches of the training recording',
    )
    add_pool(parser)


def run(args: argparse.Namespace) -> int:
    """Diagnose and say how many verdicts there are."""
    from ...blind import layout
    from ...blind.diagnosing import diagnose_cases

    out = Path(args.out)
    with runner_of(args, out / layout.DONE, 'diagnosing') as runner:
        verdicts = diagnose_cases(
            Path(args.cases),
            out,
            runner,
            allow_readable=args.allow_readable,
            with_holdout=not args.without_holdout,
        )
    failed = sum(verdict['error'] is not None for verdict in verdicts)
    print(f'{len(verdicts) - failed} verdicts, {failed} cases could not be diagnosed')
    return 0
