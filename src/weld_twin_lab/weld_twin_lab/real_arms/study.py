# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Every row diagnosed, each reported cause held against unseen data, and the table of it all."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.contacts import spreads
from weld_twin_core.diagnosis import Diagnosis
from weld_twin_core.diagnosis.algebra.problem import Model
from weld_twin_core.effects import REGISTRY
from weld_twin_core.errors import DataError
from weld_twin_core.recording import Recording
from weld_twin_nodes.offline.task_pool import Task

from ..belief.learning import NAMES
from ..belief.trial import write_rows
from ..blind.scoring import rms
from ..study import Study, head, tabled
from . import poor
from .borne_out import Borne, borne_out
from .rows import ArmRow, halves, plans, row, size
from .unseen import PLAIN, plain_fit, residual, tried

REPORTED = 0.5
"""Probability from which on a cause counts as reported: it is likelier right than wrong."""
ELSEWHERE = ('instrument', 'base', 'clock')
"""Places outside the arm."""


def judged(data: str, name: str) -> dict[str, Any]:
    """Return what is reported of one row, and what unseen data say of it, as plain JSON values."""
    plan = next(each for each in plans() if each.name == name)
    one = row(Path(data), plan)
    options = {'align': one.align, 'experiment': False}
    diagnosis, spent = tried(one.fitted, one.robot, **options)
    out: dict[str, Any] = {'name': name, 'stations': size(one.fitted), **spent}
    if diagnosis is None:
        return out
    out |= _said(diagnosis)
    claims, named = reported_claims(out), reported_claims(out, least=0.0)
    if diagnosis.status != 'unsound':
        known = [each.effect for each in diagnosis.effects]
        sets = [claim['kinds'] for claim in named]
        kinds, borne = borne_out(one, known, sets, _kinds_of(claims))
        out['kinds'] = {kind: _plain(each) for kind, each in kinds.items()}
        for claim, (whole, beside) in zip(named, borne, strict=True):
            claim |= {'against_all': _plain(whole), 'against_told': _plain(beside)}
        by_kinds = {tuple(claim['kinds']): claim for claim in named}
        claims = [by_kinds[tuple(claim['kinds'])] | claim for claim in claims]
    out['claims'] = claims
    out['examples'] = _examples(diagnosis, out['causes'], named)
    out['unseen_m'] = _unseen(one, diagnosis)
    pair = halves(one.fitted) if plan.halved else None
    if pair is not None:
        both = [tried(half, one.robot, **options)[0] for half in pair]
        out['halves'] = [half and _said(half) for half in both]
    return out


def _examples(
    diagnosis: Diagnosis, causes: Sequence[Mapping[str, Any]], claims: Sequence[Mapping[str, Any]]
) -> list[list[Any]]:
    """
    Return every statement that a name is right, for belief to be learned.

    Of those believed too little to be reported, too: learned from the others alone, belief would
    only ever fall.

    claims: of all that has a name, however probable.
    """
    out = []
    for said in map(vars, diagnosis.statements):
        if said['kind'] in NAMES:
            kinds = {kind for kind, _, _ in causes[said['cause']]['names']}
            own = [claim for claim in claims if kinds == set(claim['kinds'])]
            if own:
                right = _holds(own[0], 'against_told')
                sure = bool(causes[said['cause']]['sure'])
                out.append([said['kind'], said['features'], right, said['probability'], sure])
    return out


