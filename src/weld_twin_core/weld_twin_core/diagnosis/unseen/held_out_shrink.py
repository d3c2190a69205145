# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How far the gap shrinks on data that were not used for fitting."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...effects.dated import ways_seen
from ...recording import Recording
from ..algebra.fit import fit, robust_scale, trusted
from ..algebra.independent_rows import FEWEST
from ..algebra.posed import by_place, posed
from ..algebra.problem import Model, Problem, usable
from ..beliefs import CAUSES, Beliefs
from ..evidence import Search
from ..negligible import EMPTY
from ..result import Shrink
from .folds import STRETCHES, jackknife, posture_regions, student
from .unseen_stretches import Unseen

WITHIN = 0.95
"""Share of such ratios that the interval told of one shall hold."""


def held_out_shrink(
    result: Search, unseen: Unseen, holdout: Sequence[Recording], beliefs: Beliefs
) -> Shrink:
    """Return the gap before and after, on the held-out bags or by cross-validation."""
    model = result.final.model
    steps, alone = _waterfall(unseen, model)
    turned = unseen.turn_rms(unseen.bare), unseen.turn_rms(unseen.whole)
    both = _judged(unseen), _judged(unseen.by(posture_regions(unseen.problem)))
    if holdout:
        source = ', '.join(r.name for r in holdout)
        pair = _on_bags(result, holdout, beliefs.other_setup)
        ratio, interval = ratio_interval(*pair, both[0].ratio, beliefs.farthest)
        rms = _rms(pair[0]), _rms(pair[1])
    else:
        source, reported = 'blocked cross-validation', both[0]
        if result.problem.at_rest:
            reported = max(both, key=lambda one: one.ratio)
        rms, ratio, interval = reported.rms, reported.ratio, _of_others(both, 1)
    return Shrink(
        rms_before_m=rms[0],
        rms_after_m=rms[1],
        ratio=ratio,
        ci95=interval,
        elsewhere_ci95=_of_others(both, both[1].parts),
        held_out=source,
        steps=steps,
        alone=alone,
        orientation_rad=None if turned[0] is None or turned[1] is None else (turned[0], turned[1]),
    )


def left_on(result: Search, holdout: Sequence[Recording], beliefs: Beliefs) -> float:
    """Return what the final model leaves on held-out recordings, RMS over trusted samples [m]."""
    return float(np.sqrt(_on_bags(result, holdout, beliefs.other_setup)[1].mean()))


def _log_sizes(squares: Array, labels: Array) -> Array:
    """Return the logarithm of an RMS with each fold left out in turn."""
    means = [squares[labels != name].mean() for name in np.unique(labels)]
    return np.asarray(np.log(np.maximum(means, EMPTY)) / 2.0)


class Judged(NamedTuple):
    """RMS before and after [m], their ratio, its 95 % interval, and of how many parts it is."""

    rms: tuple[float, float]
    ratio: float
    interval: tuple[float, float]
    parts: int


def _of_others(judged: Sequence[Judged], among: int) -> tuple[float, float]:
    """
    Return the interval of what another motion will show, however the parts were cut.

    One that is as large as ``among``-th of the motions judged varies about the truth that many times
    as much as they do, and they vary besides: a motion like all of it counts twice, one in a region
    of posture that was not recorded as often as there are regions, and once more.
    """
    ends = [one.interval for one in judged]
    for k, (ratio, interval, _) in enumerate(one[1:] for one in judged):
        if ratio > 0.0:
            low, high = (ratio * float((e / ratio) ** np.sqrt(1.0 + among)) for e in interval)
            ends[k] = low, high
    return min(low for low, _ in ends), max(high for _, high in ends)


def _judged(unseen: Unseen) -> Judged:
    before, after = unseen.squares(unseen.bare), unseen.squares(unseen.whole)
    labels = unseen.trusted_labels()
    ratio, interval = ratio_interval(before, after, labels)
    parts = int(np.unique(labels).size)
    return Judged((_rms(before), _rms(after)), ratio, interval, parts)


def _rms(squares: Array) -> float:
    return float(np.sqrt(squares.mean()))


def _waterfall(
    unseen: Unseen, model: Model
) -> tuple[tuple[tuple[str, float], ...], tuple[tuple[str, float], ...]]:
    """Return RMS in unseen folds as families are added, the best alone first, and of each alone."""
    members: dict[str, list[int]] = {}
    single = len(model.found) <= CAUSES
    for k, effect in enumerate(model.found):
        name = f'{effect.name} of {effect.site}' if single and effect.site else effect.name
        members.setdefault(name, []).append(k)
    alone = {name: unseen.rms(unseen.predict(index)) for name, index in members.items()}
    steps: list[tuple[str, float]] = []
    kept: list[int] = []
    for name in sorted(members, key=lambda n: alone[n]):
        kept += members[name]
        steps.append((name, unseen.rms(unseen.predict(kept))))
    return tuple(steps), tuple(alone.items())


