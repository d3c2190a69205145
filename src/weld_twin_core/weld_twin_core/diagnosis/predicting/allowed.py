# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The models that the recordings allow, as mean and second moment about the fitted one.

Every arm has a little of every small error, found or not. All of them have a prior of zero mean; how
large each is, is one of the sizes of `sizes`. In directions that the data show, the data decide; in the
others the prior stays.

A covariance counts rows as if the model were right but for white noise. What an arm does besides
(springs that swing, gears that no wave describes) hangs together in time, and so many coordinates
follow most of it: it shows little in what they leave, and moves them by more than their covariance has
it. It shows where each region of posture is predicted from the others, as what moved the coordinates in
one region is elsewhere in another. The covariance is then too small by a factor, the dispersion of
generalised linear models [1]_.

References
----------
.. [1] P. McCullagh, J. A. Nelder, "Generalized Linear Models", 1989, section 9.2.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import nan

import numpy as np
from scipy.linalg.lapack import dtrtri

from ...arrays import Array, spread_over
from ...effects.dated import of_the_robot
from ...effects.effect import REGISTRY, Effect
from ...twin.directions import Directions
from ...twin.domain import Domain
from ...twin.features import shown
from ...twin.goal_motion import is_play, lost_motion
from ...twin.posterior import Posterior, postures_within_limits, usual_sigma
from ...twin.twin import Twin
from ..algebra.definite import inverse_of, root_of
from ..algebra.fit import LEAST_NOISE, PROBE, Fit
from ..algebra.noise_floor import NoiseFloor
from ..algebra.open_directions import AXES, in_words, open_directions
from ..algebra.problem import ROWS, Model, Problem, Scale
from ..evidence import NAMED
from ..negligible import EMPTY, FLAT, MICROMETRE
from ..result import Shrink
from ..unseen.folds import posture_regions
from ..unseen.unseen_stretches import Unseen
from . import plausible_arm
from .leftover import Predicted, beyond_named, known_noise, leftover
from .sizes import GEARS, Prior, Products, Rows, Weighed, weighed, with_prior

POSTURES = 100
"""Enough for a median to be good to some per cent."""
_WARMTH = frozenset({'temperature'})
PARTNERS = 0.35
"""Part of a direction from which on an axis is named with it."""
Rooted = Callable[[Products], tuple[Array, Array]]
"""Mean of the coordinates given all rows but those of a part, and a root S of their covariance S S'."""
USUAL = 0.5
"""Standard deviation of the logarithm of a dispersion before the data: a judgement, models of real
arms are seldom off by twice what they say."""
FACTORS = np.exp(np.linspace(-2.0, 2.0, 100))
"""Dispersions that are weighed: four standard deviations to either side."""


def allowed(
    problem: Problem,
    model: Model,
    scale: Scale,
    precision: Array,
    floor: NoiseFloor,
    *,
    nameless: bool = False,
) -> Posterior:
    """
    Return the models that the recordings allow, about one fitted to all measurements.

    precision: prior of the found effects' coordinates in that fit, shape (K,); may be empty.
    nameless: whether something is at work that the model has no name for: what it leaves is no noise.
    """
    recordings = problem.recordings
    jumps = sum(shown(f, max(scale.position, MICROMETRE)) for f in problem.features(model))
    problem, scale = problem.thinned_with(_noisy(scale), ROWS)
    what = _directions(problem, model, measured=not problem.touched)
    what = _with_growth(what, problem, model)
    prior = _prior(what, model)
    rows = _rows(problem, model, scale, what, prior)
    models = weighed(rows, prior, _expected(problem, scale))
    system = Conditioning(rows, prior, models.shown, models.noise)
    unseen = Unseen.of(problem, scale, Fit(model, rows.residual), precision)
    regions = unseen.by(posture_regions(problem))
    levers, parts = _levers(problem, model, scale), rows.parts(regions.labels)
    whole = _borne_out(problem, rows, prior, models, parts, regions)
    turning = ~np.asarray(model.robot.prismatic)
    given = _moved(problem, model), system.given, whole
    predicted = Predicted.of(regions, rows.columns, parts, levers, *given)
    rough, lost = _rough(models, model, nameless=nameless), _lost(problem, model)
    remaining = leftover(problem, predicted, turning, known_noise(problem, floor), rough, lost)
    fine = _uneven(models.open, what)
    posterior = Posterior(
        what,
        *whole,
        plausible_arm.discrepancy(model.robot, remaining, fine, jumps, model.found),
        Domain.of(recordings, model.robot),
        left_open(problem, model),
        prior_std=prior.width,
        single=Conditioning(rows, prior, prior.width, models.noise).given(),
        # Where nothing was found nothing was judged on unseen data, and nothing is corrected.
        middle=float(bool(model.found)),
    )
    return _with_usual_sigma(posterior, model, problem)


