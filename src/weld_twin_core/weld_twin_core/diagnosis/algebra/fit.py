# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Nonlinear least squares of frames and effects together, robust to outliers.

Every fit is maximum a posteriori: the table of `weld_twin_core.effects.plausible` gives the spread of
every effect coordinate about zero. A frame that is fitted has a wide spread about where the alignment
put it, so that what the data leave open stays there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError

from ...arm.rotation import rotation_vector
from ...arrays import Array
from ...effects.plausible import spreads
from ..negligible import EMPTY, FLAT, NANOMETRE, REPEATED, ROUNDING, SLIGHT
from .columns import Columns, designed
from .definite import factored, unit_diagonal
from .independent_rows import measured_axes, robust_spread
from .problem import Model, Problem, Scale

FRAME_SHIFT = 0.02
"""Spread [m] of a frame's origin about where the alignment, which starts within 2 cm, put it."""
FRAME_TURN = 0.05
"""Spread [rad] of a frame's turn: 2 cm at an arm's reach of 0.4 m."""
STEADY = 1e-4
"""The same share up to which columns serve for the next step, too: they have hardly turned."""
DAMPING, DAMPED = FLAT, 1e6
"""Least and greatest damping of a step, in units of the columns: from Gauss-Newton to none."""
HUBER = 3.0
"""A sample this many robust deviations off starts to lose weight."""
TRUSTED = 0.2
"""A sample of less weight is an outlier: reported, and left out of every quoted RMS."""
SET_ASIDE = 0.02
"""Share of the samples that may be outliers; beyond that they are structure."""
STRAY = 20.0
"""Robust deviations from which a sample is a stray: twice what the data check calls far off. What a
missing effect does to some postures widens the deviation that it is measured in."""
STRAYS, STRAYS_TOGETHER = 0.1, 2
"""Share of the samples that may be strays, and how many in a row: more are a set-up that moved."""
PROBE = 2.0
"""Most noise of position per noise of orientation [m/rad]: no probe is wider than some metres. Exact
orientations, as a simulated cell gives, would otherwise drown every position."""

STRAINED = 1.0
"""Squared distance from what is believed, in standard deviations, from which on that may hold back."""
LEAST_NOISE = 3e-5
"""What an arm and an instrument leave of a position per axis [m] at the least, and before anything is
known of them: arms repeat within 0.02 to 0.1 mm, trackers measure within 0.02 mm."""
NOISE_TRUST = 8.0
"""So many rows' worth of belief in a noise that was expected."""


@dataclass(frozen=True, eq=False)
class Fit:
    model: Model
    residual: Array  # whitened residual at the solution, shape (rows,)
    prepared: list[Any] = field(default_factory=list, init=False, repr=False)
    """What was last prepared of it for unseen stretches, as several steps ask for the same. It
    lies here, and goes with the fit: it holds the fit itself."""

    @property
    def rss(self) -> float:
        return float(self.residual @ self.residual)

    @cached_property
    def coordinates(self) -> Array:
        return coordinates(self.model)

    @cached_property
    def sized(self) -> float:
        """
        The log probability of the sizes of its effects, against that of none.

        Cauchy's distribution about zero with the spread that machines have: most have little, and a
        few have a fault of ten times that.
        """
        found, robot = self.model.found, self.model.robot
        each = (effect.fit.coordinates() / spreads(robot, effect) for effect in found)
        return -float(sum(np.log1p(size**2).sum() for size in each))


def design(problem: Problem, model: Model, scale: Scale) -> Array:
    return designed(problem, model, scale).written_out()


def stepped(problem: Problem, model: Model, step: Array) -> Model:
    """Return the model after a step (P,) of frames (xyz, rotvec) and coordinates, as in `design`."""
    at = 0
    if 'base' in problem.align:
        for group in problem.stands:
            for k in group:
                model = model.moved(k, step[at : at + 6])
            at += 6
    if 'tool' in problem.align:
        model = model.retooled(step[at : at + 6])
        at += 6
    shared = [np.zeros(0) for _ in model.bases] if problem.common else list(model.common)
    for k, own in problem.common:
        size = own.mean.size
        shared[k] = model.shared(k, size) + step[at : at + size]
        at += size
    model = replace(model, common=tuple(shared))
    effects = []
    for effect in (*(change.effect for change in model.changes), *model.found):
        now = effect.fit.coordinates()
        effects.append(effect.fit.with_coordinates(now + step[at : at + now.size]))
        at += now.size
    count = len(model.changes)
    pairs = zip(model.changes, effects[:count], strict=True)
    changes = tuple(change._replace(effect=effect) for change, effect in pairs)
    return replace(model, changes=changes, found=tuple(effects[count:]))