def _on_bags(
    result: Search, holdout: Sequence[Recording], other_setup: float
) -> tuple[Array, Array, Array]:
    """Return squared errors before and after on held-out bags, and the fold of every sample."""
    before: list[Array] = []
    after: list[Array] = []
    labels: list[Array] = []
    for recording in holdout:
        if recording.contacts is not None:
            for first, last in _on_contacts(result, recording):
                before.append(first)
                after.append(last)
                labels.append(np.full(first.size, STRETCHES * len(labels)))
            continue
        problem = Problem((usable(recording),), frozenset({'base'}) & result.problem.align)
        pair, good = [], np.ones(problem.samples[0], dtype=bool)
        for model in (result.baseline.model, result.final.model):
            own = _for_bag(problem, model, result.problem.recordings, other_setup)
            parts = problem.residuals(own)
            pair.append((parts[0][:3] ** 2).sum(axis=0))
            # What is an outlier shows best against the better model, which comes last.
            good = trusted(robust_scale(problem, parts).weights)[0]
        before.append(pair[0][good])
        after.append(pair[1][good])
        fold = np.arange(good.sum()) * STRETCHES // max(int(good.sum()), 1)
        labels.append(fold + STRETCHES * len(labels))
    return np.concatenate(before), np.concatenate(after), np.concatenate(labels)


def _on_contacts(result: Search, recording: Recording) -> list[tuple[Array, Array]]:
    """Return squared errors before and after at every place of held-out contacts."""
    model = result.final.model
    parts = by_place(recording)
    nominal = (model.robot.T_world_base,) * len(parts)
    start = Model(model.robot, nominal, model.known, given=(0,) * len(parts))
    problem = posed((), parts, start, frozenset())
    own = [k for k, r in enumerate(result.problem.recordings) if r.contacts is not None]
    sizes = []
    for fitted in (result.baseline.model, model):
        base = fitted.bases[own[0] if own else 0]
        bases = (base,) * len(start.bases)
        same = replace(start, robot=fitted.robot, bases=bases, found=fitted.found)
        sizes.append([(part**2).sum(axis=0) for part in problem.residuals(same)])
    return list(zip(*sizes, strict=True))


def _for_bag(
    problem: Problem, model: Model, recordings: Sequence[Recording], other_setup: float
) -> Model:
    """Return the model with the base whose set-up the bag matches, or the bag's own."""
    recording = problem.recordings[0]
    choices = [
        Model(model.robot, (base,), model.known + model.changed(k), found)
        for k, (base, own) in enumerate(zip(model.bases, recordings, strict=True))
        for found in ways_seen(model.found, own.clock_ns, own.span_ns, recording)
    ]
    sizes = [_size(problem, choice) for choice in choices]
    best = choices[int(np.argmin(sizes))]
    if 'base' in problem.align:
        bare = best.with_found(())
        frames = fit(problem, bare, problem.unit_scale()).model
        lasting = tuple(effect for effect in best.found if not effect.traits.of_setup)
        own = Model(model.robot, frames.bases, model.known, lasting)
        if min(sizes) > other_setup * _size(problem, own):
            return own
    return best


def _size(problem: Problem, model: Model) -> float:
    return float(np.median(np.linalg.norm(problem.residuals(model)[0][:3], axis=0)))


def ratio_interval(
    before: Array,
    after: Array,
    labels: Array,
    elsewhere: float | None = None,
    farthest: float = np.inf,
) -> tuple[float, tuple[float, float]]:
    """
    Return RMS after over before and its 95 % interval, by leaving out one fold at a time.

    Jackknife over folds, so that neighbouring samples do not count as independent. Of another motion
    they say little: how far the ratio is from that on the recordings fitted (``elsewhere``), each fold
    unseen, is one draw of that spread, and its square is added to the variance.

    before, after, labels: squared errors on unseen data and their folds, shape (samples,).
    farthest: logarithm of a ratio between the two beyond which it widens the interval no further.
    """
    ratio = float(np.sqrt(after.mean() / max(before.mean(), EMPTY)))
    if np.unique(labels).size < FEWEST:
        spread = ratio / np.sqrt(2.0 * max(before.size, 2))
        return ratio, (max(ratio - 2.0 * spread, 0.0), ratio + 2.0 * spread)
    variance = float(jackknife(_log_sizes(after, labels) - _log_sizes(before, labels)))
    if elsewhere is not None:
        apart = np.log(max(elsewhere, EMPTY) / max(ratio, EMPTY))
        variance += min(abs(float(apart)), farthest) ** 2
    reach = student(WITHIN) * np.sqrt(variance)
    return ratio, (ratio * float(np.exp(-reach)), ratio * float(np.exp(reach)))
