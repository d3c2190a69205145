# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Options that several jobs share."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from weld_twin_nodes.cli.options import add_pool

if TYPE_CHECKING:
    from weld_twin_nodes.offline.task_pool import Runner

__all__ = ['add_draw', 'add_pool', 'kinds_of', 'runner_of', 'spans_of']


@contextmanager
def runner_of(args: argparse.Namespace, store: Path, what: str) -> Iterator[Runner]:
    """Yield what runs tasks and shows how far they are."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

    from weld_twin_nodes.offline.task_pool import Runner, pool_of

    console = Console(stderr=True)
    columns = ('{task.description}', BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal) as progress:
        bar = progress.add_task(what, total=None)

        def tell(done: int, total: int, label: str) -> None:
            progress.update(bar, completed=done, total=total)

        with Runner(pool_of(args.scheduler, args.workers), store, tell) as runner:
            yield runner


def add_draw(parser: argparse.ArgumentParser) -> None:
    """Add the options that say which cases to draw."""
    parser.add_argument(
        '--cases', type=int, default=400, metavar='N', dest='count', help='how many (default: 400)'
    )
    parser.add_argument('--seed', type=int, required=True, metavar='S')
    parser.add_argument(
        '--kinds',
        default='',
        metavar='LIST',
        help='only these, comma-separated: single, double, triple, none, outside, withheld, '
        'ambiguous',
    )
    parser.add_argument(
        '--leave-one-out',
        action='store_true',
        help='each family of effects in turn at work and taken out of the library',
    )
    parser.add_argument(
        '--seconds', default='20,60', metavar='MIN,MAX', help='duration of a recording'
    )


def kinds_of(args: argparse.Namespace) -> tuple[str, ...]:
    """Return the kinds of cases asked for."""
    if args.leave_one_out:
        return ('withheld',)
    return tuple(kind.strip() for kind in args.kinds.split(',') if kind.strip())


def spans_of(args: argparse.Namespace) -> tuple[float, float]:
    """
    Return the shortest and longest duration [s].

    Raises
    ------
    DataError
        The option holds something else.

    """
    from weld_twin_core.errors import DataError

    try:
        low, high = map(float, args.seconds.split(','))
    except ValueError:
        low = high = 0.0
    if not 5.0 <= low <= high <= 600.0:
        raise DataError(f'--seconds takes two durations of 5 to 600 s, got {args.seconds!r}')
    return low, high
