# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The effects that a verdict names, with their standard errors.

A standard error is the largest of what four reasons give: the covariance of `algebra.spread`; other
optima that fit nearly as well; formulas that are idealised; and the models that the recordings allow
besides, in which an arm has a little of every small error.
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
from ..algebra import spread
from ..algebra.columns import Columns, designed
from ..algebra.fit import coordinates
from ..algebra.prior import frame_prior
from ..algebra.problem import Model, Problem, Scale
from ..algebra.spread import BLOCKS
from ..hypotheses.search import Search
from ..hypotheses.starts import profile
from ..result import Cause, Found, Site
from ..unseen.unseen_stretches import Unseen
from ..verdict.decision import Verdict

_LEAST_SHARE = 1e-3
"""Share of the rows that counts as independent at the least; keeps a division finite."""
_UNSEEN = 1e-2
"""A coordinate a thousand times its typical size must move some row by this much noise."""


def named_effects(
    result: Search,
    unseen: Unseen,
    verdict: Verdict,
    causes: Sequence[Cause],
    posterior: Posterior,
) -> tuple[tuple[Found, ...], Verdict, tuple[Cause, ...]]:
    """Return the effects told, those that move the tool most first, with verdict and causes."""
    model = result.final.model
    reported = _told(model.found, verdict, causes, dense=result.dense)
    squares = (unseen.targets[1:] ** 2).sum(axis=1)
    reported.sort(key=lambda pair: -squares[pair[0]])
    if not reported:
        return (), replace(verdict, sets=()), tuple(replace(c, effect=None) for c in causes)
    share = max(result.effective(result.small) / result.small.residual.size, _LEAST_SHARE)
    fitted = result.problem, model, result.scale, result.precision
    errors = standard_errors(*fitted, share, posterior, verdict.sets)
    effects = tuple(Found(model.found[member], errors[member]) for member, _ in reported)
    at = {group: k for k, (_, group) in enumerate(reported)}
    return (
        effects,
        replace(verdict, sets=tuple(verdict.sets[group] for _, group in reported)),
        tuple(replace(c, effect=None if c.effect is None else at.get(c.effect)) for c in causes),
    )


def _told(
    model: Sequence[Effect], verdict: Verdict, causes: Sequence[Cause], *, dense: bool
) -> list[tuple[int, int]]:
    """Return which effects of the model are told, each with the number of its set."""
    if not dense:
        return [(c.members[0], c.effect) for c in causes if c.effect is not None]
    sites = [Site.of(effect) for effect in model]
    return [
        (sites.index(site), k)
        for k, group in enumerate(verdict.sets)
        for site in group[:1]
        if site in sites
    ]


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

    precision: of the prior of all fit coordinates, about zero, shape (K,).
    share: of the rows that count as independent.
    posterior: the models that the recordings allow; without, the one that was fitted alone counts.
    sets: effects of which one is at work or another: an error holds for the case that it is this
    one.
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
    """Return names and joints of those that may be at work in an effect's place."""
    mine = Site.of(effect)
    named = {site for group in sets if mine in group for site in group} - {mine}
    return {(site.effect, site.joint or '') for site in named}


def covariance(
    problem: Problem, model: Model, scale: Scale, precision: Array, share: float
) -> Array:
    """Return the covariance of fit coordinates, (K, K); NaN for those that have none."""
    columns = designed(problem, model, scale)
    count = coordinates(model).size
    prior = precision if precision.size else np.zeros(count)
    live = np.concatenate([np.ones(columns.count - count, bool), _free(model)])
    live &= _visible(columns, model)
    columns = columns.chosen(np.flatnonzero(live))
    ridge = np.concatenate([frame_prior(problem, model)[0], prior])[live]
    residual = problem.whitened(problem.residuals(model), scale)
    out = np.full((live.size, live.size), np.nan)
    labels = problem.block_labels(BLOCKS)
    out[np.ix_(live, live)] = spread.covariance(columns, ridge, residual, labels, share)
    return out[live.size - count :, live.size - count :]


def _free(model: Model) -> NDArray[np.bool_]:
    """Return which fit coordinates are off their bounds, shape (K,)."""
    out: list[bool] = []
    for effect in model.found:
        specs = [effect.components()[k][0] for k in effect.fit.fitted()]
        out += [
            p.lower < value < p.upper
            for p, value in zip(specs, effect.fit.coordinates(), strict=True)
        ]
    return np.array(out, dtype=bool)


def _visible(columns: Columns, model: Model) -> NDArray[np.bool_]:
    """Return which columns the data show, shape (P,)."""
    scales = np.concatenate([effect.fit.coordinate_scales() for effect in model.found])
    reach = np.concatenate([np.ones(columns.count - scales.size), 1e3 * scales])
    return np.asarray(columns.peaks() * reach > _UNSEEN)


def _elsewhere(problem: Problem, model: Model, scale: Scale, k: int, share: float) -> Array:
    """Return how far instances that fit nearly as well spread about effect k, per coordinate."""
    effect = model.found[k]
    trials = profile(problem, model, scale, k)
    if trials is None or not effect.fit.coordinates().size:
        return np.zeros(effect.fit.coordinates().size)
    others, worse = trials
    weight = np.exp(-0.5 * share * np.maximum(worse, 0.0))
    apart = np.array([other.fit.coordinates() for other in others]) - effect.fit.coordinates()
    return np.asarray(np.sqrt(weight @ apart**2 / (1.0 + weight.sum())))


def idealised(effect: Effect) -> Array:
    """Return how far real arms differ from the formulas, per coordinate."""
    specs = [effect.components()[k][0] for k in effect.fit.fitted()]
    return np.array([p.idealised for p in specs]) * np.abs(effect.fit.coordinates())
