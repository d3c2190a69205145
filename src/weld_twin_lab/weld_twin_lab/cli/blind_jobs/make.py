# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Make cases and seal their truths.

Prints the seal, a hash over all cases and truths; publish it before anybody diagnoses.
"""

from __future__ import annotations

from pathlib import Path

from ...study import DONE, REQUIRED, Study, option, options, study
from .draw_options import DRAW, kinds_of, spans_of

add_arguments = options(
    *DRAW,
    option(
        '--truths',
        REQUIRED,
        'DIR',
        'where the truths go; keep it where a diagnosis cannot read',
    ),
    out='where the recordings go',
    pool=True,
)


@study
def run(study: Study) -> None:
    """Make the cases and print the seal."""
    made(study, study.out, Path(study.args.truths))


def made(study: Study, cases: Path, truths: Path) -> None:
    """Make the cases that the options ask for, and print their seal."""
    from ...blind.simulator import require_simulator

    require_simulator()
    from ...blind.making import make

    args = study.args
    with study.runner('making cases', truths / DONE) as runner:
        sealed = make(cases, truths, args.seed, args.count, runner, kinds_of(args), spans_of(args))
    print(f'seal {sealed}', flush=True)
