# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Open the seals and score the verdicts.

Exits with 2 when a case, a truth or the list of them is not what was sealed.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from weld_twin_nodes.offline.output_directory import write_owned

from ...study import DONE, REQUIRED, Study, option, options, study

if TYPE_CHECKING:
    from ...blind.measures import Measure
    from ...blind.scoring import Score

add_arguments = options(
    option('cases', REQUIRED, 'DIR', 'cases made by blind make'),
    option('--truths', REQUIRED, 'DIR', 'their truths'),
    option('--results', REQUIRED, 'DIR', 'verdicts of blind diagnose'),
    option('--seal', '', 'HASH', 'the seal as it was printed before the diagnosis'),
    out='where score.json and score.html go',
)


@study
def run(study: Study) -> None:
    """Score, write, and print the measures."""
    from ...blind.scoring import score

    args = study.args
    places = (Path(args.cases), Path(args.truths), Path(args.results))
    _written(study, score(*places, seal_given=args.seal))


def diagnosed_and_scored(study: Study, *, with_holdout: bool = True) -> None:
    """Diagnose cases whose truths lie beside them, score, write, and print the measures."""
    from ...blind import layout
    from ...blind.diagnosing import diagnose_cases
    from ...blind.scoring import score

    cases, truths, results = (study.out / name for name in ('cases', 'truths', 'verdicts'))
    with study.runner('diagnosing', results / DONE) as runner:
        diagnose_cases(cases, results, runner, allow_readable=True, with_holdout=with_holdout)
    _written(study, score(cases, truths, results))
    print(f'report: {study.out / layout.PAGE}')


def _written(study: Study, result: Score) -> None:
    """Write the score as JSON and as a page, and print the measures as a table."""
    from rich.console import Console
    from rich.table import Table

    from ...blind import layout
    from ...blind.score_page import score_page

    write_owned(study.out / layout.PAGE, score_page(result))
    write_owned(study.out / layout.SCORE, layout.text(layout.SCORE, result.as_dict()))
    table = Table(box=None)
    for head in ('measure', 'value', '95 % interval', 'of', 'goal'):
        table.add_column(head, justify='left' if head == 'measure' else 'right')
    for measure in result.measures:
        value, low, high, count = measure.estimate
        interval = '-' if value is None else f'{low:.3f} to {high:.3f}'
        table.add_row(
            measure.title,
            '-' if value is None else f'{value:.3f}',
            interval,
            str(count),
            _goal(measure),
        )
    Console(highlight=False).print(table)


def _goal(measure: Measure) -> str:
    if measure.goal is None:
        return ''
    sign = '>=' if measure.at_least else '<='
    return f'{sign} {measure.goal:g}' + ('' if measure.reached is not False else '  missed')