def coordinates(model: Model) -> Array:
    """Return the fit coordinates of all found effects, shape (K,)."""
    return np.concatenate([np.zeros(0), *(effect.fit.coordinates() for effect in model.found)])


def fit(
    problem: Problem,
    model: Model,
    scale: Scale,
    precision: Array | None = None,
    iterations: int = 12,
    tolerance: float = 1e-5,
    most: float = np.inf,
) -> Fit:
    """
    Return the most probable nuisance frames and coordinates of the found effects.

    Least squares with priors, by Levenberg-Marquardt on column-scaled normal equations.

    precision: of every effect coordinate about zero, in whitened units, (K,); else that of machines.
    tolerance: stops when the objective falls by less than this share.
    most: stops where a step is predicted to leave more than this, whitened squares.
    """
    prior = effect_precision(model) if precision is None else precision
    start = _Point.at(problem, model, scale, prior)
    columns = start.columns()
    start = _levelled(start, columns) if iterations else start
    here = _descended(start, columns, iterations, tolerance, most)
    if problem.at_rest and here.believed > STRAINED and scale.position > LEAST_NOISE:
        # What a cause that is not fitted yet leaves was taken for noise, beside which few stations
        # weigh less than a belief.
        start = start.believing((LEAST_NOISE / scale.position) ** 2)
        other = _descended(start, columns, iterations, tolerance, most)
        here = min(here, other, key=lambda one: one.surprise(of_machines=precision is None))
    return Fit(here.model, here.residual)


def predict_fit(
    problem: Problem, model: Model, scale: Scale, columns: Columns
) -> tuple[Array, float]:
    """Return a model's whitened residual, and about what a fit of it by columns close by will leave."""
    start = _Point.at(problem, model, scale, effect_precision(model))
    normal, right = start.normal_equations(columns)
    return start.residual, start.cost - float(right @ solve_scaled(normal, right, DAMPING))


def _levelled(start: _Point, columns: Columns) -> _Point:
    """
    Return the start with frames and sizes that belong together, all that bends it held.

    An effect more starts as large as it is best with all others fitted anew. Beside the others as
    they were it makes all of it worse, and a frequency or a time constant would leap to make up for it.
    """
    straight = [effect.fit.straight() for effect in start.model.found]
    others = np.ones(start.x.size - sum(each.size for each in straight), dtype=bool)
    held = ~np.concatenate([others, *straight])
    if not held.any():
        return start
    normal, right = start.normal_equations(columns)
    normal[held], normal[:, held], right[held] = 0.0, 0.0, 0.0
    there = start.stepped(solve_scaled(normal, right, DAMPING))
    return there if there.cost < start.cost else start


def _descended(
    start: _Point, columns: Columns, iterations: int, tolerance: float, most: float
) -> _Point:
    here, damping = start, DAMPING
    for _ in range(iterations):
        there, (normal, right) = None, here.normal_equations(columns)
        while damping < DAMPED:
            step = solve_scaled(normal, right, damping)
            expected = here.cost - float((2.0 * right - normal @ step) @ step)
            if expected > most:
                return here
            there = here.stepped(step)
            if there.cost <= here.cost:
                break
            there, damping = None, max(damping * 100.0, SLIGHT)
        if there is None:
            break
        gain = (here.cost - there.cost) / max(here.cost, EMPTY)
        missed = abs(there.cost - expected)
        here, damping = there, max(damping / 100.0, DAMPING)
        if gain < tolerance or missed < SLIGHT * there.cost:
            break
        if missed > STEADY * there.cost:
            columns = here.columns()
    return here


