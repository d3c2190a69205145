# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Try every family of effects on every kind of arm, from below the noise to far above it.

Writes recovery.json and recovery.md. Stopped, it goes on where it was when run again.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from .job_options import add_pool, runner_of

RESULT, TABLE, STORE = 'recovery.json', 'recovery.md', 'done'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('--seed', type=int, required=True, metavar='S')
    parser.add_argument('--out', required=True, metavar='DIR', help='where the table goes')
    parser.add_argument(
        '--robots',
        default='',
        metavar='LIST',
        help='comma-separated (default: one of each kind of arm)',
    )
    parser.add_argument(
        '--families', default='', metavar='LIST', help='only these, comma-separated (default: all)'
    )
    parser.add_argument(
        '--sizes',
        default='0.5,1,3,10',
        metavar='LIST',
        help='effect RMS over noise, comma-separated (default: 0.5,1,3,10)',
    )
    parser.add_argument(
        '--motion', default='free', metavar='NAME', help='free, seams or stations (default: free)'
    )
    parser.add_argument(
        '--store',
        default='',
        metavar='DIR',
        help='where single results are kept (default: inside --out)',
    )
    add_pool(parser)


def run(args: argparse.Namespace) -> int:
    """Run what is not done yet, write the table and print it."""
    from ...blind.simulator import require_simulator

    require_simulator()
    from weld_twin_core import __version__
    from weld_twin_nodes.offline.output_directory import write_owned

    from ...blind.cause_sizes import FAMILIES
    from ...blind.diagnosing import engine_digest
    from ...blind.recovering import ARMS, recover
    from ...blind.recovery_table import summary, table

    out = Path(args.out)
    arms, families = _listed(args.robots) or ARMS, _listed(args.families) or FAMILIES
    with runner_of(args, Path(args.store) if args.store else out / STORE, 'recovering') as runner:
        rows = recover(runner, args.seed, arms, families, _numbers(args.sizes), args.motion)
    made = {
        'seed': args.seed,
        'motion': args.motion,
        'engine': engine_digest(),
        'version': __version__,
    }
    content = {
        'schema': 'weld_twin/blind/recovery/1',
        'made': made,
        'sums': summary(rows),
        'cases': rows,
    }
    write_owned(out / RESULT, json.dumps(content, indent=1) + '\n')
    text = table(rows, made)
    write_owned(out / TABLE, text)
    print(text, end='')
    return 0


def _listed(text: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in text.split(',') if part.strip())


def _numbers(text: str) -> tuple[float, ...]:
    """
    Return the sizes.

    Raises
    ------
    DataError
        Something in the list is no number above zero.

    """
    from weld_twin_core.errors import DataError

    try:
        sizes = tuple(map(float, _listed(text)))
    except ValueError:
        sizes = ()
    if not sizes or not all(0.0 < size < 1e3 for size in sizes):
        raise DataError(f'--sizes takes numbers between 0 and 1000, got {text!r}')
    return sizes
