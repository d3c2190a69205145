# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Options that say which cases to draw."""

from __future__ import annotations

import argparse

from weld_twin_core.errors import DataError

from ...study import REQUIRED, listed, option

DRAW = (
    option('--cases', 400, 'N', 'how many (default: 400)', dest='count'),
    option('--seed', REQUIRED, 'S', 'decides the cases', type=int),
    option(
        '--kinds',
        '',
        'LIST',
        'only these, comma-separated: single, double, triple, none, outside, withheld, ambiguous',
    ),
    option(
        '--leave-one-out',
        False,
        None,
        'each family of effects in turn at work and taken out of the library',
    ),
    option('--seconds', '20,60', 'MIN,MAX', 'duration of a recording'),
)


def kinds_of(args: argparse.Namespace) -> tuple[str, ...]:
    """Return the kinds of cases asked for."""
    return ('withheld',) if args.leave_one_out else tuple(listed(args.kinds))


def spans_of(args: argparse.Namespace) -> tuple[float, float]:
    """
    Return the shortest and longest duration [s].

    Raises
    ------
    DataError
        The option holds something else.

    """
    try:
        low, high = map(float, args.seconds.split(','))
    except ValueError:
        low = high = 0.0
    if not 5.0 <= low <= high <= 600.0:
        raise DataError(f'--seconds takes two durations of 5 to 600 s, got {args.seconds!r}')
    return low, high