def shown_beside_others(problem: Problem, model: Model, scale: Scale) -> tuple[float, ...]:
    """
    Return how many standard errors every effect found is from nothing, all other errors free.

    Every arm has a little of every small error, each as large as machines have it. A zero that such
    errors would make as well is found where few effects are looked for, and no more likely for that.
    """
    problem, scale = problem.thinned_with(_noisy(scale), ROWS)
    what = _directions(problem, model)
    prior = _prior(what, model)
    rows = _rows(problem, model, scale, what, prior)
    mean, covariance = Conditioning(rows, prior, prior.width, 1.0).given()
    sizes = [effect.fit.coordinates().size for effect in what.effects]
    of = np.repeat(np.arange(len(sizes)), sizes)
    straight = prior.middle[what.frame_count :][: of.size] != 0.0
    out = []
    for effect in model.found:
        own = [
            k
            for k, one in enumerate(what.effects)
            if (one.name, one.site) == (effect.name, effect.site)
        ]
        index = what.frame_count + np.flatnonzero(np.isin(of, own) & straight)
        away = (mean - prior.middle)[index]
        square = float(away @ np.linalg.solve(covariance[np.ix_(index, index)], away))
        out.append(float(np.sqrt(square / max(index.size, 1))) if index.size else nan)
    return tuple(out)


def elsewhere(shrink: Shrink, posterior: Posterior) -> Shrink:
    """Return the shrink with what may be left where nothing was recorded, as the posterior has it."""
    if shrink.elsewhere_ci95 is None or shrink.rms_before_m == 0.0:
        return shrink
    most = float(np.hypot(shrink.rms_after_m, posterior.anywhere_m)) / shrink.rms_before_m
    low, high = shrink.elsewhere_ci95
    return replace(shrink, elsewhere_ci95=(low, max(high, most)))


def _noisy(scale: Scale) -> Scale:
    return replace(
        scale,
        position=max(scale.position, MICROMETRE),
        orientation=max(scale.orientation, MICROMETRE / PROBE),
    )


def _directions(problem: Problem, model: Model, *, measured: bool = False) -> Directions:
    return Directions(
        tuple(frame for frame in ('base', 'tool') if frame in problem.align),
        1 + max(problem.stand(k) for k in range(len(problem.recordings))),
        plausible_arm.directions(model.robot, model.found, measured=measured),
        plausible_arm.fine_knots(_joints(problem)),
        0 if problem.at_rest else model.robot.n,
    )


def _with_growth(what: Directions, problem: Problem, model: Model) -> Directions:
    """Return the same with what every arm does as it warms up, where it is known how warm it was."""
    if any(maker.view.temperature is None for maker in problem.features(model)):
        return what
    known = {effect.name for effect in what.effects}
    grown = (k for k in REGISTRY.values() if k.needs == _WARMTH and k.name not in known)
    return replace(what, effects=(*what.effects, *(kind() for kind in grown)))


def _only_grows(effect: Effect, model: Model) -> bool:
    """Return whether an effect is growth with the warmth that no cause was found to be."""
    return effect.needs == _WARMTH and all(e.name != effect.name for e in model.found)


def _with_usual_sigma(posterior: Posterior, model: Model, problem: Problem) -> Posterior:
    seen = np.concatenate(_joints(problem))
    spread = spread_over(len(seen), POSTURES)
    anywhere = postures_within_limits(model.robot, POSTURES)
    return replace(
        posterior,
        recorded_m=corrected_sigma(posterior, model, seen[spread]),
        anywhere_m=corrected_sigma(posterior, model, anywhere),
    )


def corrected_sigma(posterior: Posterior, model: Model, q: Array) -> float:
    """Return how far a robot corrected by the middle of the models may be off at rest, (M, n) [m]."""
    effects, known = posterior.centred(model.found)
    twin = Twin(model.twin(0).robot, of_the_robot((*model.known, *effects)))
    return usual_sigma(known, twin, q)


def _expected(problem: Problem, scale: Scale) -> float:
    """Return the variance of a whitened row beforehand: a fit of few stations leaves less than noise."""
    if not problem.at_rest:
        return 1.0
    return float((LEAST_NOISE / scale.position) ** 2)


def _joints(problem: Problem) -> list[Array]:
    return [r.joints.at(r.seen.t)[0] for r in problem.recordings]


