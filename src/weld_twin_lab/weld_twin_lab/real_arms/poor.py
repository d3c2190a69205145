# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings that are poor on purpose: does the diagnosis ever do worse than a plain fit?"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import Diagnosis
from weld_twin_core.diagnosis.algebra.problem import Model
from weld_twin_core.effects.plausible import beyond
from weld_twin_core.recording import Recording
from weld_twin_msgs_py.files import markdown

from ..blind.scoring import bootstrap, measured_of, rms
from ..study import tabled
from .rows import halves, size
from .sources import TUNED_ON, Split, all_splits, servo
from .unseen import ALIGN, PLAIN, flagged, plain_fit, residual, tried

Entry = dict[str, Any]
MANY = 120
"""Stations from which on more is asked of the diagnosis."""
WORSE = 1.05
"""Mean error over another from which on it counts as worse."""
REACHED = {True: 'reached', False: '**missed**', None: 'not measured'}


class Measure(NamedTuple):
    """One line of the table: what, the goal in words, what was got, and whether it is reached."""

    what: str
    goal: str
    got: str
    reached: bool | None
    blame: tuple[str, ...] = ()


def measures(entries: Sequence[Entry]) -> list[Measure]:
    splits = [e for e in entries if e['kind'] != 'servo_axis']
    return [
        _never_much_worse(splits),
        _median(splits, MANY, 0.85),
        _median(splits, 0, 1.0),
        _none(
            'splits whose stations that are not flagged are worse than frames only by 5 % or more',
            splits,
            lambda e: any(
                _of(e, region, 'unflagged_over_frames', {'ratio': 0.0})['ratio'] >= WORSE
                for region in ('inside', 'outside')
            ),
        ),
        *_outside(splits),
        _flagged(splits),
        _none('sound splits called unsound', splits, lambda e: e.get('status') == 'unsound'),
        _interval(splits),
        _stable(splits),
        _none(
            'named parameters outside their plausible range',
            splits,
            lambda e: len(e.get('beyond') or ()),
        ),
        _none(
            'identified with nothing named',
            splits,
            lambda e: e.get('status') == 'identified' and not e.get('families'),
        ),
        _none(
            'tracebacks on the splits',
            entries,
            lambda e: bool(
                e.get('traceback') or any(h.get('traceback') for h in e.get('halves', ()))
            ),
        ),
    ]


def _of(entry: Entry, region: str, key: str, otherwise: Any = None) -> Any:
    value = (entry.get(region) or {}).get(key)
    return otherwise if value is None else value


def _none(what: str, entries: Sequence[Entry], count: Callable[[Entry], int]) -> Measure:
    """Return how much there is of what must not be."""
    counts = {e['name']: int(count(e)) for e in entries}
    bad = tuple(name for name, number in counts.items() if number)
    return Measure(what, '0', str(sum(counts.values())), not bad, bad)


def _regions(entries: Sequence[Entry], region: str, key: str) -> list[tuple[Entry, Any]]:
    rows = [(e, _of(e, region, key)) for e in entries]
    return [(e, value) for e, value in rows if value is not None]


def _never_much_worse(entries: Sequence[Entry]) -> Measure:
    pairs = _regions(entries, 'inside', 'over_best')
    bad = tuple(e['name'] for e, r in pairs if r['ratio'] > WORSE and r['low'] > 1.0)
    worst = max((r['ratio'] for _, r in pairs), default=float('nan'))
    return Measure(
        'product over the best of the three plain fits, mean error, inside',
        '<= 1.05 on every split, or its 95 % interval reaches 1',
        f'{len(pairs) - len(bad)} of {len(pairs)}; worst {worst:.2f}',
        not bad,
        bad,
    )


def _median(entries: Sequence[Entry], least: int, goal: float) -> Measure:
    pairs = [
        r['ratio'] for e, r in _regions(entries, 'inside', 'over_best') if e['stations'] >= least
    ]
    which = f'splits of {least} stations or more' if least else 'all splits'
    middle = float(np.median(pairs)) if pairs else float('nan')
    return _below(f'the same, median over {which}', middle, goal)


