# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings that are poor on purpose: does the diagnosis ever do worse than a plain fit?"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from weld_twin_core.arm import catalog
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import Diagnosis
from weld_twin_core.diagnosis.algebra.problem import Model
from weld_twin_core.effects.plausible import beyond
from weld_twin_core.recording import Recording

from ..blind.statistics import bootstrap
from .sources import servo
from .splits import Split, all_splits, halves
from .unseen import ALIGN, PLAIN, flagged, plain_fit, residual, tried

PRODUCT, FRAMES = 'product', 'frames'
HALVES = 60
"""Stations from which on the two halves of a split are diagnosed as well."""
AXIS, FITTED = 'servo_axis', 0.6
"""The servo axis, and the share of its recording, from the beginning, that is fitted on."""


@lru_cache(maxsize=1)
def _splits(data: str) -> dict[str, Split]:
    arms = (Path(data) / f'{arm}_laser_tracker' for arm in ('ur5', 'ur10'))
    return {split.name: split for split in all_splits(*arms)}


def names(data: str) -> list[str]:
    """
    Return what can be judged: forty splits of two measured arms, and a servo axis.

    data: directory with the sources.
    """
    return [*_splits(data), AXIS]


def judged(data: str, name: str) -> dict[str, Any]:
    """Return what came of one of `names`, as plain JSON values."""
    return _axis(data) if name == AXIS else judge(_splits(data)[name])


def judge(split: Split) -> dict[str, Any]:
    """Return what came of one split, as plain JSON values."""
    robot = catalog.load(split.robot)
    out: dict[str, Any] = {
        'name': split.name,
        'kind': split.kind,
        'robot': split.robot,
        'stations': _count(split.train),
    }
    models: dict[str, Model] = {
        name: plain_fit(split.train, robot, families, ALIGN) for name, families in PLAIN.items()
    }
    start = perf_counter()
    diagnosis, error = tried(split.train, robot, align=ALIGN)
    out['seconds'] = round(perf_counter() - start, 2)
    out['traceback'] = error
    if diagnosis is None:
        return out
    out |= said(diagnosis)
    if diagnosis.status != 'unsound':
        models[PRODUCT] = diagnosis.model
    for region, stations in (('inside', split.inside), ('outside', split.outside)):
        out[region] = None
        if stations is not None and _count(stations):
            out[region] = _region(models, split.train, stations, diagnosis)
    if _count(split.train) >= HALVES:
        pair = [tried(half, robot, align=ALIGN) for half in halves(split.train)]
        out['halves'] = [said(half) if half else {'traceback': text} for half, text in pair]
    return out


def said(diagnosis: Diagnosis) -> dict[str, Any]:
    """Return status, confidence, what is named, and whether a machine can have it."""
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
    """Return the errors of every model on some stations, and how they compare."""
    allowed = {PRODUCT: diagnosis.posterior}
    sizes = {
        name: _sizes(residual(model, train, stations, allowed.get(name)))
        for name, model in models.items()
    }
    out: dict[str, Any] = {
        'stations': _count(stations),
        'mean_m': {name: float(size.mean()) for name, size in sizes.items()},
        'rms_m': {name: float(np.sqrt((size**2).mean())) for name, size in sizes.items()},
    }
    if PRODUCT not in sizes:
        return out
    mine, frames = sizes[PRODUCT], sizes[FRAMES]
    best = min(PLAIN, key=lambda name: out['mean_m'][name])
    flags = np.zeros(mine.size, dtype=bool)
    if diagnosis.posterior is not None and stations.measured is not None:
        flags = flagged(diagnosis.posterior, stations, stations.measured.t)
    out['best'] = best
    out['over_best'] = paired(mine, sizes[best])
    out['over_frames'] = paired(mine, frames)
    out['flagged'] = float(flags.mean())
    rest = ~flags
    out['unflagged_over_frames'] = paired(mine[rest], frames[rest]) if rest.any() else None
    return out


def _axis(data: str) -> dict[str, Any]:
    """Return what is named of the axis, and what is left on the part not fitted on."""
    source = servo(Path(data))
    recording, robot = source.recording, source.robot
    measured = recording.measured
    assert measured is not None
    cut = int(FITTED * measured.t.size)
    rows = np.arange(measured.t.size)
    train, test = (
        recording.with_measured(measured.take(part)) for part in (rows < cut, rows >= cut)
    )
    out: dict[str, Any] = {'name': AXIS, 'kind': AXIS, 'robot': robot.name}
    out['rms_m'] = plain_axis(recording, cut)
    start = perf_counter()
    diagnosis, error = tried(train, robot)
    out |= {'seconds': round(perf_counter() - start, 2), 'traceback': error}
    if diagnosis is None:
        return out
    out |= said(diagnosis)
    out['found'] = [item.as_dict() for item in diagnosis.effects]
    if diagnosis.status != 'unsound':
        out['rms_m'][PRODUCT] = _rms(
            residual(diagnosis.model, train, test, diagnosis.posterior)[2]
        )
    return out


def plain_axis(recording: Recording, cut: int) -> dict[str, float]:
    """
    Return the RMS error of plain models behind row ``cut``, fitted before it, [m].

    As given; a lag, error proportional to speed; with the sign of the speed; with acceleration.
    """
    assert recording.measured is not None
    t, q = recording.joints.t, recording.joints.q[:, 0]
    error = recording.measured.position[:, 2] - q
    speed = np.gradient(q, t)
    columns = [speed, np.sign(speed), np.gradient(speed, t)]
    out = {'as given': _rms(error[cut:])}
    for k, name in enumerate(('lag', 'lag and sign', 'lag, sign and acceleration')):
        design = np.stack([*columns[: k + 1], np.ones(q.size)], axis=1)
        best = np.linalg.lstsq(design[:cut], error[:cut], rcond=None)[0]
        out[name] = _rms(error[cut:] - design[cut:] @ best)
    return out


def _rms(error: Array) -> float:
    return float(np.sqrt((error**2).mean()))


def paired(mine: Array, other: Array) -> dict[str, Any]:
    """Return the ratio of two mean errors on the same stations, with its 95 % interval."""

    def ratio(rows: Array, axis: int) -> Array:
        means = rows.mean(axis=axis)
        return np.asarray(means[..., 0] / np.maximum(means[..., 1], 1e-300))

    estimate = bootstrap(np.stack([mine, other], axis=1), ratio)
    return {'ratio': estimate.value, 'low': estimate.low, 'high': estimate.high}


def _sizes(parts: Array) -> Array:
    return np.asarray(np.linalg.norm(parts[:3], axis=0))


def _count(recording: Recording) -> int:
    return 0 if recording.measured is None else int(recording.measured.t.size)
