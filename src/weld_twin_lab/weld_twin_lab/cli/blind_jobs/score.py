# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Open the seals and score the verdicts.

Exits with 2 when a case, a truth or the list of them is not what was sealed.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ...blind.measures import Measure
    from ...blind.scoring import Score


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('cases', metavar='DIR', help='cases made by blind make')
    parser.add_argument('--truths', required=True, metavar='DIR')
    parser.add_argument(
        '--results', required=True, metavar='DIR', help='verdicts of blind diagnose'
    )
    parser.add_argument(
        '--seal',
        default='',
        metavar='HASH',
        help='the seal as it was printed before the diagnosis',
    )
    parser.add_argument(
        '--reasons',
        default='',
        metavar='FILE',
        help='YAML file of case names and why they went wrong',
    )
    parser.add_argument(
        '--out', required=True, metavar='DIR', help='where score.json and score.html go'
    )


def run(args: argparse.Namespace) -> int:
    """Score, write, and print the measures."""
    from ...blind.score_files import read_reasons, write_score
    from ...blind.scoring import score

    result = score(
        Path(args.cases),
        Path(args.truths),
        Path(args.results),
        seal_given=args.seal,
        reasons=read_reasons(args.reasons),
    )
    write_score(Path(args.out), result)
    print_score(result)
    return 0


def print_score(result: Score) -> None:
    """Print the measures as a table."""
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None)
    for head in ('measure', 'value', '95 % interval', 'of', 'goal'):
        table.add_column(head, justify='left' if head == 'measure' else 'right')
    for measure in result.measures:
        value, low, high, count = measure.estimate
        interval = '-' if value is None else f'{low:.3f} to {high:.3f}'
        table.add_row(
            measure.title,
            '-' if value is None else f'{value:.3f}',
            interval,
            str(count),
            _goal(measure),
        )
    Console(highlight=False).print(table)


def _goal(measure: Measure) -> str:
    if measure.goal is None:
        return ''
    sign = '>=' if measure.at_least else '<='
    return f'{sign} {measure.goal:g}' + ('' if measure.reached is not False else '  missed')
