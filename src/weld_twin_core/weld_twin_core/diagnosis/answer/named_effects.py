# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The effects that a verdict names, with their standard errors, and how sure the shares of causes are.

A standard error is the largest of what the covariance and other optima that fit nearly as well give,
with what idealised formulas add in squares, and of the models that the recordings allow besides.

Of a share three doubts are drawn together: the coordinates of all causes, as their columns hang
together; how much of what is left above the noise is the causes'; how large the noise is and how it
lies along the gap. Which member of a set is at work changes no share. Every draw is parted as the
shares themselves are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...effects.effect import Effect
from ...twin.posterior import Posterior
from ..algebra.columns import BLOCKS, SHOWN, Columns, columns_covariance
from ..algebra.fit import coordinates, trusted
from ..algebra.problem import Model, Problem, Scale
from ..algebra.starts import profile
from ..evidence import Search, Verdict
from ..frames.changes import columns_and_ridge
from ..levels.causes import covering
from ..negligible import EMPTY, MICROMETRE, SLIGHT
from ..result import Cause, Found, Site
from ..unseen.folds import COVERED
from ..unseen.unseen_stretches import Unseen


def named_effects(
    result: Search, unseen: Unseen, verdict: Verdict, causes: Sequence[Cause], posterior: Posterior
) -> tuple[tuple[Found, ...], Verdict, tuple[Cause, ...]]:
    """Return the reported effects, those that move the tool most first, with verdict and causes."""
    model = result.final.model
    moves = [unseen.rms(target) > MICROMETRE for target in unseen.targets[1:]]
    named = _named_sets(model.found, verdict, causes, moves if result.dense else None)
    squares = (unseen.targets[1:] ** 2).sum(axis=1)
    named.sort(key=lambda pair: -squares[pair[0]])
    if not named:
        return (), replace(verdict, sets=()), tuple(replace(c, effect=None) for c in causes)
    share = max(result.effective(result.small) / result.small.residual.size, SLIGHT)
    fitted = result.problem, model, result.scale, result.precision
    errors = standard_errors(*fitted, share, posterior, verdict.sets)
    effects = tuple(Found(model.found[member], errors[member]) for member, _ in named)
    at = {group: k for k, (_, group) in enumerate(named)}
    return (
        effects,
        replace(verdict, sets=tuple(verdict.sets[group] for _, group in named)),
        tuple(replace(c, effect=None if c.effect is None else at.get(c.effect)) for c in causes),
    )


def _named_sets(
    model: Sequence[Effect],
    verdict: Verdict,
    causes: Sequence[Cause],
    moves: Sequence[bool] | None,
) -> list[tuple[int, int]]:
    """
    Return which effects of the model are reported, each with the number of its set.

    Of a set of many small errors it is the first; where the fit of all kinds has put all of it into
    another of the set, that one.

    moves: which effects of the model move the tool at all, where many were fitted together.
    """
    if moves is None:
        return [(c.members[0], c.effect) for c in causes if c.effect is not None]
    sites = [Site.of(effect) for effect in model]
    out = []
    for k, group in enumerate(verdict.sets):
        members = [sites.index(site) for site in group if site in sites]
        if members:
            out.append((next((m for m in members if moves[m]), members[0]), k))
    return out


def standard_errors(
    problem: Problem,
    model: Model,
    scale: Scale,
    precision: Array,
    share: float,
    posterior: Posterior | None = None,
    sets: Sequence[tuple[Site, ...]] = (),
) -> list[dict[str, Any]]:
    """
    Return the standard errors of every found effect, in the shape of its parameters.

    Parameters that are not fitted, that rest on a bound or that the data do not show have none.

    precision, share: prior of all fit coordinates, (K,), and of the rows that are independent.
    posterior: the models that the recordings allow; without, the one that was fitted alone counts.
    sets: effects of which one is at work or another: an error holds if it is this one.
    """
    if not model.found:
        return []
    variance = np.diag(covariance(problem, model, scale, precision, share))
    at, out = 0, []
    for k, effect in enumerate(model.found):
        size = effect.fit.coordinates().size
        own = np.sqrt(variance[at : at + size])
        at += size
        own = np.maximum(own, _elsewhere(problem, model, scale, k, share))
        own = np.hypot(own, idealised(effect))
        if posterior is not None:
            own = np.maximum(own, posterior.doubt(effect, _instead(effect, sets)))
        out.append(effect.fit.errors(own))
    return out