def taught(entries: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return rows as belief is learned from: of every row what was said, and whether it holds."""
    return [
        {'name': e['name'], 'error': None, 'mix': 'real arms', 'examples': e['examples']}
        for e in entries
        if e.get('examples')
    ]


def reported_claims(said: Mapping[str, Any], least: float = REPORTED) -> list[dict[str, Any]]:
    """
    Return what is reported by name: sets of kinds, their joints, and whether each is placed.

    Names reported as alike are one claim.

    least: probability from which on a cause counts as reported.
    """
    out: dict[tuple[str, ...], dict[str, Any]] = {}
    for cause in said['causes']:
        names = [n for n in cause['names'] if n[0] in REGISTRY and REGISTRY[n[0]].traits.cause]
        if cause['probability'] <= least or cause['rest'] or not names:
            continue
        kinds = tuple(sorted({kind for kind, _, _ in names}))
        claim = out.setdefault(kinds, {'kinds': list(kinds), 'joints': [], 'share': 0.0})
        claim['joints'] += [joint for _, joint, _ in names if joint is not None]
        claim['share'] += cause['share']
    for claim in out.values():
        joints = [REGISTRY[kind].of in ('joint', 'link') for kind in claim['kinds']]
        claim['placed'] = bool(claim['joints']) or not any(joints)
    return list(out.values())


def worth(entry: Mapping[str, Any], against: str) -> float:
    """Return what a row counts: 1 where a claim is borne out, a half where that has no joint."""
    each = [1.0 if c['placed'] else 0.5 for c in entry.get('claims', ()) if _holds(c, against)]
    return max(each, default=0.0)


def summary(entries: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    done = [e for e in entries if 'status' in e]
    claims = [c for e in done for c in e['claims']]
    shown = [(e, k) for e in done for k, b in e.get('kinds', {}).items() if b['out']]
    pairs = [e['halves'] for e in done if e.get('halves') and None not in e['halves']]
    alike = [_alike(*(reported_claims(half) for half in pair)) for pair in pairs]
    ratios = [ratio for e in done if (ratio := _over_plain(e)) is not None]
    return {
        'rows': len(entries),
        'tracebacks': sum(e['traceback'] is not None for e in entries),
        'unknown': sum(e['status'] == 'unknown' for e in done),
        'unsound': sum(e['status'] == 'unsound' for e in done),
        'reported a cause borne out against all that is reported': sum(
            worth(e, 'against_told') for e in entries
        ),
        'told a cause borne out against all kinds': sum(worth(e, 'against_all') for e in entries),
        'claims': len(claims),
        'claims borne out against all that is reported': sum(
            _holds(c, 'against_told') for c in claims
        ),
        'claims borne out against all kinds': sum(_holds(c, 'against_all') for c in claims),
        'kinds borne out against all others': len(shown),
        'of these told': sum(k in _kinds_of(e['claims']) for e, k in shown),
        'rows with something outside the arm accused': sum(_accused(e) for e in done),
        'pairs of halves': len(pairs),
        'halves with the same kinds': sum(a == 1.0 for a in alike),
        'claims of a half that the other shares': float(np.mean(alike)) if alike else None,
        'error over the best plain fit, median': float(np.median(ratios)) if ratios else None,
        'error over the best plain fit, worst': float(max(ratios)) if ratios else None,
        'seconds': sum(e['seconds'] for e in entries),
    }


def table(entries: Sequence[Mapping[str, Any]]) -> str:
    figures = [f'- {key}: {_figure(value)}' for key, value in summary(entries).items()]
    return '\n'.join(['# Real arms', '', tabled(COLUMNS, entries), *figures]) + '\n'


def _over_plain(entry: Mapping[str, Any]) -> float | None:
    """Return the unseen error over that of the best plain fit; None where there is none."""
    unseen = entry.get('unseen_m') or {}
    plain = min((v for k, v in unseen.items() if k != 'product'), default=None)
    return unseen['product'] / plain if plain and 'product' in unseen else None


def _bold(claim: Mapping[str, Any]) -> str:
    words = ' or '.join(claim['kinds'])
    joints = ', '.join(dict.fromkeys(claim['joints']))
    mark = '**' if _holds(claim, 'against_told') else ''
    return f'{mark}{words}{mark}' + (f' ({joints})' if joints else '')


def _holds(claim: Mapping[str, Any], against: str) -> bool:
    return bool(claim.get(against, {'out': False})['out'])


def _kinds_of(claims: Sequence[Mapping[str, Any]]) -> set[str]:
    return {kind for claim in claims for kind in claim['kinds']}


def _plain(borne: Borne) -> dict[str, Any]:
    return {'median': borne.median, 'least': borne.least, 'out': borne.out}


def _figure(value: float | None) -> str:
    return '' if value is None else f'{value:.3g}' if isinstance(value, float) else str(value)


def _rest(cause: Mapping[str, Any]) -> str:
    place = cause['place'][0] if cause['place'] else ('somewhere', 0.0)
    return f'{place[0]} ({100.0 * cause["share"]:.0f} %)'


def _alike(one: Sequence[Mapping[str, Any]], two: Sequence[Mapping[str, Any]]) -> float:
    """Return the share of the claims of two halves that have a kind in common with the other's."""
    shared = [
        bool(_kinds_of([claim]) & _kinds_of(others))
        for own, others in ((one, two), (two, one))
        for claim in own
    ]
    return float(np.mean(shared)) if shared else 1.0


COLUMNS: dict[str, Callable[[Mapping[str, Any]], str]] = {
    'row': itemgetter('name'),
    'status': lambda e: e.get('status', 'traceback'),
    'reported; borne out against all that is reported: bold': lambda e: ', '.join(
        _bold(claim) for claim in e.get('claims', ())
    ),
    'left beside': lambda e: ', '.join(_rest(c) for c in e.get('causes', ()) if c['rest']),
    'error over the best plain fit': lambda e: (
        '' if (ratio := _over_plain(e)) is None else f'{ratio:.2f}'
    ),
}
"""Columns of the table of rows."""


def _accused(entry: Mapping[str, Any]) -> bool:
    """Return whether something outside the arm is reported without a name, as likely as not."""
    return any(
        not cause['names'] and place in ELSEWHERE and p > REPORTED
        for cause in entry['causes']
        for place, p in cause['place'][:1]
    )


def _said(diagnosis: Diagnosis) -> dict[str, Any]:
    causes = [
        {
            **{key: getattr(c, key) for key in ('probability', 'sure', 'share', 'rest')},
            'place': [list(item) for item in c.place[:3]],
            'dependence': [list(item) for item in c.dependence[:3]],
            'names': [[s.effect, s.joint, p] for s, p in c.name],
        }
        for c in diagnosis.causes
    ]
    return {
        **{key: getattr(diagnosis, key) for key in ('status', 'confidence', 'sure')},
        'families': bool(diagnosis.families),
        'reasons': list(diagnosis.reasons),
        'causes': causes,
        'gap_m': diagnosis.gap and diagnosis.gap.rms_m,
        'shrink': diagnosis.shrink and diagnosis.shrink.ratio,
    }


def _unseen(one: ArmRow, diagnosis: Diagnosis) -> dict[str, float] | None:
    """Return the RMS error [m] of plain fits and of the diagnosis on what was not fitted."""
    if one.other is None or diagnosis.status == 'unsound':
        return None
    if one.other.contacts is not None:
        return {'product': _spread(diagnosis.model, one.other)}
    fitted, other, allowed = one.fitted, one.other, diagnosis.posterior
    out = {'product': rms(residual(diagnosis.model, fitted, other, allowed)[:3].T)}
    for name, families in PLAIN.items():
        model = plain_fit(fitted, one.robot, families, frozenset(one.align))
        out[name] = rms(residual(model, fitted, other)[:3].T)
    return out


def _spread(model: Model, other: Recording) -> float:
    assert other.contacts is not None
    points = model.twin(0).poses(other, other.joints.t).position
    each = np.concatenate(list(spreads(other.contacts, points).values()))
    return float(np.sqrt((each**2).mean()))


def run(study: Study) -> bool:
    data = study.args.data
    if not Path(data).is_dir():
        raise DataError(f"'{data}' is no directory; --data names the parent of the recordings")
    every = poor.names(data) if study.args.poor else [plan.name for plan in plans()]
    judge = poor.judged if study.args.poor else judged
    tasks = [Task(judge, (data, name), name) for name in every if study.args.only in name]
    entries = study.tasks(tasks, 'diagnosing')
    if study.args.poor:
        measures = poor.measures(entries)
        result = head('transfer/1', measures=[m._asdict() for m in measures], splits=entries)
        study.write('poor', result, poor.page(entries, measures))
        return all(m.reached is not False for m in measures)
    study.write('real_arms', {'summary': summary(entries), 'rows': entries}, table(entries))
    write_rows(study.out / 'told.jsonl', taught(entries))
    return True
