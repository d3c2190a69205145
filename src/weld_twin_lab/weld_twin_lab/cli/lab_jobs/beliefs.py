# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What hangs on each tuned number of a diagnosis: every one moved by 25 % both ways.

Diagnoses cases whose truths are known, then decides or diagnoses anew with one number moved at a
time. Writes beliefs.json and beliefs.md. Stopped, it goes on where it was when run again.
"""

from __future__ import annotations

from pathlib import Path

from ...study import REQUIRED, Study, listed, option, options, study

REFITTED = 10
"""Cases diagnosed anew for numbers that act before the verdict: some 10 minutes of one core."""

add_arguments = options(
    option('cases', REQUIRED, 'DIR', 'cases made by blind make'),
    option('--truths', REQUIRED, 'DIR', 'their truths'),
    option(
        '--refit',
        REFITTED,
        'N',
        f'cases to diagnose anew where a number acts before the verdict (default: {REFITTED})',
    ),
    option('--only', '', 'LIST', 'only these numbers, comma-separated'),
    out='where the table goes',
    pool=True,
)


@study
def run(study: Study) -> None:
    """Move every number, write the table and print it."""
    from ...blind.belief_study import study as moved
    from ...blind.belief_table import table

    args = study.args
    with study.runner('deciding') as runner:
        result = moved(Path(args.cases), Path(args.truths), runner, args.refit, listed(args.only))
    study.write('beliefs', result, table(result))