def _instead(effect: Effect, sets: Sequence[tuple[Site, ...]]) -> set[tuple[str, str]]:
    mine = Site.of(effect)
    named = {site for group in sets if mine in group for site in group} - {mine}
    return {(site.effect, site.joint or '') for site in named}


def covariance(
    problem: Problem, model: Model, scale: Scale, precision: Array, share: float
) -> Array:
    """Return the covariance of fit coordinates, (K, K); NaN for those that have none."""
    columns, ridge = columns_and_ridge(problem, model, scale, precision)
    count = coordinates(model).size
    live = np.concatenate([np.ones(columns.count - count, bool), _free(model)])
    live &= _visible(columns, model)
    residual = problem.whitened(problem.residuals(model), scale)
    out = np.full((live.size, live.size), np.nan)
    labels = problem.block_labels(BLOCKS)
    columns = columns.chosen(np.flatnonzero(live))
    out[np.ix_(live, live)] = columns_covariance(columns, ridge[live], residual, labels, share)
    return out[live.size - count :, live.size - count :]


def _free(model: Model) -> NDArray[np.bool_]:
    """Return which fit coordinates are off their bounds, shape (K,)."""
    specs = [effect.components()[k][0] for effect in model.found for k in effect.fit.fitted()]
    pairs = zip(specs, coordinates(model), strict=True)
    return np.array([p.lower < value < p.upper for p, value in pairs], dtype=bool)


def _visible(columns: Columns, model: Model) -> NDArray[np.bool_]:
    scales = np.concatenate([effect.fit.coordinate_scales() for effect in model.found])
    reach = np.concatenate([np.ones(columns.count - scales.size), 1e3 * scales])
    return np.asarray(columns.peaks() * reach > SHOWN)


def _elsewhere(problem: Problem, model: Model, scale: Scale, k: int, share: float) -> Array:
    """Return how far instances that fit nearly as well spread about effect k, per coordinate."""
    effect = model.found[k]
    trials = profile(problem, model, scale, k)
    if trials is None or not effect.fit.coordinates().size:
        return np.zeros(effect.fit.coordinates().size)
    others, worse = trials
    weight = np.exp(-share / 2.0 * np.maximum(worse, 0.0))
    apart = np.array([other.fit.coordinates() for other in others]) - effect.fit.coordinates()
    return np.asarray(np.sqrt(weight @ apart**2 / (1.0 + weight.sum())))


def idealised(effect: Effect) -> Array:
    """Return how far real arms differ from the formulas, per coordinate."""
    specs = [effect.components()[k][0] for k in effect.fit.fitted()]
    return np.array([p.idealised for p in specs]) * np.abs(effect.fit.coordinates())


_DRAWS = 1000
"""Enough for the ends of an interval to be good to a few per cent of its width."""
_SEED = 1
"""Of the draws: the same recordings give the same intervals."""
HALF_DIGIT = 5e-4
"""Half of the last digit of a share as pages tell it, 0.1 %: no interval is finer."""


def with_intervals(
    found_causes: Sequence[Cause], result: Search, unseen: Unseen, verdict: Verdict, floor: float
) -> tuple[Cause, ...]:
    """
    Return causes with the 90 % intervals of their shares, above a noise of RMS ``floor`` [m].

    Of an unknown status, of curves and of many small errors, intervals are those that folds show.
    """
    curved = len(result.candidate_sets) != len(unseen.parts)
    if verdict.status == 'unknown' or curved or not any(result.candidate_sets) or not unseen.parts:
        return tuple(covering(cause) for cause in found_causes)
    tries = _tries(result, unseen, floor)
    return tuple(
        covering(cause)
        if cause.rest
        else _with_interval(cause, tries[:, list(cause.members)].sum(axis=1))
        for cause in found_causes
    )


