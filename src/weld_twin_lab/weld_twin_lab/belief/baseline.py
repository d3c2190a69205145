# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What an engine says of cells with one to six causes, kept as a small table and scored.

The table holds answers alone, so that engines are compared case by case, whatever their code.

More data never hurts: a cause that was sure and right stays so with another recording, and no
answer hangs on which recording was given first. Cells that grow tell.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.diagnosis.calibration.features import WIDEST
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files import markdown
from weld_twin_nodes.cli.given import pair
from weld_twin_nodes.offline.task_pool import Task

from ..blind.blind_cell import take
from ..blind.cause_sizes import Site
from ..blind.making import MOTIONS_OF, truth_of
from ..blind.scoring import CONFIDENT, Estimate, bootstrap, calibration_error, is_sure, share
from ..study import Study, require_simulator, tabled
from .judged import Levels, alike_by_structure, levels_of, whole
from .trial import MOST as CAUSES
from .trial import (
    SEVERAL,
    SPANS,
    diagnosed,
    drawn,
    read_rows,
    recordings_of,
    rounded,
    said,
    tried,
    write_rows,
)

MOST = 2 * CAUSES
"""Effects of a model that are kept; more are many small errors."""
REASON = 80
"""Letters of a reason that are kept."""
ACCUSED = 0.1
"""Share of the squared gap from which on a reported place is accused of it."""
REPORTED = 0.5
"""Probability from which on a cause counts as reported."""
BETTER = 0.8
"""RMS on sealed data, as a share of that before, up to which a model explains it."""
CURVES = frozenset({'joint_curve', 'frame_curve'})