def _rows(problem: Problem, model: Model, scale: Scale, what: Directions, prior: Prior) -> Rows:
    features = problem.features(model)
    whole = [what.columns(maker, problem.stand(k)) for k, maker in enumerate(features)]
    parts = [problem.seen(k, part) for k, part in enumerate(whole)]
    residual = problem.whitened(problem.residuals(model), scale)
    columns, left = problem.whitened(parts, scale), residual
    if not problem.at_rest:
        # What hangs together because an arm has small errors is no noise: coordinates take it.
        free = Conditioning(Rows(columns, residual, 1.0), prior, prior.width, 1.0)
        left = residual - free.given()[0] @ columns
    share = problem.independent_share(left)
    moved = None
    if problem.touched:
        moved = np.sqrt(sum((part[:, :3] ** 2).sum(axis=(1, 2)) for part in whole))
        moved /= scale.position
    return Rows(columns, residual, share, moved)


def _levers(problem: Problem, model: Model, scale: Scale) -> Array:
    """Return the whitened columns of the joints, shape (n, rows)."""
    count, parts = model.robot.n, []
    for k, maker in enumerate(problem.features(model)):
        columns = [problem.seen(k, maker.column(('q', i))) for i in range(count)]
        parts.append(np.reshape(columns, (count, problem.rows[k], problem.samples[k])))
    return problem.whitened(parts, scale)


def _rough(models: Weighed, model: Model, *, nameless: bool) -> float:
    """
    Return which share of an arm's small errors is of a usual size; all where the model lacks something.

    Where a curve without a formula stands for that, it has taken up what it could, and the rest is as
    much the arm's as elsewhere.
    """
    kinds = (effect.traits for effect in model.found)
    stood_for = any(not (own.cause or own.of_setup) for own in kinds)
    return 1.0 if nameless and not stood_for else models.rough


def _moved(problem: Problem, model: Model) -> tuple[Array, Array]:
    """Return how fast joints were at every sample, and how hard accelerated just before, (N, n)."""
    fast = [r.joints.at(r.seen.t)[1] for r in problem.recordings]
    shaken = [maker.shaken for maker in problem.features(model)]
    return np.concatenate(fast), np.concatenate(shaken)


def _lost(problem: Problem, model: Model) -> Array:
    """Return how much motion every joint was found to lose in the recordings, shape (n,) [rad or m]."""
    plays = [effect for effect in model.known + model.found if is_play(effect)]
    if not plays:
        return np.zeros(model.robot.n)
    shifts = [lost_motion(model.robot, plays, recording) for recording in problem.recordings]
    return np.asarray(np.max([np.ptp(shift, axis=0) for shift in shifts], axis=0))


def _borne_out(
    problem: Problem,
    rows: Rows,
    prior: Prior,
    models: Weighed,
    parts: list[Products],
    regions: Unseen,
) -> tuple[Array, Array]:
    """
    Return mean and covariance of the coordinates, as far as parts of a motion bear them out.

    Samples of a motion are few postures, and what the model misses hangs together in time: small
    errors follow it, and lead astray on the next seam. So their middle is gone to as far from the
    fitted model as foretells the regions best that neither was fitted to (stacking [1]_).

    References
    ----------
    .. [1] D. H. Wolpert, "Stacked generalization", Neural Networks 5, 1992.

    """
    # Of stations the discrepancy is as large as makes regions hold that others predict.
    if problem.at_rest:
        return models.mean, models.covariance
    drawn = [Conditioning(rows, prior, width, models.noise).rooted for width in models.drawn]
    factor, means = dispersion(parts, models.noise / rows.share, drawn)
    shift, share = np.zeros(regions.residual.size), 0.0
    for region, mean in zip(np.unique(regions.labels), means, strict=True):
        where = regions.labels == region
        shift[where] = beyond_named(regions, rows.columns, where, mean)
    if (square := float(shift @ shift)) > 0.0:
        share = min(max(float(regions.whole @ shift) / square, 0.0), 1.0)
    short = (1.0 - share) * models.mean
    return share * models.mean, models.covariance * factor + np.outer(short, short)


def _uneven(coordinates: Array, what: Directions) -> Array:
    """Return how uneven the gear of every joint is beyond its waves, RMS of its fine curve [rad]."""
    begins = what.count - np.cumsum([knots.size for knots in what.knots[::-1]])[::-1]
    return np.array([np.sqrt((h**2).mean()) for h in np.split(coordinates, begins)[1:]])