def _outside(entries: Sequence[Entry]) -> list[Measure]:
    pairs = [(e, r['ratio']) for e, r in _regions(entries, 'outside', 'over_frames')]
    ratios = [ratio for _, ratio in pairs] or [float('nan')]
    bad = tuple(e['name'] for e, ratio in pairs if ratio > WORSE)
    what = 'mean error outside over frames only'
    return [
        _below(f'{what}, worst', max(ratios), WORSE, bad),
        _below(f'{what}, median', float(np.median(ratios)), 0.8),
    ]


def _flagged(entries: Sequence[Entry]) -> Measure:
    pairs = _regions(entries, 'inside', 'flagged')
    count = sum(e['inside']['stations'] for e, _ in pairs)
    share = sum(e['inside']['stations'] * v for e, v in pairs) / max(count, 1)
    return Measure(
        'stations inside that are flagged', '<= 5 %', f'{100 * share:.1f} %', share <= 0.05
    )


def _interval(entries: Sequence[Entry]) -> Measure:
    pairs = [e for e, _ in _regions(entries, 'inside', 'over_frames') if e.get('claimed')]
    bad = []
    for e in pairs:
        rms, (low, high) = e['inside']['rms_m'], e['claimed']['ci95']
        if not low <= rms['product'] / rms['frames'] <= high:
            bad.append(e['name'])
    return _most('95 % interval of the shrink holds', '>= 90 % of splits', len(pairs), bad, 0.0)


def _stable(entries: Sequence[Entry]) -> Measure:
    """Return how often odd and even halves agree on status and families."""
    by_name = {e['name']: e for e in entries}
    pairs = [(e['name'], *e['halves']) for e in entries if e.get('halves')]
    for e in entries:
        if e['kind'] == 'odd' and f'{e["robot"]}_even' in by_name:
            pairs.append((f'{e["robot"]} odd/even', e, by_name[f'{e["robot"]}_even']))
    bad = [
        name
        for name, one, other in pairs
        if any(one.get(key) != other.get(key) for key in ('status', 'families'))
    ]
    what = 'same status and families on odd and even halves'
    return _most(what, '>= 90 %', len(pairs), bad, 1.0)


def _most(what: str, goal: str, count: int, bad: Sequence[str], of_none: float) -> Measure:
    """Return whether nine of ten are good; ``of_none`` is their share where there are none."""
    good = count - len(bad)
    share = good / count if count else of_none
    return Measure(what, goal, f'{good} of {count}', share >= 0.9, tuple(bad))


def _below(what: str, value: float, goal: float, blame: tuple[str, ...] = ()) -> Measure:
    """Return whether a value is low enough, None where nothing was measured."""
    reached = None if np.isnan(value) else value <= goal
    return Measure(what, f'<= {goal}', f'{value:.2f}', reached, blame)


def page(entries: Sequence[Entry], measured: Sequence[Measure]) -> str:
    """Return measures, mean errors of splits [mm], and what models leave of the axis [µm RMS]."""
    goals = [(m.what, m.goal, m.got, REACHED[m.reached]) for m in measured]
    splits = [entry for entry in entries if entry['kind'] != 'servo_axis']
    parts = [markdown.table(('measure', 'goal', 'got', ''), *goals), tabled(SPLITS, splits)]
    for entry in entries:
        if entry['kind'] == 'servo_axis':
            rows = [(name, f'{1e6 * rms:.1f}') for name, rms in entry['rms_m'].items()]
            parts.append(markdown.table(('model', 'left [µm RMS]'), *rows))
    return '\n'.join(parts)


def _mm(region: str, name: str) -> Callable[[Entry], str]:
    """Return what tells the mean error of a model in a region [mm]."""

    def in_words(entry: Entry) -> str:
        mean = _of(entry, region, 'mean_m', {}).get(name)
        return '' if mean is None else f'{1e3 * mean:.3f}'

    return in_words


