# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Dozens of small errors acting together, as in every arm once its one large fault is mended.

All geometric errors, the gears' ripple of every order, and the errors of load, play and coupling
are fitted at once; freely they would chase the noise. So every group of like coordinates (a family; a
joint's ripple within a band of orders) has a prior whose variance maximises the evidence: a group that
the data do not need shrinks to nothing. Narrow ripple lines above the dense orders are then looked for
one by one. A joint that travels too little to tell waves from each other has a curve over its angle in
their place.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...effects import REGISTRY
from ...effects.effect import Effect, Stage
from ...twin.features import Features, joints_of
from ..algebra.columns import Maker, Piece, designed
from ..algebra.definite import outside, share_outside, span_of
from ..algebra.fit import (
    Fit,
    coordinates,
    effect_precision,
    fit,
    frame_prior,
    robust_scale,
    solve_scaled,
    stepped,
)
from ..algebra.independent_rows import FEWEST
from ..algebra.learned_sizes import learned_precision, projected
from ..algebra.motions import candidate_kinds, hardly_moves, lacking, moved_most, separable_orders
from ..algebra.problem import Model, Problem, Scale
from ..beliefs import Beliefs
from ..negligible import FLAT, HIDDEN
from ..unseen.unseen_stretches import Unseen

LINES = 40
"""Lines at the most; the weakest of so many is far below what decides anything."""


def many_small(
    problem: Problem,
    model: Model,
    exclude: Sequence[str],
    beliefs: Beliefs,
    progress: Callable[[str], None],
) -> tuple[Fit, Scale, Array]:
    """Return the fit of all families together, its noise and its prior precision."""
    found = model.found
    everything = model.with_found(_everything(problem, model, exclude, beliefs))
    scale = robust_scale(problem, problem.residuals(model))
    model, scale = shrunk_step(problem, everything, scale, beliefs)
    model = model.with_found(tuple(effect.fit.turned() for effect in model.found))
    progress('families fitted together')
    model = with_lines(problem, model, scale, beliefs)
    progress('lines of high order looked for')
    model = with_time(problem, model, found, exclude, scale, beliefs)
    progress('motion of the set-up looked for')
    model, scale = shrunk_step(problem, model, scale, beliefs)
    result, precision = shrunk_fit(problem, model, scale, beliefs)
    return result, scale, precision


def _everything(
    problem: Problem, model: Model, exclude: Sequence[str], beliefs: Beliefs
) -> tuple[Effect, ...]:
    """
    Return every effect that fits linearly, at zero unless the search has found its value.

    Of other kinds those that the search has found.
    """
    features = problem.features(model)
    have = {effect.key: effect for effect in model.found}
    # All joints' pairs of coordinates together stay below half the rows.
    most = problem.size // (4 * model.robot.n)
    out: list[Effect] = []
    small: Sequence[Effect]
    for kind in candidate_kinds(problem.align):
        alike = kind.traits.common and kind.stage not in (Stage.SERVO, Stage.CLOCK)
        if kind.name in exclude or not alike:
            # Postures visited in an order look like a creep, which goes on where the arm does not.
            if kind.traits.depends_on != 'time':
                out += [e for e in model.found if e.name == kind.name]
            continue
        for joint in joints_of(kind, model.robot):
            view = features[moved_most(features, joint)].view
            if lacking(features, kind, joint) is not None:
                continue
            if kind.traits.waves is None:
                # Each as the search has found it where it has.
                each = {seed.key: seed for seed in reversed(kind.search.small(view, joint, most))}
                small = [have.get(key, seed) for key, seed in reversed(each.items())]
            elif np.ptp(_ends(features, str(joint))) >= beliefs.wave_range:
                reported = separable_orders(features, str(joint))
                small = kind.search.small(view, joint, min(most, reported))
            else:
                small = []
            out += [effect for effect in small if not hardly_moves(features, effect)]
    out += _bends(
        features, exclude, {effect.site for effect in out if effect.search.orders().size}
    )
    out = _apart_from_frames(problem, features, out)
    return (*out, *(e for e in model.found if e.traits.dated))


def _apart_from_frames(
    problem: Problem, features: list[Features], effects: list[Effect]
) -> list[Effect]:
    """
    Return the effects that fitted frames do not take the place of.

    While a joint stands still, an error of its row looks like a turn of base or tool. What little
    the frames leave of it would be read off the misfit of everything else, and be wrong by degrees
    where the joint moves.
    """
    scale = problem.unit_scale()
    # What an instrument's samples share is known within its spread, and takes no place for free.
    frames = problem.whitened(problem.not_shared().frame_columns(features)[0], scale)
    out, span = [], span_of(frames)
    for effect in effects:
        own = problem.whitened(problem.effect_columns(features, effect, atoms=False), scale)
        if (share_outside(own, span) > HIDDEN).any():
            out.append(effect)
    return out


def _bends(
    features: list[Features], exclude: Sequence[str], waved: AbstractSet[str | None]
) -> list[Effect]:
    """Return what bends the joints that turn and have no waves of their own."""
    robot = features[0].twin.robot
    kinds = [k for k in REGISTRY.values() if k.traits.bends and k.name not in exclude]
    out = []
    for i, joint in enumerate(robot.joint_names):
        if joint not in waved and not robot.prismatic[i]:
            angles = np.concatenate([maker.view.joint(i) for maker in features])
            out += [kind.search.bend(joint, angles) for kind in kinds]
    return [effect for effect in out if effect is not None]


def with_time(
    problem: Problem,
    model: Model,
    found: Sequence[Effect],
    exclude: Sequence[str],
    scale: Scale,
    beliefs: Beliefs,
) -> Model:
    """
    Return the model with the set-up's own creep and step in time, where they show beside all the rest.

    Both are nuisance: they are part of where the frames were, not of the robot. Where they show, an
    error of the robot or of the instrument that goes with time may be worth more, and is in their
    place.
    """
    if 'base' not in problem.align:
        return model
    features, waiting = problem.features(model), list[Sequence[Effect]]()
    have = {(effect.name, effect.site) for effect in model.found}
    setup = [kind for kind in REGISTRY.values() if kind.traits.of_setup]
    for kind in (*candidate_kinds(problem.align), *setup):
        if kind.traits.depends_on != 'time' or kind.traits.dated or kind.name in exclude:
            continue
        for joint in joints_of(kind, model.robot):
            if (kind.name, joint) in have or lacking(features, kind, joint) is not None:
                continue
            seeds = features[moved_most(features, joint)].seeds(kind, joint)[0]
            own = [e for e in found if (e.name, e.site) == (kind.name, joint)]
            if tried := own or [seed for seed in seeds if not hardly_moves(features, seed)]:
                waiting.append(tried)
    while True:
        features = problem.features(model)
        span = span_of(problem.whitened(problem.frame_columns(features)[0], scale))
        residual = outside(problem.whitened(problem.residuals(model), scale), span)
        best_of = partial(_best_of, problem, features, span, residual, scale)
        moved = [best_of(seeds) for seeds in waiting if seeds[0].traits.of_setup]
        # Mostly the set-up stood still, and nothing else is asked.
        if max((chi for chi, *_ in moved), default=0.0) <= beliefs.setup_chi2:
            return model
        best = [best_of(seeds) for seeds in waiting]
        # A turn of the base may be one number of a joint: each number has its price (Schwarz).
        worth = [chi - count * np.log(problem.size) for chi, count, _ in best]
        k = int(np.argmax(worth))
        if best[k][0] <= beliefs.setup_chi2:
            return model
        model = model.with_found((*model.found, best[k][2]))
        del waiting[k]


def _best_of(
    problem: Problem,
    features: list[Features],
    span: Array,
    residual: Array,
    scale: Scale,
    seeds: Sequence[Effect],
) -> tuple[float, int, Effect]:
    """Return what the best of some seeds takes off chi-square, its numbers, and that one itself."""
    tried = list[tuple[float, int, Effect]]()
    for seed in seeds:
        own = outside(problem.whitened(problem.effect_columns(features, seed), scale), span)
        size = np.linalg.lstsq(own.T, residual, rcond=None)[0]
        tried.append((float(residual @ (size @ own)), size.size, seed.from_atoms(size)))
    return max(tried, key=lambda one: one[0])


@dataclass(frozen=True, eq=False)
class Lines:
    """Waves of one joint that may be lines of its ripple."""

    orders: Array
    """Shape (K,) [1/rev]."""
    free: NDArray[np.bool_]
    """Which of them are far enough from every order that is in the ripple, shape (K,)."""
    piece: Piece
    """Sine and cosine of every order."""
    normal: Array
    """Their products with each other, shape (K, 2, 2)."""
    apart: float
    """Half the resolution in orders that the range of motion allows."""

    @classmethod
    def of(cls, maker: Maker, ripple: Effect, orders: Array) -> Lines:
        """Return the waves of some orders at the joint of a ripple."""
        low, high = _ends(maker.features, str(ripple.site))
        piece = maker.piece(ripple.search.with_orders(orders))
        size = 1.0 if piece.joint is None else np.sqrt(piece.joint.square)
        pairs = (piece.each * size).reshape(orders.size, 2, -1)
        normal = pairs @ np.swapaxes(pairs, 1, 2)
        normal += FLAT * np.eye(2) * np.trace(normal[0])
        apart = float(np.ceil(np.pi / (high - low)))
        out = cls(orders, np.ones(orders.size, dtype=bool), piece, normal, apart)
        for order in ripple.search.orders():
            out.close(order)
        return out

    def close(self, order: float) -> None:
        """Take the orders next to one that is in the ripple out."""
        self.free[np.abs(self.orders - order) < self.apart] = False

    def peak(self, residual: Array) -> tuple[float, int, Array]:
        """Return the chi-square of the strongest order, its number, and (sine, cosine)."""
        right = self.piece.products(residual[None]).reshape(-1, 2) * self.free[:, None]
        step = np.linalg.solve(self.normal, right[..., None])[..., 0]
        chi = (right * step).sum(axis=-1)
        k = int(np.argmax(chi))
        return float(chi[k]), k, step[k]

    def explained(self, k: int, step: Array) -> Array:
        """Return what a wave takes off the whitened residual, shape (rows,)."""
        return Piece(self.piece.each[2 * k : 2 * k + 2], self.piece.joint).mixed(step)


def _ends(features: Sequence[Features], joint: str) -> tuple[float, float]:
    """Return between which angles a joint travels, all recordings together."""
    i = features[0].twin.robot.index(joint)
    ends = [(one.reach[0][i], one.reach[1][i]) for one in features]
    return min(low for low, _ in ends), max(high for _, high in ends)


def lines_of(maker: Maker, effect: Effect, least: float) -> Lines | None:
    """
    Return the waves above the dense ones of an effect of waves; None where none can be told.

    least: travel below which nothing is looked for [rad].
    """
    waves = effect.traits.waves
    if waves is None or np.ptp(_ends(maker.features, str(effect.site))) < least:
        return None
    most = min(waves.highest, separable_orders(maker.features, str(effect.site)))
    orders = np.arange(waves.dense + 1.0, most + 1.0)
    return Lines.of(maker, effect, orders) if orders.size else None


def with_lines(problem: Problem, model: Model, scale: Scale, beliefs: Beliefs) -> Model:
    """
    Return the model with narrow lines above the dense orders of its waves.

    The score statistic of sine and cosine at every order costs one small product per joint; the
    strongest line enters, the residual it explains is taken off, and the look is repeated.
    """
    maker, found = Maker(problem, problem.features(model), scale), list(model.found)
    each = ((k, lines_of(maker, effect, beliefs.wave_range)) for k, effect in enumerate(found))
    looks = [(k, lines) for k, lines in each if lines is not None]
    residual = problem.whitened(problem.residuals(model), scale)
    for _ in range(LINES if looks else 0):
        peaks = [(*lines.peak(residual), k, lines) for k, lines in looks]
        chi, n, step, k, lines = max(peaks, key=lambda peak: peak[0])
        if chi < beliefs.line_chi2:
            break
        residual = residual - lines.explained(n, step)
        lines.close(lines.orders[n])
        orders = np.append(found[k].search.orders(), lines.orders[n])
        found[k] = found[k].search.with_orders(orders)
    return model.with_found(tuple(found))


def groups(result: tuple[Effect, ...], beliefs: Beliefs) -> tuple[Array, Array]:
    """
    Return the group number and the typical size of every fit coordinate, shapes (K,).

    Number -1 marks coordinates that are fitted freely.
    """
    labels = [label for effect in result for label in effect.fit.alike()]
    scales = [effect.fit.coordinate_scales() for effect in result]
    names = {label: k for k, label in enumerate(dict.fromkeys(labels))}
    numbers = np.array([names[label] for label in labels], dtype=int)
    free = np.bincount(numbers, minlength=len(names))[numbers] < FEWEST
    return np.where(free, -1, numbers), np.concatenate([np.zeros(0), *scales])


def shrunk_step(
    problem: Problem, model: Model, scale: Scale, beliefs: Beliefs
) -> tuple[Model, Scale]:
    """Return the model after one linear step with learned priors, and the noise it leaves."""
    model, _, freedom = _learned(problem, model, scale, beliefs)
    return model, robust_scale(problem, problem.residuals(model), freedom=freedom)


def shrunk_fit(
    problem: Problem, model: Model, scale: Scale, beliefs: Beliefs
) -> tuple[Fit, Array]:
    """Return the fit with learned priors, and their precision, shape (K,)."""
    model, precision, _ = _learned(problem, model, scale, beliefs)
    return fit(problem, model, scale, precision, iterations=1), precision


def _learned(
    problem: Problem, model: Model, scale: Scale, beliefs: Beliefs
) -> tuple[Model, Array, float]:
    """Return the model after one linear step, the prior precision learned, and its freedom."""
    residual = problem.whitened(problem.residuals(model), scale)
    columns = designed(problem, model, scale)
    frame_ridge, off = frame_prior(problem, model)
    frames = frame_ridge.size
    normal, right = columns.normal(), columns.times(residual)
    normal[:frames, :frames] += np.diag(frame_ridge)
    right[:frames] -= frame_ridge * off
    sizes, rss = Sizes.of(model, beliefs), float(residual @ residual)
    precision, freedom, step = sizes.learned(normal, right, rss, residual.size)
    trial = stepped(problem, model, step)
    moved, x_moved = problem.whitened(problem.residuals(trial), scale), coordinates(trial)
    if moved @ moved + precision @ x_moved**2 > rss + precision @ sizes.now**2:
        trial = fit(problem, model, scale, precision, iterations=2).model
    return trial, precision, freedom + frames


@dataclass(frozen=True, eq=False)
class Sizes:
    """What is known of the sizes of a model's coordinates before they are learned, shapes (K,)."""

    now: Array
    """The coordinates."""
    labels: Array
    scales: Array
    """As `groups` returns them."""
    believed: Array
    """Prior precision; see `believed`."""

    @classmethod
    def of(cls, model: Model, beliefs: Beliefs) -> Sizes:
        """Return what is known of a model's coordinates."""
        return cls(coordinates(model), *groups(model.found, beliefs), believed(model))

    def learned(
        self, normal: Array, right: Array, rss: float, rows: int
    ) -> tuple[Array, float, Array]:
        """
        Return the prior precision learned, the freedom that it leaves, and the step to where it leads.

        normal, right, rss, rows: normal equations of the frames, with what is believed of these,
        and of all coordinates.
        """
        frames = len(right) - self.now.size
        # What the coordinates explain already is put back.
        now = np.concatenate([np.zeros(frames), self.now])
        shift = normal @ now
        explained = float(2.0 * now @ right + now @ shift)
        precision, freedom = learned_precision(
            *projected(normal, right + shift, rss + explained, frames),
            rows - frames,
            self.labels,
            self.scales,
            self.believed,
        )
        ridge = np.concatenate([np.zeros(frames), precision])
        step = solve_scaled(normal + np.diag(ridge), right - ridge * now, FLAT)
        return precision, freedom, step


def predicted(unseen: Unseen, model: Model, beliefs: Beliefs) -> Array:
    """
    Return what is left on every part by a model fitted on the others, shape (rows,), whitened.

    The sizes of its groups are learned on the others as well: learned on all, they know what was
    left out, and on a dozen stations dozens of errors predict pure noise.
    """
    frames, residual = unseen.frames, unseen.residual
    whole = np.sum(unseen.normals, axis=0)
    whole[:frames, :frames] += np.diag(unseen.precision[:frames])
    sizes, out = Sizes.of(model, beliefs), np.array(residual)
    for b, rows in enumerate(unseen.spans):
        right, here = unseen.rights_of_residual[b][:, 0].copy(), residual[rows]
        right[:frames] -= unseen.pull[:frames]
        rss, count = float(residual @ residual - here @ here), residual.size - here.size
        *_, step = sizes.learned(whole - unseen.normals[b], right, rss, count)
        out[rows] -= unseen.stretches[b].mixed(step)
    return out


def believed(model: Model) -> Array:
    """Return the prior precision of every coordinate; curves are as high as ripple usually is."""
    parts = [effect_precision(model.with_found((effect,))) for effect in model.found]
    for effect, part in zip(model.found, parts, strict=True):
        if not (effect.traits.cause or effect.traits.of_setup):
            unknown = part == 0.0
            part[unknown] = effect.fit.coordinate_scales()[unknown] ** -2.0
    return np.concatenate([np.zeros(0), *parts])