def _with_interval(cause: Cause, tries: Array) -> Cause:
    low, high = np.quantile(tries, ((1.0 - COVERED) / 2.0, (1.0 + COVERED) / 2.0))
    low, high = min(low, cause.share) - HALF_DIGIT, max(high, cause.share) + HALF_DIGIT
    return replace(cause, share_ci90=(float(max(low, 0.0)), float(min(high, 1.0))))


def _tries(result: Search, unseen: Unseen, floor: float) -> Array:
    """Return draws of the share of every effect, (_DRAWS, K)."""
    rng = np.random.default_rng(_SEED)
    before = float(unseen.squares(unseen.bare).mean())
    after = float(unseen.squares(unseen.whole).mean())
    noise = min(floor**2, after)
    moved = _coordinates(rng, result, (after - noise) / max(after, EMPTY))
    parted = _parted(_along(unseen, moved))
    unsure = _noise_unsure(result, unseen, noise, before, after)
    # Of what is left above the noise any part may be the causes'.
    remaining = rng.uniform(noise, after, _DRAWS) + unsure * rng.standard_normal(_DRAWS)
    explained = 1.0 - remaining[:, None] / before
    return parted * explained


def _coordinates(rng: np.random.Generator, result: Search, missed: float) -> Array:
    """Return how far coordinates may be off by noise and by what is missed, (DRAWS, K)."""
    rows = result.small.residual.size
    missing = missed / result.work.beliefs.misfit_directions
    doubt = 1.0 / max(result.effective(result.small), 1.0) + missing
    model = result.final.model
    share = 1.0 / (rows * doubt)
    spread = covariance(result.problem, model, result.scale, result.precision, share)
    # A coordinate on a bound, or that the data do not show, stays.
    beside = np.concatenate([idealised(effect) for effect in model.found])
    spread = np.nan_to_num(spread) + np.diag(beside**2)
    variances, ways = np.linalg.eigh(spread)
    unit = rng.standard_normal((_DRAWS, variances.size))
    return np.asarray(unit @ (ways * np.sqrt(np.maximum(variances, 0.0))).T)


def _along(unseen: Unseen, moved: Array) -> Array:
    """Return how far each effect moves the tool along with all of them, (_DRAWS, K) [m^2]."""
    count, first = len(unseen.parts), unseen.frames
    own_columns = unseen.columns.chosen(np.arange(first, unseen.columns.count)).written_out()
    rows = unseen.beside_frames(np.concatenate([unseen.targets[1:], own_columns]))
    each = np.array([_positions(unseen.problem, unseen.scale, row) for row in rows])
    products = each @ each.T
    together = np.hstack([np.ones((len(moved), count)), moved]) @ products
    out = together[:, :count].copy()
    for k, part in enumerate(unseen.parts):
        own = slice(part.start - first, part.stop - first)
        out[:, k] += (together[:, count:][:, own] * moved[:, own]).sum(axis=1)
    return np.asarray(out)


def _parted(along: Array) -> Array:
    """Return the part of every effect in what all explain; none where one works against them."""
    sizes = np.maximum(along, 0.0)
    return np.asarray(sizes / np.maximum(sizes.sum(axis=-1, keepdims=True), EMPTY))


def _noise_unsure(
    result: Search, unseen: Unseen, noise: float, before: float, after: float
) -> float:
    """Return how far off the noise's part of the gap may be, standard deviation [m^2]."""
    share = result.problem.independent_share(result.final.residual)
    count = 3 * share * unseen.trusted_labels().size
    # It happens to lie along the gap or against it; and its square is known from so many rows.
    along = 2.0 * np.sqrt(noise * before / count) * after / before
    return float(np.hypot(along, noise * np.sqrt(2.0 / count)))


def _positions(problem: Problem, scale: Scale, rows: Array) -> Array:
    """Return the position part of whitened rows in every trusted sample, (3 samples,) [m]."""
    parts = zip(problem.measured_rows(rows, scale), trusted(scale.weights), strict=True)
    return np.concatenate([part[good, :3].ravel() for part, good in parts])