@dataclass(frozen=True, eq=False)
class _Point:
    """A model on the way of a fit: its whitened residual, its priors, and its cost."""

    problem: Problem
    scale: Scale
    prior: Array
    model: Model
    residual: Array
    ridge: Array
    x: Array
    cost: float
    share: float = 1.0

    @classmethod
    def at(cls, problem: Problem, model: Model, scale: Scale, prior: Array) -> _Point:
        residual = problem.whitened(problem.residuals(model), scale)
        frames, off = frame_prior(problem, model)
        ridge = np.concatenate([frames, prior])
        x = np.concatenate([off, coordinates(model)])
        cost = float(residual @ residual + ridge @ x**2)
        return cls(problem, scale, prior, model, residual, ridge, x, cost)

    def believing(self, share: float) -> _Point:
        """Return the same where only a share of all priors counts."""
        ridge = share * self.ridge
        cost = float(self.residual @ self.residual + ridge @ self.x**2)
        return replace(self, ridge=ridge, cost=cost, share=share)

    def columns(self) -> Columns:
        return designed(self.problem, self.model, self.scale)

    def normal_equations(self, columns: Columns) -> tuple[Array, Array]:
        """Return normal matrix and right-hand side of a step by columns, the priors included."""
        right = columns.times(self.residual) - self.ridge * self.x
        normal = columns.normal()
        normal[np.diag_indices_from(normal)] += self.ridge
        return normal, right

    def stepped(self, step: Array) -> _Point:
        model = stepped(self.problem, self.model, step)
        there = _Point.at(self.problem, model, self.scale, self.prior)
        return there if self.share == 1.0 else there.believing(self.share)

    @property
    def believed(self) -> float:
        return float(self.ridge @ self.x**2) / self.share

    def surprise(self, *, of_machines: bool) -> float:
        """
        Return twice the negative log probability of the fit, whatever the noise.

        of_machines: sizes come as often as in machines, see `Fit.sized`; else they are normal.
        """
        size, freedom = self.residual.size, max(self.residual.size - self.ridge.size, 1)
        least = size * (LEAST_NOISE / self.scale.position) ** 2
        rss = max(float(self.residual @ self.residual), least)
        misfit = freedom * float(np.log(rss))
        if not of_machines:
            return misfit + self.believed
        far = self.ridge * self.x**2 / self.share
        frames = self.x.size - self.prior.size
        return misfit + float(far[:frames].sum() + 2.0 * np.log1p(far[frames:]).sum())


def solve_scaled(normal: Array, right: Array, damping: float) -> Array:
    """Return the solution of column-scaled normal equations, damped; flat directions stay put."""
    size = np.sqrt(np.maximum(np.diag(normal), 0.0))
    live = size > ROUNDING * max(size.max(initial=0.0), EMPTY)
    out = np.zeros(right.size)
    if not live.any():
        return out
    scaled, _ = unit_diagonal(normal[np.ix_(live, live)], max(damping, REPEATED))
    wanted = right[live] / size[live]
    try:
        out[live] = factored(scaled.copy())(wanted) / size[live]
    except LinAlgError:
        out[live] = np.linalg.lstsq(scaled, wanted, rcond=ROUNDING)[0] / size[live]
    return out


def robust_scale(
    problem: Problem, residuals: list[Array], least: Scale | None = None, freedom: float = 0.0
) -> Scale:
    """
    Return the noise of residuals by median absolute deviation, and Huber weights per sample.

    least: never return less noise than this.
    freedom: coordinates that the residuals' own data determined; they took their share of the noise.
    """
    given = problem.given_weights
    residuals = [part * np.sqrt(own) for part, own in zip(residuals, given, strict=True)]
    kept = max(1.0 - freedom / problem.size, 0.0)
    # Shifts and turns as sure as usual ones.
    residuals = [
        part if root is None else np.einsum('mij,jm->im', root, part)
        for root, part in zip(problem.roots, residuals, strict=True)
    ]
    position = np.concatenate([measured_axes(part[:3]).ravel() for part in residuals])
    turn = np.concatenate([part[3:].ravel() for part in residuals])
    sigma, sigma_turn = robust_spread(position), robust_spread(turn) if turn.size else 1.0
    if freedom > 0.0:
        # As many coordinates as rows leave nothing of a noise that is there all the same.
        trust = NOISE_TRUST / problem.size
        sigma, sigma_turn = (
            float(np.sqrt((own**2 + trust * least_own**2) / (kept + trust)))
            for own, least_own in ((sigma, LEAST_NOISE), (sigma_turn, LEAST_NOISE / PROBE))
        )
    if least is not None:
        sigma, sigma_turn = max(sigma, least.position), max(sigma_turn, least.orientation)
    sigma = max(sigma, NANOMETRE)
    sigma_turn = max(sigma_turn, sigma / PROBE)
    weights = []
    for part, own in zip(residuals, given, strict=True):
        off = np.sqrt((part[:3] ** 2).sum(axis=0) / 3) / sigma
        if part.shape[0] > 3:
            off = np.maximum(off, np.sqrt((part[3:] ** 2).sum(axis=0) / 3) / sigma_turn)
        weights.append(own * np.minimum(1.0, (HUBER / np.maximum(off, ROUNDING)) ** 2))
    return Scale(sigma, sigma_turn, tuple(weights))


