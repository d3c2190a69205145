# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Try every family of effects on every kind of arm, from below the noise to far above it.

Writes recovery.json and recovery.md. Stopped, it goes on where it was when run again.
"""

from __future__ import annotations

from pathlib import Path

from ...study import REQUIRED, Study, listed, option, options, study

add_arguments = options(
    option('--seed', REQUIRED, 'S', 'decides the cases', type=int),
    option('--robots', '', 'LIST', 'comma-separated (default: one of each kind of arm)'),
    option('--families', '', 'LIST', 'only these, comma-separated (default: all)'),
    option(
        '--sizes',
        '0.5,1,3,10',
        'LIST',
        'effect RMS over noise, comma-separated (default: 0.5,1,3,10)',
    ),
    option('--motion', 'free', 'NAME', 'free, seams or stations (default: free)'),
    option('--store', '', 'DIR', 'where single results are kept (default: inside --out)'),
    out='where the table goes',
    pool=True,
)


@study
def run(study: Study) -> None:
    """Run what is not done yet, write the table and print it."""
    from ...blind.simulator import require_simulator

    require_simulator()
    from weld_twin_core import __version__

    from ...blind.cause_sizes import FAMILIES
    from ...blind.diagnosing import engine_digest
    from ...blind.recovering import ARMS, recover
    from ...blind.recovery_table import summary, table

    args = study.args
    arms, families = listed(args.robots) or ARMS, listed(args.families) or FAMILIES
    with study.runner('recovering', Path(args.store) if args.store else None) as runner:
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
    study.write('recovery', content, table(rows, made))


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
        sizes = tuple(map(float, listed(text)))
    except ValueError:
        sizes = ()
    if not sizes or not all(0.0 < size < 1e3 for size in sizes):
        raise DataError(f'--sizes takes numbers between 0 and 1000, got {text!r}')
    return sizes
