# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How far a diagnosis can be trusted: learned on cases with known truths, judged on others.

Draws cases, diagnoses them, and fits for every kind of statement how often it is right, with the
threshold from which it is told as sure. Writes weights.json (the file the diagnosis reads), what
answers are worth on the cases to judge on, pictures, and the tables of statements: with --learn-from
and --judge-on it is fitted anew from such tables without a diagnosis. Without cases to judge on,
those learned from are judged by weights that had not seen them. Stopped, it goes on where it was
when run again.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..blind_jobs.job_options import add_pool, runner_of

LEARNED, JUDGED, STORE = 'cases.jsonl.gz', 'held_out.jsonl.gz', 'done'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        '--cases', type=int, default=0, metavar='N', help='cases to learn from (default: 0)'
    )
    parser.add_argument('--seed', type=int, default=1, metavar='S', help='their seed')
    parser.add_argument(
        '--held-out', type=int, default=0, metavar='N', help='cases to judge on (default: 0)'
    )
    parser.add_argument('--held-out-seed', type=int, default=2, metavar='S', help='their seed')
    parser.add_argument(
        '--mix',
        choices=('usual', 'several'),
        default='usual',
        help='cases of the usual mix, or cells with one to six causes (default: usual)',
    )
    parser.add_argument(
        '--learn-from', nargs='*', default=[], metavar='TABLE', help='tables kept from other runs'
    )
    parser.add_argument(
        '--judge-on', nargs='*', default=[], metavar='TABLE', help='tables kept from other runs'
    )
    parser.add_argument(
        '--risk',
        type=float,
        default=0.002,
        metavar='P',
        help='probability that an answer may be sure and wrong (default: 0.002)',
    )
    add_pool(parser)
    parser.add_argument('--out', required=True, metavar='DIR', help='where everything goes')


def run(args: argparse.Namespace) -> int:
    """Make what is not made yet, fit, judge, write and print the page."""
    from weld_twin_core.errors import DataError

    from ...belief import study
    from ...belief.rows import read_rows, write_rows
    from ...blind.simulator import require_simulator

    if args.cases or args.held_out:
        require_simulator()
    if args.seed == args.held_out_seed:
        raise DataError(
            '--seed and --held-out-seed must differ: a case is learned from or judged on'
        )
    out = Path(args.out)
    taught = [row for table in args.learn_from for row in read_rows(Path(table))]
    tried = [row for table in args.judge_on for row in read_rows(Path(table))]
    with runner_of(args, out / STORE, 'diagnosing') as runner:
        taught += study.rows_of(args.seed, args.cases, runner, args.mix)
        tried += study.rows_of(args.held_out_seed, args.held_out, runner, args.mix)
    _refuse_shared(taught, tried)
    write_rows(out / LEARNED, taught)
    if tried:
        write_rows(out / JUDGED, tried)
    content = study.fit(taught, args.risk)
    print(study.write(out, content, tried, taught), end='')
    return 0


def _refuse_shared(taught: list[dict[str, object]], tried: list[dict[str, object]]) -> None:
    """Refuse cases that are learned from and judged on."""
    from weld_twin_core.errors import DataError

    shared = {row['name'] for row in taught} & {row['name'] for row in tried}
    if shared:
        raise DataError(
            f'case {min(map(str, shared))} is in a table to learn from and in one to judge on'
        )
    if not taught:
        raise DataError('there are no cases to learn from; give --cases or --learn-from')
