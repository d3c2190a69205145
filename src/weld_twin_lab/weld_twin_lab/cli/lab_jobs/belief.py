# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How far a diagnosis can be trusted: learned on cases with known truths, judged on others.

Draws cases, diagnoses them, and fits for every kind of statement how often it is right, with the
threshold from which it is told as sure. Writes weights.json (the file the diagnosis reads), what
answers are worth on the cases to judge on, and the tables of statements: with --learn-from
and --judge-on it is fitted anew from such tables without a diagnosis. Without cases to judge on,
those learned from are judged by weights that had not seen them. Stopped, it goes on where it was
when run again.
"""

from __future__ import annotations

from pathlib import Path

from ...belief.terms import RISK
from ...study import Study, options, require_simulator, study

LEARNED, JUDGED = 'cases.jsonl.gz', 'held_out.jsonl.gz'

OPTIONS = options(
    f"""
--cases N               cases to learn from [default: 0]
--seed N                their seed [default: 1]
--held-out N            cases to judge on [default: 0]
--held-out-seed N       their seed [default: 2]
--mix {{usual,several,everywhere}}  which cells: see docs/trust.md [default: usual]
--oracle N              of so many of these an oracle that knows the plant is asked, too [default: 0]
--learn-from TABLE ...  tables kept from other runs
--judge-on TABLE ...    tables kept from other runs
--risk X                probability that an answer may be sure and wrong [default: {RISK}]
""",
    out='where everything goes',
    pool=True,
)


@study
def run(study: Study) -> None:
    """Make what is not made yet, fit, judge, write and print the page."""
    from weld_twin_core.errors import DataError

    from ...belief.judged import examples_of
    from ...belief.learning import unseen
    from ...belief.rows import read_rows, write_rows
    from ...belief.study import fit, judged, rows_of, with_oracle
    from ...belief.table import page

    args = study.args
    if args.cases or args.held_out:
        require_simulator()
    if args.seed == args.held_out_seed:
        raise DataError(
            '--seed and --held-out-seed must differ: a case is learned from or judged on'
        )
    taught = [row for table in args.learn_from for row in read_rows(Path(table))]
    tried = [row for table in args.judge_on for row in read_rows(Path(table))]
    with study.runner('diagnosing') as runner:
        taught += rows_of(args.seed, args.cases, runner, args.mix)
        asked = rows_of(args.held_out_seed, args.held_out, runner, args.mix)
        tried += [*with_oracle(asked[: args.oracle], runner), *asked[args.oracle :]]
    _refuse_shared(taught, tried)
    write_rows(study.out / LEARNED, taught)
    if tried:
        write_rows(study.out / JUDGED, tried)
    content = fit(taught, args.risk)
    examples = examples_of(tried) if tried else unseen(examples_of(taught), content)
    result = judged(content, tried, examples)
    study.write('weights', content)
    study.write('results', result)
    study.write('belief', page=page(result))


def _refuse_shared(taught: list[dict[str, object]], tried: list[dict[str, object]]) -> None:
    """Refuse cases that are learned from and judged on."""
    from weld_twin_core.errors import DataError

    shared = {row['name'] for row in taught} & {row['name'] for row in tried}
    if shared:
        raise DataError(
            f'case {min(map(str, shared))} is in a table to learn from and in one to judge on'
        )
    if not taught:
        raise DataError('there are no cases to learn from; give --cases or --learn-from')
