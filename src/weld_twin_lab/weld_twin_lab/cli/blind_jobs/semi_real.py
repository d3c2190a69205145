# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Put known causes into real recordings, diagnose and score.

Noise, outliers and clocks stay those of the real cell; what a cause does to the tool comes from
the simulator and is added. Every bag is also diagnosed as it is.
"""

from __future__ import annotations

from ...study import DONE, REQUIRED, Study, listed, option, options, study
from .score import diagnosed_and_scored

add_arguments = options(
    option('bags', REQUIRED, 'BAG', 'real recordings of one robot', nargs='+'),
    option('--robot', REQUIRED, 'R', 'bundled robot or robot file'),
    option('--align', '', 'FRAMES', 'frames that are not known: base, tool, or base,tool'),
    option('--cases', 40, 'N', 'how many (default: 40)', dest='count'),
    option('--seed', REQUIRED, 'S', 'decides the causes', type=int),
    out='where everything goes',
    pool=True,
)


@study
def run(study: Study) -> None:
    """Make, diagnose, score, and print the measures."""
    from ...blind.simulator import require_simulator

    require_simulator()
    from ...blind.real_motion import make_semi_real

    args, cases, truths = study.args, study.out / 'cases', study.out / 'truths'
    with study.runner('making cases', truths / DONE) as runner:
        sealed = make_semi_real(
            cases,
            truths,
            args.bags,
            args.robot,
            listed(args.align),
            args.seed,
            args.count,
            runner,
        )
    print(f'seal {sealed}', flush=True)
    diagnosed_and_scored(study, with_holdout=False)
