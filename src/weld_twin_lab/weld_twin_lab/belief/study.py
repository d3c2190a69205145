# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The calibration learned from some cases, and judged on others."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_nodes.offline.task_pool import Runner, Task

from ..blind.scoring import (
    NOT_IN_LIBRARY,
    Measure,
    Question,
    bootstrap,
    brier,
    calibration_error,
    calibration_error_by_chance,
    measure_table,
    measured,
    share,
)
from ..study import Study, require_simulator, shown, tabled
from . import learning
from .judged import Example, examples_of, kept
from .learning import log_loss, unseen, upper_limit
from .oracle import certainty
from .trial import USUAL, read_rows, seeds_of, tried, write_rows

Kept = Mapping[str, Any]
SEEN, PLAIN = 1.0, 3.0
"""Effect RMS over noise from which a cause can be seen, and from which it is plain."""
ORACLE = 0.99
"""Probability from which the oracle is sure."""


def goal_measures(rows: Sequence[Kept]) -> list[Measure]:
    """Return the measures of verdicts and of levels on rows of `judged.kept` that taught nothing."""
    single = _of('single')
    named = [r for r in rows if single(r) and r['status'] != 'none']
    seconds = [float(r['seconds']) for r in rows]
    return [
        *measured(CAUSES, rows),
        # The mean belief in the true family, as fault isolation benchmarks have it.
        *(
            Measure(key, title, bootstrap([float(r[of]) for r in named if of in r], np.mean), goal)
            for key, title, of, goal in FAMILY
        ),
        Measure('seconds', 'processor seconds of a diagnosis, median', bootstrap(seconds)),
        *measured(FOREIGN, rows),
    ]


def _of(*kinds: str) -> Callable[[Kept], bool]:
    """Return what tells cases of some kinds whose causes can all be seen."""
    return lambda row: row['kind'] in kinds and min(row['sizes']) >= SEEN


_known = _of('single', 'double', 'triple', 'several')


def _causes(count: int, least: float, *but: str) -> Callable[[Kept], bool]:
    """Return what tells cases with so many causes of the library, each as large as the least."""
    others = {*NOT_IN_LIBRARY, *but}

    def asked(row: Kept) -> bool:
        sizes = row['sizes']
        return len(sizes) == count and min(sizes) >= least and row['kind'] not in others

    return asked


def _foreign(row: Kept) -> bool:
    return row['kind'] in NOT_IN_LIBRARY


CAUSES = (
    Question(
        'sure_wrong',
        'sure and wrong',
        lambda row: True,
        lambda row: row['sure'] and not row['right'],
        0.002,
        False,
    ),
    Question(
        'single_sure',
        'one cause in the library, 1 noise or more: right and sure',
        _causes(1, SEEN),
        lambda row: row['right'] and row['sure'],
        0.70,
    ),
    Question(
        'single_cause_sure',
        'the same: its cause named, right and sure',
        _causes(1, SEEN),
        lambda row: any(
            kind == 'name' and right and sure for kind, _, right, _, sure in row['examples']
        ),
        0.80,
    ),
    Question('single_right', 'the same: right', _causes(1, SEEN), itemgetter('right')),
    Question(
        'oracle_sure',
        'one or two causes of which an oracle is sure: right and sure',
        lambda row: _known(row) and (row.get('oracle') or 0.0) >= ORACLE,
        lambda row: row['right'] and row['sure'],
        0.95,
    ),
    Question(
        'double_named',
        'two causes, each 3 noise: both named',
        _causes(2, PLAIN, 'ambiguous'),
        itemgetter('named'),
        0.90,
    ),
    Question(
        'triple_named',
        'three causes, each 3 noise: all named',
        _causes(3, PLAIN, 'ambiguous'),
        itemgetter('named'),
        0.85,
    ),
    Question(
        'needless_unknown',
        'causes in the library, 1 noise or more: needlessly unknown',
        _known,
        lambda row: row['status'] == 'unknown',
        0.03,
        False,
    ),
)
"""What is asked of causes that the library has."""
FAMILY = (
    ('fia', 'mean belief in the true family, one cause; a set counts whole', 'family', 0.92),
    ('fia_shared', 'the same, a set shared among its members', 'family_shared', 0.85),
)
"""What is believed of the family of a single cause: key, title, what of a case, goal."""
FOREIGN = (
    Question(
        'honest',
        'withheld or outside: unknown, a set that holds it, or as good on sealed data',
        _foreign,
        lambda row: row['honest'] or row['status'] == 'unknown',
        0.95,
    ),
    Question('place', 'the same: place right, first answer', _foreign, itemgetter('place'), 0.90),
    Question('dependence', 'the same: dependence right', _foreign, itemgetter('dependence'), 0.87),
)
"""The same of causes that it does not have."""


