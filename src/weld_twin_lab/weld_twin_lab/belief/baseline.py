# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What an engine says of cells with one to six causes, kept as a small table and scored.

The table holds answers alone, so that engines are compared case by case, whatever their code.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from weld_twin_core.diagnosis.calibration.features import WIDEST
from weld_twin_msgs_py.files import markdown

from ..blind.ambiguous import Site
from ..blind.judging import CONFIDENT, is_sure
from ..blind.statistics import Estimate, bootstrap, calibration_error, share
from .levels_of_truth import Levels, alike_by_structure, levels_of
from .mix import MOST as CAUSES
from .rows import rounded
from .whole import whole

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
    """
    Return what is kept of a row: its truth and what was said, without the signs.

    row: as `trial.tried` gives it of this mix.
    """
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
    """One case, scored."""

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
    """
    Return a row held against its truth.

    row: as `brief` gives it, without an error.
    """
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
    """
    Return the measures of an engine, each with its interval.

    rows: as `brief` gives them.
    """
    cases = [
        scored(row) for row in rows if not row['error'] and row['verdict']['status'] != 'unsound'
    ]
    plain = [c for c in cases if not c.withheld]
    reported = [one for c in cases for one in c.reported]
    sure = [c for c in cases if c.sure]
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
        'sure': share([c.sure for c in cases]) if sure else share([False for _ in cases]),
        'seconds, median': bootstrap([c.seconds for c in cases]),
    }


def _flat(parts: Any) -> list[bool]:
    return [value for part in parts for value in part]


def page(tables: Mapping[str, Sequence[Mapping[str, Any]]]) -> str:
    """
    Return one table of the measures, a column for every engine.

    tables: by the name of the engine.
    """
    each = {name: scores(rows) for name, rows in tables.items()}
    first = next(iter(each.values()))
    body = [(key, *(str(own[key]) for own in each.values())) for key in first]
    return markdown.table(('measure', *each), *body)