def brief(row: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is kept of a row of `trial.tried`: its truth and what was said, without the signs."""
    if row['error']:
        return {'name': row['name'], 'error': row['error']}
    truth, verdict = row['truth'], row['verdict']
    kept = ('robot', 'motion', 'align', 'excluded', 'sites', 'floor_m', 'ratios', 'shown')
    verdict_keys = ('status', 'confidence', 'sure', 'complete', 'indistinguishable')
    model = [site for site in row['model'] if site[0] not in CURVES]
    out = {
        'name': row['name'],
        'error': None,
        'truth': {key: truth[key] for key in kept},
        'verdict': {
            **{key: verdict.get(key) for key in verdict_keys},
            'reasons': [reason[:REASON] for reason in verdict['reasons'][:1]],
            'causes': [_brief(cause) for cause in verdict['causes']],
        },
        'model': model if len(model) <= MOST else [],
        'sealed': {key: row['sealed'].get(key) for key in ('before', 'after')},
        'seconds': row['seconds'],
    }
    return dict(rounded(out))


def _brief(cause: Mapping[str, Any]) -> dict[str, Any]:
    """Return a cause of any schema with the best of each level, and how probable its name is."""
    names = [item for item in cause['name'] if item['effect'] not in CURVES]
    total = min(sum(item['probability'] for item in names), 1.0)
    return {
        'at': [(item['at'], item['probability']) for item in cause['place'][:WIDEST]],
        'name': [(item['effect'], item['joint']) for item in names],
        'probability': cause.get('probability', total),
        'sure': cause.get('sure'),
        'share': cause['share'],
        'rest': bool(cause.get('rest', not names)),
    }


class Scored(NamedTuple):
    name: str
    causes: int
    """At work."""
    withheld: bool
    named: tuple[bool, ...]
    modelled: tuple[bool, ...]
    """Of every visible cause that the library holds: is it in a set, is it in the model?"""
    reported: tuple[tuple[float, bool, bool], ...]
    """Of every cause reported with a name: its probability, whether it is right, whether it is
    sure."""
    innocent: tuple[str, ...]
    """Places accused at which nothing is wrong."""
    disowned: bool
    """No cause is reported although the model explains much on sealed data."""
    right: bool
    sure: bool
    """The whole answer."""
    confidence: float
    seconds: float
    status: str


def scored(row: Mapping[str, Any]) -> Scored:
    """Return a row of `brief` without an error, held against its truth."""
    truth, verdict = row['truth'], row['verdict']
    answer = whole(truth, verdict)
    model = {(e, j) for e, j in row['model']}
    every = frozenset[Site]().union(
        *(alike_by_structure(truth['robot'], (e, j)) for e, j in truth['sites'])
    )
    reported = tuple(
        (c['probability'], bool({(e, j) for e, j in c['name']} & every), _sure(c))
        for c in verdict['causes']
        if c['name'] and not c['rest']
    )
    return Scored(
        row['name'],
        len(truth['sites']),
        bool(truth['excluded']),
        answer.named,
        tuple(bool(own & model) for own in answer.asked),
        reported,
        _innocent(row, levels_of({**truth, 'construction': None})),
        _disowned(row, reported),
        answer.right,
        is_sure(verdict),
        float(verdict['confidence'] or 0.0),
        float(row['seconds']),
        verdict['status'],
    )


def _sure(cause: Mapping[str, Any]) -> bool:
    return bool(cause['probability'] > CONFIDENT if cause['sure'] is None else cause['sure'])


def _innocent(row: Mapping[str, Any], levels: Sequence[Levels]) -> tuple[str, ...]:
    """Return the places accused at which nothing is wrong."""
    guilty = frozenset[str]().union(*(own.places for own in levels))
    out = []
    for cause in row['verdict']['causes']:
        if not cause['at']:
            continue
        near = any(at in guilty for at, p in cause['at'] if p >= 0.5 * cause['at'][0][1])
        accused = cause['at'][0][1] > CONFIDENT or cause['share'] > ACCUSED
        if accused and not near:
            out.append(str(cause['at'][0][0]))
    return tuple(out)


def _disowned(row: Mapping[str, Any], reported: Sequence[tuple[float, bool, bool]]) -> bool:
    sealed = row['sealed']
    if not row['model'] or sealed['before'] is None:
        return False
    explains = sealed['after'] <= BETTER * sealed['before']
    return explains and not any(p > REPORTED for p, _, _ in reported)


def scores(rows: Sequence[Mapping[str, Any]]) -> dict[str, Estimate]:
    cases = [
        scored(row) for row in rows if not row['error'] and row['verdict']['status'] != 'unsound'
    ]
    plain = [c for c in cases if not c.withheld]
    reported = [one for c in cases for one in c.reported]
    out = {}
    for few, most in ((1, 2), (3, 4), (5, 6)):
        own = [c for c in plain if few <= c.causes <= most]
        out[f'visible causes named, {few} and {most} at work'] = share(_flat(c.named for c in own))
        out[f'the same, in the model, {few} and {most}'] = share(_flat(c.modelled for c in own))
    return {
        **out,
        'cases in which an innocent place is accused': share([bool(c.innocent) for c in cases]),
        'disowned': share([c.disowned for c in cases]),
        'with a family taken out: something is reported above 0.5': share(
            [
                any(p > REPORTED for p, _, _ in c.reported)
                for c in cases
                if c.withheld and c.causes > 1
            ]
        ),
        'whole answers right': share([c.right for c in cases]),
        'whole answers right and sure': share([c.right and c.sure for c in cases]),
        'whole answers sure and wrong': share([c.sure and not c.right for c in cases]),
        'causes reported that are right': share([right for _, right, _ in reported]),
        'causes sure and wrong, of the sure ones': share(
            [not right for _, right, s in reported if s]
        ),
        'calibration error of causes': calibration_error(
            [p for p, _, _ in reported], [r for _, r, _ in reported]
        ),
        'calibration error of whole answers': calibration_error(
            [c.confidence for c in cases], [c.right for c in cases]
        ),
        'unknown': share([c.status == 'unknown' for c in cases]),
        'sure': share([c.sure for c in cases]),
        'seconds, median': bootstrap([c.seconds for c in cases]),
    }


def _flat(parts: Any) -> list[bool]:
    return [value for part in parts for value in part]


def page(tables: Mapping[str, Sequence[Mapping[str, Any]]]) -> str:
    each = {name: scores(rows) for name, rows in tables.items()}
    first = next(iter(each.values()))
    body = [(key, *(str(own[key]) for own in each.values())) for key in first]
    return markdown.table(('measure', *each), *body)


RECORDINGS = 4
"""Recordings of a cell at the most."""
FALL = 0.1
"""Probability that a sure cause may lose by a recording more."""
SAME = 1e-6
"""Probability by which answers on the same recordings in another order may differ."""


def grown(seed: int, number: int) -> dict[str, Any]:
    """Return what is said of a cell with one recording, two, ..., and with all in reverse."""
    name = f'{seed}/{number}'
    try:
        case = drawn(seed, number, SEVERAL).case
    except Exception as error:
        return {'name': name, 'error': f'not drawn: {error}'}
    rng = np.random.default_rng([seed, 7000 + number])
    kinds = MOTIONS_OF.get(case.lot.motion, (case.lot.motion,))
    first = 1 + len(case.also)
    more = [
        take(case.cell, kinds[k % len(kinds)], float(rng.uniform(*SPANS)), rng)
        for k in range(first, RECORDINGS)
    ]
    recordings = recordings_of(case, more)
    orders = [*(range(k + 1) for k in range(RECORDINGS)), range(RECORDINGS)[::-1]]
    try:
        answers = [said(diagnosed(case, [recordings[k] for k in order])) for order in orders]
    except Exception as error:
        return {'name': name, 'error': f'{type(error).__name__}: {error}'}
    kept = [{key: one[key] for key in ('verdict', 'model', 'unsound')} for one in answers]
    truth = truth_of(name, case)
    return {'name': name, 'error': None, 'truth': truth, 'told': kept[:-1], 'turned': kept[-1]}


class GrowingStep(NamedTuple):
    """
    A cause that was sure and right, before and after a recording more.

    ``after`` is 0 where no reported set holds the cause any more; ``sure`` tells whether it still is.
    """

    name: str
    recordings: int
    cause: Site
    before: float
    after: float
    sure: bool

    @property
    def fell(self) -> bool:
        return self.after < self.before - FALL


def steps(row: Mapping[str, Any]) -> Iterator[GrowingStep]:
    """Yield every right cause of a row that was sure, and what a recording more made of it."""
    truth = row['truth']
    for effect, joint in truth['sites']:
        alike = alike_by_structure(truth['robot'], (effect, joint))
        beliefs = [_believed(one['verdict'], alike) for one in row['told']]
        for k, ((before, sure), (after, still)) in enumerate(pairwise(beliefs)):
            if sure:
                yield GrowingStep(row['name'], k + 1, (effect, joint), before, after, still)


def _believed(verdict: Mapping[str, Any], alike: frozenset[Site]) -> tuple[float, bool]:
    """Return how probable a cause is reported, by its whole set, and whether it is sure."""
    best = (0.0, False)
    for cause in verdict['causes']:
        names = {(item['effect'], item['joint']) for item in cause['name']}
        if names & alike:
            best = max(best, (float(cause['probability']), bool(cause['sure'])))
    return best


def apart(row: Mapping[str, Any]) -> float:
    """Return by how much probabilities differ where only the order does; 1 where names do."""
    one, other = (
        {
            (
                frozenset((i['effect'], i['joint']) for i in cause['name']),
                bool(cause.get('rest')),
            ): (cause['probability'] or 0.0)
            for cause in answer['verdict']['causes']
        }
        for answer in (row['told'][-1], row['turned'])
    )
    if one.keys() != other.keys() or row['told'][-1]['unsound'] != row['turned']['unsound']:
        return 1.0
    return max((abs(p - other[key]) for key, p in one.items()), default=0.0)


def growing_page(rows: Sequence[Mapping[str, Any]]) -> str:
    good = [row for row in rows if not row['error']]
    every = [step for row in good for step in steps(row)]
    measures = {
        'sure causes that fall by more than 0.1': share([step.fell for step in every]),
        'sure causes that lose their name': share([step.after == 0.0 for step in every]),
        'sure causes that are sure no longer': share([not step.sure for step in every]),
        'cells whose order changes a name': share([apart(row) == 1.0 for row in good]),
        'cells whose order moves a probability': share([apart(row) > SAME for row in good]),
    }
    lines = [(key, str(value)) for key, value in measures.items()]
    fallen = [step for step in every if step.fell]
    lost = '\n' + tabled(FALLEN, fallen) if fallen else ''
    return markdown.table(('measure', 'value'), *lines) + lost


FALLEN: dict[str, Callable[[GrowingStep], object]] = {
    'cell': attrgetter('name'),
    'recordings': attrgetter('recordings'),
    'cause': lambda step: f'{step.cause[0]} of {step.cause[1]}',
    'sure with': lambda step: f'{step.before:.2f}',
    'one more': lambda step: f'{step.after:.2f}',
}
"""Columns of the table of sure causes that fell."""


def run(study: Study) -> None:
    args = study.args
    if args.cases:
        require_simulator()
    if args.growing:
        if not args.cases or args.beside:
            raise DataError('--growing takes --cases and no --beside')
        tasks = [Task(grown, (args.seed, k), f'cell {k}') for k in range(args.cases)]
        rows = study.tasks(tasks, 'diagnosing')
        write_rows(study.out / 'growing.jsonl', rows)
        study.write('growing', page=growing_page(rows))
        return
    named = [pair(item, '--beside', 'NAME=TABLE') for item in args.beside]
    tables = {name: read_rows(Path(table)) for name, table in named}
    if args.cases:
        tasks = [Task(tried, (args.seed, k, SEVERAL), f'cell {k}') for k in range(args.cases)]
        tables['this engine'] = [brief(row) for row in study.tasks(tasks, 'diagnosing')]
        write_rows(study.out / 'answers.jsonl', tables['this engine'])
    if not tables:
        raise DataError('there is nothing to score; give --cases, or --beside, or both')
    study.write('baseline', page=page(tables))