def _ratio(region: str, key: str) -> Callable[[Entry], str]:
    """Return what tells a ratio in a region, with its interval."""

    def in_words(entry: Entry) -> str:
        estimate = _of(entry, region, key)
        if estimate is None:
            return ''
        return f'{estimate["ratio"]:.2f} ({estimate["low"]:.2f} to {estimate["high"]:.2f})'

    return in_words


def _verdict(entry: Entry) -> str:
    if entry['traceback']:
        return f'traceback: {entry["traceback"].strip().splitlines()[-1]}'
    sure = '' if entry['confidence'] is None else f', {100 * entry["confidence"]:.0f} %'
    names = ', '.join(entry['families']) or 'nothing named'
    return f'{entry["status"]}{sure}: {names}'


SPLITS: dict[str, Callable[[Entry], object]] = {
    'split': lambda entry: (
        entry['name'] + ' *' * (entry['robot'] == 'ur5' and entry['kind'] in TUNED_ON)
    ),
    'stations': itemgetter('stations'),
    **{name: _mm('inside', name) for name in ('frames', 'geometry', 'gravity', 'product')},
    'over best (95 %)': _ratio('inside', 'over_best'),
    'outside: frames': _mm('outside', 'frames'),
    'outside: product': _mm('outside', 'product'),
    'over frames': _ratio('outside', 'over_frames'),
    'flagged': lambda entry: (
        '' if (share := _of(entry, 'outside', 'flagged')) is None else f'{100 * share:.0f} %'
    ),
    'verdict': _verdict,
}
"""Columns of the table of splits."""


PRODUCT, FRAMES = 'product', 'frames'
AXIS, FITTED = 'servo_axis', 0.6
"""The servo axis, and the share of its recording, from the beginning, that is fitted on."""


@lru_cache(maxsize=1)
def _splits(data: str) -> dict[str, Split]:
    arms = (Path(data) / f'{arm}_laser_tracker' for arm in ('ur5', 'ur10'))
    return {split.name: split for split in all_splits(*arms)}


def names(data: str) -> list[str]:
    """Return what can be judged: forty splits of two measured arms, and a servo axis."""
    return [*_splits(data), AXIS]


def judged(data: str, name: str) -> dict[str, Any]:
    return _axis(data) if name == AXIS else judge(_splits(data)[name])


def judge(split: Split) -> dict[str, Any]:
    robot = catalog.load(split.robot)
    out: dict[str, Any] = {
        'name': split.name,
        'kind': split.kind,
        'robot': split.robot,
        'stations': size(split.train),
    }
    models: dict[str, Model] = {
        name: plain_fit(split.train, robot, families, ALIGN) for name, families in PLAIN.items()
    }
    diagnosis, spent = tried(split.train, robot, align=ALIGN)
    out |= spent
    if diagnosis is None:
        return out
    out |= said(diagnosis)
    if diagnosis.status != 'unsound':
        models[PRODUCT] = diagnosis.model
    for region, stations in (('inside', split.inside), ('outside', split.outside)):
        out[region] = stations and _region(models, split.train, stations, diagnosis)
    if pair := halves(split.train):
        both = [tried(half, robot, align=ALIGN) for half in pair]
        out['halves'] = [said(one) if one else {'traceback': x['traceback']} for one, x in both]
    return out


def said(diagnosis: Diagnosis) -> dict[str, Any]:
    named = sorted({item.effect.name for item in diagnosis.effects})
    families = sorted(family.effect for family in diagnosis.families if family.named)
    return {
        'status': diagnosis.status,
        'confidence': diagnosis.confidence,
        'named': named,
        'families': families or named,
        'reasons': list(diagnosis.reasons),
        'beyond': [
            [item.effect.name, item.effect.site, name, value, limit]
            for item in diagnosis.effects
            for name, value, limit in beyond(diagnosis.model.robot, item.effect)
        ],
        'claimed': diagnosis.shrink
        and {'ratio': diagnosis.shrink.ratio, 'ci95': list(diagnosis.shrink.ci95)},
    }


