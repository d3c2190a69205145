# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Investigations: do the experiments that are asked for decide?

Cells of the plant with sealed causes are recorded on poor motions. Those that the diagnosis leaves
open, or gets wrong, are investigated: the plant runs what is asked, three experiments and five minutes
at most. Writes investigate.json and investigate.md; a run that was interrupted goes on where it stopped,
and one with --minutes writes what there is after so long.
"""

from __future__ import annotations

from ...study import Study, options, study

OPTIONS = options(
    """
--seed N     decides the cells [default: 1]
--cells N    cells that are left open at first [default: 120]
--minutes M  begin no further cells after so many minutes, and write what there is [default: inf]
""",
    pool=True,
)


@study
def run(study: Study) -> None:
    """Investigate what is not done yet, and print the tables."""
    from ...experiments.goals import page
    from ...experiments.study import investigated

    args = study.args
    with study.runner('investigating') as runner:
        result = investigated(args.seed, args.cells, runner, study.tell, minutes=args.minutes)
    study.write('investigate', result, page(result))
