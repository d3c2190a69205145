# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Plans of a first measurement, carried out by the plant: is an arm as sure as its plan said?

Writes plans.json; a run that was interrupted goes on where it stopped.
"""

from __future__ import annotations

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('--plans', type=int, default=24, metavar='N', help='how many (24)')
    parser.add_argument('--out', required=True, metavar='DIR', help='where results go')


def run(args: argparse.Namespace) -> int:
    """Carry the plans out and print what came of them."""
    import sys

    from ...coverage.planned import planned

    def tell(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    score = planned(args.plans, Path(args.out), tell)
    print(', '.join(f'{key} {value:.3g}' for key, value in score.items()))
    return 0