def trusted(weights: Sequence[Array]) -> list[NDArray[np.bool_]]:
    """
    Return which samples count in every quoted figure, (M,) per recording.

    All but outliers, and of those no more than `SET_ASIDE` (or one) are left out, the farthest:
    what many samples do is structure, and must show in what is left. Strays, each by itself and
    farther off than any structure, are left out all the same: one would be the whole RMS. So are
    those without any weight, which were left out before.
    """
    every = np.concatenate(list(weights)) if weights else np.zeros(0)
    far = sum(int(part.sum()) for part in strays(weights, (HUBER / STRAY) ** 2))
    aside = max(1, int(SET_ASIDE * every.size), far)
    least = float(np.sort(every)[aside]) if every.size > aside else 0.0
    return [(weight > 0.0) & (weight >= min(TRUSTED, least)) for weight in weights]


def strays(weights: Sequence[Array], least: float = TRUSTED) -> list[NDArray[np.bool_]]:
    """Return which samples of less weight stray; none where too many do, or too many in a row."""
    result, in_a_row = [weight < least for weight in weights], 0
    for stray in result:
        runs = np.diff(np.flatnonzero(np.concatenate([[True], ~stray, [True]]))) - 1
        in_a_row = max(in_a_row, int(runs.max()))
    count, samples = sum(int(stray.sum()) for stray in result), sum(part.size for part in result)
    few = in_a_row <= STRAYS_TOGETHER and count <= STRAYS * samples
    return [part & few for part in result]


def without_strays(scale: Scale) -> Scale:
    """Return a scale with no weight for samples that stray by themselves; itself without any."""
    out = strays(scale.weights)
    if not any(part.any() for part in out):
        return scale
    pairs = zip(out, scale.weights, strict=True)
    return replace(scale, weights=tuple(np.where(stray, 0.0, own) for stray, own in pairs))


def robust_fit(
    problem: Problem, model: Model, precision: Array | None = None, rounds: int = 2
) -> tuple[Fit, Scale]:
    """Return a fit, reweighted a few times from what the model leaves as it is, and its scale."""
    scale = robust_scale(problem, problem.residuals(model))
    result = fit(problem, model, scale, precision)
    for _ in range(rounds):
        scale = robust_scale(problem, problem.residuals(result.model))
        result = fit(problem, result.model, scale, precision)
    return result, scale


def with_weights(scale: Scale, problem: Problem) -> Scale:
    return replace(scale, weights=tuple(np.ones(m) for m in problem.samples))


def effect_precision(model: Model) -> Array:
    parts = [spreads(model.robot, effect) for effect in model.found]
    return np.asarray(np.concatenate([np.zeros(0), *parts]) ** -2.0) if parts else np.zeros(0)


def frame_prior(problem: Problem, model: Model) -> tuple[Array, Array]:
    """
    Return the prior precision of the frame columns, and how far the frames are off, (F,) each.

    In the order of `Problem.frame_columns`; nothing is believed of frames without an anchor.
    Errors that samples share come in standard deviations. What may differ between recordings is
    believed to be as large as in a machine.
    """
    anchor, frames = problem.anchor, list[Array]()
    precision = np.zeros(problem.frame_count)
    if anchor is not None:
        # Nothing is believed of frames without an anchor.
        sizes = np.repeat([FRAME_SHIFT, FRAME_TURN], 3)
        first = [group[0] for group in problem.stands] if 'base' in problem.align else []
        frames = [frame_offset(model.bases[k], anchor.bases[k], left=True) for k in first]
        if 'tool' in problem.align:
            tool = model.robot.T_flange_tool
            frames.append(frame_offset(tool, anchor.tool, left=False))
        names = [*('base' for _ in first), *(problem.align & {'tool'})]
        believed = np.repeat([name in anchor.of for name in names], 6)
        precision = believed * np.tile(sizes**-2.0, len(names))
    off = np.concatenate(frames) if frames else np.zeros(problem.frame_count)
    beside = [model.shared(k, own.mean.size) - own.mean for k, own in problem.common]
    precision = np.concatenate([precision, *(np.ones(part.size) for part in beside)])
    off = np.concatenate([off, *beside])
    spread = [spreads(model.robot, change.effect) for change in model.changes]
    now = [change.effect.fit.coordinates() for change in model.changes]
    # What differs by more than machines bend is another tool or base, and may be anywhere.
    wide = [np.maximum(one, np.abs(far)) for one, far in zip(spread, now, strict=True)]
    own = np.concatenate([np.zeros(0), *wide]) ** -2.0 if wide else np.zeros(0)
    return np.concatenate([precision, own]), np.concatenate([off, *now])


def frame_offset(now: Array, was: Array, *, left: bool) -> Array:
    """Return the step (xyz, rotvec) between frames; a base turns about axes outside (``left``)."""
    one, other = now[:3, :3], was[:3, :3]
    turn = one @ other.T if left else other.T @ one
    return np.concatenate([now[:3, 3] - was[:3, 3], rotation_vector(turn)])