def _prior(what: Directions, model: Model) -> Prior:
    """Return the prior of frames, effects, gives, and the heights of every joint's fine curve."""
    frames, effects = what.frame_count, what.effects
    group, pools = plausible_arm.groups(effects)
    group[np.repeat([_only_grows(e, model) for e in effects], what.sizes)] = -1
    sizes = [k.size for k in what.knots]
    springs = int(what.gives > 0)
    gives = np.full(what.gives, pools.size)
    curves = pools.size + springs + np.repeat(np.arange(len(sizes)), sizes)
    tied = plausible_arm.middles(effects, model.found)
    return Prior(
        np.concatenate([np.zeros(frames), tied, np.zeros(what.shapes)]),
        plausible_arm.widths(model.robot, what),
        np.concatenate([np.full(frames, -1), group, gives, curves]).astype(int),
        np.concatenate([pools, np.full(springs + len(sizes), GEARS)]),
        np.concatenate([np.zeros(pools.size + springs, bool), np.ones(len(sizes), bool)]),
    )


class Conditioning:
    """The coordinates given rows, all of them or all but some; width (P,) and variance of a row."""

    def __init__(self, rows: Rows, prior: Prior, width: Array, noise: float) -> None:
        self._prior, self._width = prior, width
        self._sure = rows.share / noise
        self._system, self._right = self._of(rows.products)

    def _of(self, part: Products) -> tuple[Array, Array]:
        """Return normal matrix and right-hand side of rows, coordinates in their widths."""
        width = self._width
        system = np.outer(width, width)
        system *= self._sure
        system *= part.columns
        return system, self._sure * width * part.residual

    def _equations(self, but: Products | None) -> tuple[Array, Array]:
        """Return a root of the information of all rows but some, and what pulls at coordinates."""
        system, right = self._system.copy(), self._right
        if but is not None:
            less, pull = self._of(but)
            system -= less
            right = right - pull
        right = right - system @ (self._prior.middle / self._width)
        return root_of(with_prior(system)), right

    def given(self, but: Products | None = None) -> tuple[Array, Array]:
        """Return mean, (P,), and covariance, (P, P), of the coordinates by all rows but some."""
        width = self._width
        root, right = self._equations(but)
        inverse = inverse_of(root)
        mean = self._prior.middle + width * (inverse @ right)
        return mean, inverse * np.outer(width, width)

    def rooted(self, but: Products) -> tuple[Array, Array]:
        """Return the mean and a root S of the covariance S S', shape (P, P), without some rows."""
        root, right = self._equations(but)
        upper = dtrtri(root, lower=1, overwrite_c=1)[0].T
        mean = self._prior.middle + self._width * (upper @ (upper.T @ right))
        return mean, self._width[:, None] * upper


def left_open(problem: Problem, model: Model) -> tuple[str, ...]:
    """Return directions of aligned frames in which an error does not show, by their main axes."""
    unseen = problem.untracked and not problem.placed
    result = open_directions(problem, model)
    out = [f'base {axis}' for axis in AXES] if unseen else []
    for vector in result.vectors.T:
        share = np.abs(vector / result.size)
        order = [i for i in np.argsort(-share) if share[i] >= PARTNERS * share.max()]
        out.append(' with '.join(in_words(result.names[i]) for i in order[:NAMED]))
    return tuple(out)


def dispersion(
    parts: Sequence[Products], noise: float, models: Sequence[Rooted]
) -> tuple[float, Array]:
    """
    Return the factor by which the covariance of the coordinates is too small, and their means.

    The mean is that of all models given all parts but each, shape (parts, P).

    parts: whitened rows of every region of posture, at the fitted model.
    noise: variance of a direction in the space of the rows.
    models: drawn ones.
    """
    likely = np.zeros((len(models), FACTORS.size))
    means = np.zeros((len(parts), parts[0].residual.size))
    for own, rooted in zip(likely, models, strict=True):
        for k, part in enumerate(parts):
            mean, root = rooted(part)
            means[k] += mean / len(models)
            off, variance = _along(part, mean, root)
            whole = FACTORS[:, None] * variance + noise
            own -= (off**2 / whole + np.log(whole)).sum(axis=1) / 2.0
    weights = np.exp(likely - likely.max(axis=1, keepdims=True)).mean(axis=0)
    weights *= np.exp(-((np.log(FACTORS) / USUAL) ** 2) / 2.0)
    return float(weights @ FACTORS / weights.sum()), means


def _along(part: Products, mean: Array, root: Array) -> tuple[Array, Array]:
    """Return errors of rows along the directions in which they are foretold, and their variances."""
    error = root.T @ (part.residual - part.columns @ mean)
    variance, turn = np.linalg.eigh(root.T @ part.columns @ root)
    open_ = variance > FLAT * max(float(variance[-1]), EMPTY)
    variance = variance[open_]
    return (turn[:, open_].T @ error) / np.sqrt(variance), variance