def _region(
    models: dict[str, Model], train: Recording, stations: Recording, diagnosis: Diagnosis
) -> dict[str, Any]:
    allowed = {PRODUCT: diagnosis.posterior}
    sizes = {
        name: np.linalg.norm(residual(model, train, stations, allowed.get(name))[:3], axis=0)
        for name, model in models.items()
    }
    out: dict[str, Any] = {
        'stations': size(stations),
        'mean_m': {name: float(size.mean()) for name, size in sizes.items()},
        'rms_m': {name: float(np.sqrt((size**2).mean())) for name, size in sizes.items()},
    }
    if PRODUCT not in sizes:
        return out
    mine, frames = sizes[PRODUCT], sizes[FRAMES]
    best = min(PLAIN, key=lambda name: out['mean_m'][name])
    flags = np.zeros(mine.size, dtype=bool)
    if diagnosis.posterior is not None:
        flags = flagged(diagnosis.posterior, stations, measured_of(stations).t)
    rest = ~flags
    return out | {
        'best': best,
        'over_best': paired(mine, sizes[best]),
        'over_frames': paired(mine, frames),
        'flagged': float(flags.mean()),
        'unflagged_over_frames': paired(mine[rest], frames[rest]) if rest.any() else None,
    }


def _axis(data: str) -> dict[str, Any]:
    """Return what is named of the axis, and what is left on the part not fitted on."""
    source = servo(Path(data))
    recording, robot = source.recording, source.robot
    measured = measured_of(recording)
    cut = int(FITTED * measured.t.size)
    rows = np.arange(measured.t.size)
    train, test = (
        recording.with_measured(measured.take(part)) for part in (rows < cut, rows >= cut)
    )
    out: dict[str, Any] = {'name': AXIS, 'kind': AXIS, 'robot': robot.name}
    out['rms_m'] = plain_axis(recording, cut)
    diagnosis, spent = tried(train, robot)
    out |= spent
    if diagnosis is None:
        return out
    out |= said(diagnosis)
    out['found'] = [item.as_dict() for item in diagnosis.effects]
    if diagnosis.status != 'unsound':
        off = residual(diagnosis.model, train, test, diagnosis.posterior)
        out['rms_m'][PRODUCT] = rms(off[2:3].T)
    return out


def plain_axis(recording: Recording, cut: int) -> dict[str, float]:
    """
    Return the RMS error of plain models behind row ``cut``, fitted before it, [m].

    As given; a lag, error proportional to speed; with the sign of the speed; with acceleration.
    """
    t, q = recording.joints.t, recording.joints.q
    error = measured_of(recording).position[:, 2:] - q
    speed = np.gradient(q, t, axis=0)
    columns = [speed, np.sign(speed), np.gradient(speed, t, axis=0)]
    out = {'as given': rms(error[cut:])}
    for k, name in enumerate(('lag', 'lag and sign', 'lag, sign and acceleration')):
        design = np.hstack([*columns[: k + 1], np.ones(q.shape)])
        best = np.linalg.lstsq(design[:cut], error[:cut], rcond=None)[0]
        out[name] = rms(error[cut:] - design[cut:] @ best)
    return out


def paired(mine: Array, other: Array) -> dict[str, Any]:
    """Return the ratio of two mean errors on the same stations, with its 95 % interval."""

    def ratio(rows: Array, axis: int) -> Array:
        means = rows.mean(axis=axis)
        return np.asarray(means[..., 0] / np.maximum(means[..., 1], 1e-300))

    estimate = bootstrap(np.stack([mine, other], axis=1), ratio)
    return {'ratio': estimate.value, 'low': estimate.low, 'high': estimate.high}
