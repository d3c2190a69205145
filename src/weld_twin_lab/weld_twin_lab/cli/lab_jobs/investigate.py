# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Investigations: do the experiments that are asked for decide?

Cells of the plant with sealed causes are recorded on poor motions. Those that the diagnosis leaves
open, or gets wrong, are investigated: the plant runs what is asked, three experiments and five minutes
at most. Writes investigate.json and investigate.md; a run that was interrupted goes on where it stopped,
and one with --minutes writes what there is after so long.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ...study import Study, options, study

OPTIONS = options(
    """
--seed N            decides the cells [default: 1]
--cells N           cells that are left open at first [default: 120]
--minutes M         begin no further cells after so many minutes, and write what there is [default: inf]
--learn-from TABLE ...  learn the weights of the rule that closes a question from investigate.json of
  other cells, and write closing.md with what they are worth on cells that they were not learned from
""",
    pool=True,
)


@study
def run(study: Study) -> None:
    """Investigate what is not done yet, and print the tables."""
    from ...experiments import closing_weights
    from ...experiments.goals import page
    from ...experiments.study import investigated

    args = study.args
    if args.learn_from:
        study.write('closing', page=closing_weights.page(_kept(args.learn_from)))
        return
    with study.runner('investigating') as runner:
        result = investigated(args.seed, args.cells, runner, study.tell, minutes=args.minutes)
    study.write('investigate', result, page(result))


def _kept(tables: list[str]) -> list[Any]:
    """Return the cells of tables; refuse what is none."""
    from weld_twin_core.errors import DataError

    out: list[Any] = []
    for table in tables:
        try:
            out += json.loads(Path(table).read_text(encoding='utf-8'))['cases']
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise DataError(f"'{table}' is no table of investigated cells: {error}") from None
    return out