COVERAGE = 0.7
"""Share of the statements, the surest first, at which the risk is quoted."""
MIX = (
    'half of them cells with one to six causes equally often, of a fifth of which a family is taken '
    'out; half as follows: seven arms; free motions, seams and stations, a third of them poor, 15 to '
    '45 s; causes of 0.3 to 40 times the noise; of 44 cases 16 with one cause, 6 with two, 3 with '
    'three, 3 ambiguous by construction, 4 with none, 6 outside the library, 6 with their family '
    'withheld'
)


def rows_of(seed: int, count: int, runner: Runner, mix: str = USUAL) -> list[dict[str, Any]]:
    """Return the rows of the first cases of a seed; those in the runner's store are not made anew."""
    tasks = [Task(tried, (seed, number, mix), f'case {number}') for number in range(count)]
    return [{'mix': mix, **kept(row)} for row in runner.run(tasks)]


def with_oracle(rows: Sequence[dict[str, Any]], runner: Runner) -> list[dict[str, Any]]:
    """Return rows of `rows_of` with what an oracle is sure of, where it is asked: `oracle.certainty`."""
    cases = [(*map(int, str(row['name']).split('/')), str(row['mix'])) for row in rows]
    tasks = [Task(certainty, case, f'oracle on case {case[1]}') for case in cases]
    return [{**row, 'oracle': p} for row, p in zip(rows, runner.run(tasks), strict=True)]


def fit(rows: Sequence[Mapping[str, Any]], risk: float = learning.RISK) -> dict[str, Any]:
    own = [row for row in rows if row.get('examples')]
    return learning.learned(examples_of(own), {**_drawn(own), 'mix': MIX}, risk)


def _drawn(rows: Sequence[Kept]) -> dict[str, Any]:
    mixes = dict(Counter(str(row['mix']) for row in rows))
    return {'cases': len(rows), 'seeds': seeds_of(rows), 'mixes': mixes}


def judged(
    content: Mapping[str, Any], rows: Sequence[Mapping[str, Any]], examples: Sequence[Example]
) -> dict[str, Any]:
    """
    Return what answers were worth on cases that nothing was learned from.

    rows: as `judged.kept` gives them; none where the cases learned from are judged by weights that
    had not seen them.
    """
    own = [row for row in rows if row.get('examples')]
    foreign = {str(row['name']) for row in own if row['kind'] in NOT_IN_LIBRARY}
    whole = [e for e in examples if e.kind.startswith('answer')]
    groups = {
        **{kind: [e for e in examples if e.kind == kind] for kind in content['statements']},
        'answers as a whole': whole,
        'the same, in the library or none': [e for e in whole if own and e.case not in foreign],
        'the same, withheld or outside': [e for e in whole if e.case in foreign],
        'causes': [e for e in examples if e.kind in learning.CAUSES],
    }
    return {
        'schema': 'weld_twin/belief_results/2',
        'learned_from': {**content['card'], 'weights': learning.count_of(content)},
        'judged_on': {
            **_drawn(own),
            'unsound': [row['name'] for row in rows if row.get('unsound')],
            'failed': [row['name'] for row in rows if row['error']],
        },
        'statements': {name: worth(part) for name, part in groups.items() if part},
        'goals': [measure.as_dict() for measure in goal_measures(own)] if own else [],
        'wrong_and_sure': [_in_words(row) for row in own if row['sure'] and not row['right']],
    }


def worth(examples: Sequence[Example]) -> dict[str, Any]:
    reported = np.array([e.reported for e in examples])
    right = np.array([e.right for e in examples], bool)
    sure = [e.sure for e in examples]
    wrong = sum(e.sure and not e.right for e in examples)
    return {
        'statements': len(examples),
        'right': int(right.sum()),
        'log_loss': log_loss(reported, right, np.ones(right.size)),
        'ece': calibration_error(list(reported), list(map(bool, right)))._asdict(),
        'ece_by_chance': calibration_error_by_chance(list(reported)),
        'brier': brier(list(reported), list(map(bool, right)))._asdict(),
        'sure': share(sure)._asdict(),
        'sure_and_wrong': wrong,
        'sure_and_wrong_most_95': upper_limit(wrong, len(examples), 0.05),
        'wrong_at_70': _risk_at(reported, right),
    }


def _risk_at(reported: Array, right: NDArray[np.bool_]) -> float:
    first = np.argsort(-reported, kind='stable')[: max(round(COVERAGE * reported.size), 1)]
    return float((~right[first]).mean())


def _in_words(row: Mapping[str, Any]) -> dict[str, Any]:
    own = {key: row[key] for key in ('name', 'kind', 'robot', 'motion', 'truth', 'sizes')}
    return {**own, 'said': f'{row["status"]} {row["said"]}'.strip()}


