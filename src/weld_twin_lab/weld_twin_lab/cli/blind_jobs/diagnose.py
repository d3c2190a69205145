# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Diagnose cases from their recordings alone.

Refuses to run where the truths could be read. Stopped, it goes on where it was when run again.
"""

from __future__ import annotations

from pathlib import Path

from ...study import DONE, REQUIRED, Study, option, options, study

add_arguments = options(
    option('cases', REQUIRED, 'DIR', 'cases made by blind make'),
    option(
        '--allow-readable',
        False,
        None,
        'go on although truths lie within reach; the score tells',
    ),
    option(
        '--without-holdout',
        False,
        None,
        'judge the shrink on stretches of the training recording',
    ),
    out='where the verdicts go',
    pool=True,
)


@study
def run(study: Study) -> None:
    """Diagnose and say how many verdicts there are."""
    from ...blind.diagnosing import diagnose_cases

    args = study.args
    with study.runner('diagnosing', study.out / DONE) as runner:
        verdicts = diagnose_cases(
            Path(args.cases),
            study.out,
            runner,
            allow_readable=args.allow_readable,
            with_holdout=not args.without_holdout,
        )
    failed = sum(verdict['error'] is not None for verdict in verdicts)
    print(f'{len(verdicts) - failed} verdicts, {failed} cases could not be diagnosed')
