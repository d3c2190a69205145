# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Measurements of claims about many errors together: sums, cumulative drift, the ranking."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ...arrays import Array
from ..evaluate import draws_at, exact_deviations, model
from ..sobol import SobolDesign
from ..sweep import DEGREE, cumulative, scenario_deviations
from ..tolerance import with_draws
from .claim_case import Case, Measure

_GROUPS = {
    'joint_offset': 'angular',
    'link_twist': 'angular',
    'backlash': 'backlash',
    'link_length': 'length',
    'base_pose': 'initial',
}
_ORDER = ('angular', 'backlash', 'length', 'initial')
"""The paper's final ranking (V.vii), the strongest first."""
_DRAWS = 200
"""Draws of all errors at once, of which median and extremes are reported."""
_RANKED = 500
"""Scalings of the tolerances under which the order of the groups is looked at."""
_FACTOR = 3.0
"""Tolerances of a group are multiplied by up to this, or divided, to see whether ranks hold."""


def _sums(case: Case) -> dict[str, float]:
    """Measure the deviation by all errors over the sum of those by each source."""
    study, tolerances = case.smooth, case.tolerances
    rng = np.random.default_rng(case.seed)
    draws = draws_at(tolerances, rng.random((_DRAWS, len(tolerances))))
    combined = np.linalg.norm(exact_deviations(study, tolerances, draws), axis=-1)
    labels = np.array([_GROUPS[t.effect] for t in tolerances])
    parts = np.zeros_like(combined)
    for label in _ORDER:
        own = [k for k, name in enumerate(labels) if name == label]
        effects = with_draws((), [tolerances[k] for k in own], draws[:, own])
        parts = parts + np.linalg.norm(study.deviations(effects), axis=-1)
    ratio = combined / parts
    peaks = combined.max(axis=1) / parts.max(axis=1)
    return {
        'combined_ratio_median': np.median(peaks),
        'combined_ratio_max': ratio.max(),
        'combined_exceeds': (ratio > 1.0).mean(),
        **_coupling(case, draws, combined),
    }


def _coupling(case: Case, draws: Array, combined: Array) -> dict[str, float]:
    """Return the part of the deviation that no sum of single errors explains."""
    study, tolerances = case.smooth, case.tolerances
    each = np.zeros((len(draws[:20]), study.samples, 3))
    for k, tolerance in enumerate(tolerances):
        each += exact_deviations(study, (tolerance,), draws[:20, k : k + 1])
    joint = exact_deviations(study, tolerances, draws[:20])
    remaining = np.linalg.norm(joint - each, axis=-1).max(axis=1)
    return {'coupling': float((remaining / combined[:20].max(axis=1)).max())}


def _drift(case: Case) -> dict[str, float]:
    """Measure how the cumulative deviation grows with the path, by source and together."""
    study = case.smooth
    # Equal steps of arc length: on a time law the sum would follow the speed, not the path.
    grid = np.linspace(0.0, study.length, study.samples)
    out = {}
    for name, off in scenario_deviations(study).items():
        distance = np.interp(grid, study.s, np.linalg.norm(off, axis=-1))
        total = cumulative(distance[:, None])
        out[name] = growth_exponent(grid, total)
    off = scenario_deviations(study)['angular']
    speed = np.linalg.norm(off, axis=-1)
    return {
        'drift_exponent_angular': out['angular'],
        'drift_exponent_combined': out['combined'],
        'drift_exponent_init': out['initialization'],
        'drift_spread_angular': np.ptp(speed) / speed.mean(),
    }


def growth_exponent(path: Array, total: Array) -> float:
    """Return the power of the path length with which a sum grows over its second half."""
    late = slice(len(path) // 2, None)
    return float(np.polyfit(np.log(path[late]), np.log(total[late]), 1)[0])


def _ranking(case: Case) -> dict[str, float]:
    """Measure the ranking by group Sobol indices, and how it stands changed tolerances."""
    tolerances = case.tolerances
    labels = tuple(_GROUPS[t.effect] for t in tolerances)
    design = SobolDesign(tuple(t.name for t in tolerances), 1024, labels, case.seed)
    fast = model(case.aggressive, tolerances)
    result = design.indices(fast.at_probabilities(design.samples()).d_norm)
    total = dict(zip(result.names, result.total, strict=True))
    out = {f'ST_{label}': total[label] for label in _ORDER}
    out['ST_half'] = float(result.total_half.max())
    out['rank_holds'] = all(total[a] > total[b] for a, b in pairwise(_ORDER))
    return out | _stability(case) | _per_unit(case)


def _stability(case: Case) -> dict[str, float]:
    """Return how often groups keep the paper's order when their tolerances change."""
    square = dict.fromkeys(_ORDER, 0.0)
    for tolerance, value in zip(case.local.tolerances, case.local.contribution, strict=True):
        square[_GROUPS[tolerance.effect]] += float(value) ** 2
    size = np.sqrt([square[label] for label in _ORDER])
    rng = np.random.default_rng(case.seed)
    scaled = size * _FACTOR ** rng.uniform(-1.0, 1.0, (_RANKED, len(_ORDER)))
    return {
        'rank_share': float((np.diff(scaled, axis=1) < 0.0).all(axis=1).mean()),
        'rank_first_share': float((scaled.argmax(axis=1) == 0).mean()),
        **{f'contribution_{label}_m': v for label, v in zip(_ORDER, size, strict=True)},
    }


def _per_unit(case: Case) -> dict[str, float]:
    """Return the strongest coefficient of each group per degree or per millimetre [mm]."""
    best = dict.fromkeys(_ORDER, 0.0)
    for tolerance, value in zip(case.local.tolerances, case.local.peak, strict=True):
        unit = 1e3 * DEGREE if tolerance.unit == 'rad' else 1.0
        label = _GROUPS[tolerance.effect]
        best[label] = max(best[label], float(value) * unit)
    return {f'unit_{label}': value for label, value in best.items()}


MEASURES: tuple[Measure, ...] = (_sums, _drift, _ranking)