def page(result: Mapping[str, Any]) -> str:
    parts = [
        *_bounds(result['learned_from'], result['judged_on']),
        '',
        tabled(STATEMENTS, result['statements'].items()),
        'By chance: the calibration error that so many statements have where each is exactly right.',
        '',
    ]
    if result['goals']:
        parts += ['Beside the goals:', '', measure_table(result['goals'])]
        failed = result['wrong_and_sure']
        parts += ['Sure and wrong:' if failed else 'No case was sure and wrong.', '']
        parts += [tabled(FAILURES, failed)] if failed else []
    return '\n'.join(parts)


def _bounds(taught: Mapping[str, Any], tried: Mapping[str, Any]) -> list[str]:
    by = (
        f'judged on {tried["cases"]} cases of seed {_listed(tried["seeds"])}, none of which was '
        'learned from'
        if tried['cases']
        else 'each judged by weights that had not seen it'
    )
    return [
        f'{taught["weights"]} weights, learned from {taught["cases"]} cases of seed '
        f'{_listed(taught["seeds"])}; {by}. From where a statement is told as sure:',
        '',
        tabled(BOUNDS, taught['bounds'].items()),
    ]


def _listed(values: Sequence[object]) -> str:
    return ', '.join(map(str, values))


_percent = partial(shown, 1, by='{:.1f} %', times=100.0)
_thousandths = partial(shown, 1, by='{:.3f}')
BOUNDS: dict[str, Callable[[Any], object]] = {
    'statement': lambda row: row[0],
    'number': shown(1, 'cases', by='{:.0f}'),
    'sure from': lambda row: (
        'never: too few cases' if row[1]['sure_from'] > 1.0 else f'{row[1]["sure_from"]:.3f}'
    ),
    'sure': _percent('sure'),
    'of these wrong': shown(1, 'wrong', by='{:.0f}'),
}
"""Columns of the table of bounds, each a name and its bound."""
STATEMENTS: dict[str, Callable[[Any], object]] = {
    'statements': lambda row: row[0],
    'number': shown(1, 'statements'),
    'right': lambda row: f'{100.0 * row[1]["right"] / row[1]["statements"]:.1f} %',
    'calibration error': _thousandths('ece', 'value'),
    'by chance': _thousandths('ece_by_chance'),
    'log loss': _thousandths('log_loss'),
    'sure': _percent('sure', 'value'),
    'sure and wrong': shown(1, 'sure_and_wrong'),
    'wrong among the surest 70 %': _percent('wrong_at_70'),
}
"""The same of kinds of statements."""
FAILURES: dict[str, Callable[[Any], object]] = {
    'case': itemgetter('name'),
    **{key: itemgetter(key) for key in ('kind', 'robot', 'motion', 'truth')},
    'sizes [noise]': lambda item: ', '.join(f'{size:.1f}' for size in item['sizes']),
    'said': itemgetter('said'),
}
"""Columns of the table of cases that were sure and wrong."""


LEARNED, JUDGED = 'cases.jsonl.gz', 'held_out.jsonl.gz'


def run(study: Study) -> None:
    args = study.args
    if args.cases or args.held_out:
        require_simulator()
    if args.seed == args.held_out_seed:
        raise DataError(
            '--seed and --held-out-seed must differ: a case is learned from or judged on'
        )
    taught = [row for table in args.learn_from for row in read_rows(Path(table))]
    asked = [row for table in args.judge_on for row in read_rows(Path(table))]
    with study.runner('diagnosing') as runner:
        taught += rows_of(args.seed, args.cases, runner, args.mix)
        drawn = rows_of(args.held_out_seed, args.held_out, runner, args.mix)
        asked += [*with_oracle(drawn[: args.oracle], runner), *drawn[args.oracle :]]
    _refuse_shared(taught, asked)
    write_rows(study.out / LEARNED, taught)
    if asked:
        write_rows(study.out / JUDGED, asked)
    content = fit(taught, args.risk)
    examples = examples_of(asked) if asked else unseen(examples_of(taught), content)
    result = judged(content, asked, examples)
    study.write('weights', content)
    study.write('results', result)
    study.write('belief', page=page(result))


def _refuse_shared(taught: Sequence[Kept], asked: Sequence[Kept]) -> None:
    """Refuse cases that are learned from and judged on, and none to learn from."""
    shared = {row['name'] for row in taught} & {row['name'] for row in asked}
    if shared:
        raise DataError(
            f'case {min(map(str, shared))} is in a table to learn from and in one to judge on'
        )
    if not taught:
        raise DataError('there are no cases to learn from; give --cases or --learn-from')
