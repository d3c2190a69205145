# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The models that the recordings allow: a Gaussian about the fitted one.

Every arm has a little of every small error, found or not. All of them have a prior of zero mean;
how wide it is for each family is learned from this arm, starting at what arms usually have, as is
the noise [1]_. In directions that the data show, the data decide; in the others the prior stays.

References
----------
.. [1] D. J. C. MacKay, "Bayesian interpolation", Neural Computation 4, 1992.

"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from ...arrays import Array
from ...effects.effect import Effect
from ...twin.posterior import Directions, Posterior
from ..algebra.evidence_score import effective_share
from ..algebra.fit import coordinates, design
from ..algebra.problem import Model, Problem, Scale
from .leftover import leftover, posture_blocks
from .plausible_arm import directions, groups, straight, values, widths

ROWS = 9000
"""Rows looked at; more show the same directions."""
FRAME_WIDTHS = (0.05, 0.05)
"""Standard deviation of an aligned frame about the fitted one before the data [m, rad]."""
ROUNDS = 12
TRUST = 4.0
"""So many coordinates' worth of belief in the usual sizes, against what this arm shows."""


@dataclass(frozen=True, eq=False)
class Prior:
    """Where coordinates lie before the data, counted from the fit, and how wide; shapes (P,)."""

    middle: Array
    width: Array
    group: Array


@dataclass(frozen=True, eq=False)
class Rows:
    """Whitened rows of the fitted model: columns (P, R), residual (R,), both in noise."""

    columns: Array
    residual: Array
    share: float


def allowed(problem: Problem, model: Model, scale: Scale, precision: Array) -> Posterior:
    """
    Return the models that the recordings allow.

    Parameters
    ----------
    problem, model, scale
        A model fitted to all measurements.
    precision : array, shape (K,)
        Prior precision of the found effects' coordinates in that fit; may be empty.

    """
    problem, scale = _thinned(problem, scale)
    effects = directions(model.robot, model.found)
    frames = tuple(frame for frame in ('base', 'tool') if frame in problem.align)
    what = Directions(frames, len(problem.recordings), effects)
    makers = problem.features(model)
    parts = [
        what.columns(maker, k)[:, : problem.rows[k]] for k, maker in enumerate(makers)
    ]
    residual = problem.whitened(problem.residuals(model), scale)
    share = effective_share(residual, problem.rows, problem.samples)
    fine = [fine_columns(maker)[:, : problem.rows[k]] for k, maker in enumerate(makers)]
    rows = Rows(problem.whitened(parts, scale), residual, share)
    prior = _prior(what, effects, model)
    sizes, noise = learned(rows, prior)
    mean, covariance = conditioned(rows, prior, sizes, noise)
    labels = posture_blocks(problem)
    own, _ = design(problem, model, scale)
    pull = np.zeros(own.shape[0])
    x = np.zeros(own.shape[0])
    if precision.size:
        pull[own.shape[0] - precision.size :] = precision
        x[own.shape[0] - precision.size :] = coordinates(model)
    rest = leftover(problem, scale, rows, own, pull, pull * x, labels,
                    lambda keep: conditioned(_kept(rows, keep), prior, sizes, noise))
    return Posterior(what, mean, covariance, rest)


def _kept(rows: Rows, keep: Array) -> Rows:
    return Rows(rows.columns[:, keep], rows.residual[keep], rows.share)


def _thinned(problem: Problem, scale: Scale) -> tuple[Problem, Scale]:
    if problem.size <= ROWS:
        return problem, scale
    thin = problem.thinned(ROWS)
    kept = []
    for full, part, weight in zip(problem.recordings, thin.recordings, scale.weights, strict=True):
        assert full.measured is not None and part.measured is not None
        kept.append(weight[np.searchsorted(full.measured.t, part.measured.t)])
    return thin, Scale(scale.position, scale.orientation, tuple(kept))


def _prior(what: Directions, effects: tuple[Effect, ...], model: Model) -> Prior:
    frames = what.frame_count
    now = values(effects, model.found)
    width = np.concatenate([np.tile(np.repeat(FRAME_WIDTHS, 3), frames // 6), widths(effects, now)])
    middle = np.concatenate([np.zeros(frames), np.where(straight(effects), -now, 0.0)])
    group = np.concatenate([np.full(frames, -1), groups(effects)]).astype(int)
    return Prior(middle, width, group)


def learned(rows: Rows, prior: Prior) -> tuple[Array, float]:
    """Return the width of every coordinate as this arm shows it, shape (P,), and the noise."""
    unit = rows.columns * prior.width[:, None]
    normal, right = rows.share * unit @ unit.T, rows.share * unit @ rows.residual
    rss = rows.share * float(rows.residual @ rows.residual)
    count = rows.share * rows.residual.size
    middle = prior.middle / prior.width
    scale, noise = np.ones(prior.group.max(initial=-1) + 1), 1.0
    for _ in range(ROUNDS):
        size = np.where(prior.group >= 0, scale[prior.group], 1.0)
        step, spread = _solved(normal / noise, right / noise, middle, size)
        at = step - middle
        known = 1.0 - spread / size**2
        left = rss - 2.0 * right @ step + step @ normal @ step
        noise = max(left / max(count - known.sum(), 1.0), 1e-6)
        for k in range(scale.size):
            mine = prior.group == k
            free = float(np.clip(known[mine], 0.0, 1.0).sum())
            scale[k] = np.sqrt(((at[mine] ** 2).sum() + TRUST) / (free + TRUST))
    size = np.where(prior.group >= 0, scale[prior.group], 1.0)
    return prior.width * size, noise


def _solved(normal: Array, right: Array, middle: Array, size: Array) -> tuple[Array, Array]:
    """Return mean and variance of coordinates with a prior about ``middle``, shapes (P,)."""
    system = normal * np.outer(size, size) + np.eye(size.size)
    factor = cho_factor(system)
    mean = middle + size * cho_solve(factor, size * (right - normal @ middle))
    spread = np.diag(cho_solve(factor, np.eye(size.size))) * size**2
    return mean, spread


def conditioned(rows: Rows, prior: Prior, width: Array, noise: float) -> tuple[Array, Array]:
    """Return mean, shape (P,), and covariance, shape (P, P), of the coordinates given rows."""
    weight = rows.share / noise
    unit = rows.columns * width[:, None]
    middle = prior.middle / width
    system = weight * unit @ unit.T
    right = weight * unit @ rows.residual - system @ middle
    factor = cho_factor(system + np.eye(width.size))
    inverse = cho_solve(factor, np.eye(width.size))
    mean = prior.middle + width * (inverse @ right)
    return mean, 0.5 * (inverse + inverse.T) * np.outer(width, width)
