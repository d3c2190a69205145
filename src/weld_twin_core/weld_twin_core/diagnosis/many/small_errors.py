# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Dozens of small errors acting together, as in every arm once its one large fault is mended.

All geometric errors, the gears' ripple of every order, and the errors of load, play and coupling
are fitted at once, each family held to a size learned from the data (`shrinkage`); narrow ripple
lines above the dense orders are then looked for one by one. A joint that travels too little to
tell waves from each other has a curve over its angle in their place.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...effects import REGISTRY
from ...effects.effect import Effect, Stage
from ...twin.features import Features, joints_of
from ..algebra.alias import outside, share_outside, span_of
from ..algebra.columns import Maker, Piece
from ..algebra.fit import Fit, robust_scale
from ..algebra.problem import Model, Problem, Scale
from ..beliefs import Beliefs
from ..hypotheses.library import candidate_kinds
from ..hypotheses.still_joints import hardly_moves, moved_most, orders_told
from .shrinkage import shrunk_fit, shrunk_step

SEEN = 0.05
"""Part of an error's effect on the tool that fitted frames must leave of it: formulas are a few
per cent off real arms, so that less than this says nothing of the error."""
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
    everything = model.with_found(_everything(problem, model, exclude, beliefs))
    scale = robust_scale(problem, problem.residuals(model))
    model, scale = shrunk_step(problem, everything, scale, beliefs)
    model = model.with_found(tuple(effect.fit.turned() for effect in model.found))
    progress('families fitted together')
    model = with_lines(problem, model, scale, beliefs)
    progress('lines of high order looked for')
    if 'base' in problem.align:
        model = with_setup(problem, model, scale, beliefs)
        progress('motion of the set-up looked for')
    model, scale = shrunk_step(problem, model, scale, beliefs)
    result, precision = shrunk_fit(problem, model, scale, beliefs)
    return result, scale, precision


def _everything(
    problem: Problem, model: Model, exclude: Sequence[str], beliefs: Beliefs
) -> tuple[Effect, ...]:
    """Return every effect that fits linearly, at zero unless the search has found its value."""
    features = problem.features(model)
    have = {effect.key: effect for effect in model.found}
    # All joints' pairs of coordinates together stay below half the rows.
    most = problem.size // (4 * model.robot.n)
    out: list[Effect] = []
    small: Sequence[Effect]
    for kind in candidate_kinds(exclude, problem.align):
        if kind.stage in (Stage.SERVO, Stage.CLOCK) or not kind.traits.common:
            # Postures visited in an order look like a creep, which goes on where the arm does not.
            if kind.traits.depends_on != 'time':
                out += [e for e in model.found if e.name == kind.name]
            continue
        for joint in joints_of(kind, model.robot):
            view = features[moved_most(features, joint)].view
            if kind.applicable(view, joint) is not None:
                continue
            if kind.traits.waves is None:
                # Each as the search has found it where it has.
                each = {seed.key: seed for seed in reversed(kind.search.small(view, joint, most))}
                small = [have.get(key, seed) for key, seed in reversed(each.items())]
            elif np.ptp(view.joint(view.robot.index(str(joint)))) >= beliefs.wave_range:
                reported = orders_told(features, str(joint))
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
        if (share_outside(own, span) > SEEN).any():
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


def with_setup(problem: Problem, model: Model, scale: Scale, beliefs: Beliefs) -> Model:
    """
    Return the model with the set-up's own creep and step in time, where they show.

    Both are nuisance: they are part of where the frames were, not of the robot.
    """
    for kind in [
        kind for kind in REGISTRY.values() if kind.traits.of_setup and not kind.traits.dated
    ]:
        features = problem.features(model)
        span = span_of(problem.whitened(problem.frame_columns(features)[0], scale))
        residual = outside(problem.whitened(problem.residuals(model), scale), span)
        best: tuple[float, Effect] | None = None
        for seed in features[moved_most(features, None)].seeds(kind, None)[0]:
            own = problem.whitened(problem.effect_columns(features, seed), scale)
            own = outside(own, span)
            size = np.linalg.lstsq(own.T, residual, rcond=None)[0]
            chi = float(residual @ (size @ own))
            if best is None or chi > best[0]:
                best = (chi, seed.from_atoms(size))
        if best is not None and best[0] > beliefs.setup_chi2:
            model = model.with_found((*model.found, best[1]))
    return model


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
        low, high = _ends(maker, ripple)
        piece = maker.piece(ripple.search.with_orders(orders))
        size = 1.0 if piece.joint is None else np.sqrt(piece.joint.square)
        pairs = (piece.each * size).reshape(orders.size, 2, -1)
        normal = pairs @ np.swapaxes(pairs, 1, 2)
        normal += 1e-9 * np.eye(2) * np.trace(normal[0])
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


def _ends(maker: Maker, effect: Effect) -> tuple[float, float]:
    """Return between which angles the joint of an effect travels."""
    i = maker.features[0].twin.robot.index(str(effect.site))
    ends = [(one.reach[0][i], one.reach[1][i]) for one in maker.features]
    return min(low for low, _ in ends), max(high for _, high in ends)


def lines_of(maker: Maker, effect: Effect, least: float) -> Lines | None:
    """
    Return the waves above the dense ones of an effect of waves; None where none can be told.

    least: travel below which nothing is looked for [rad].
    """
    waves = effect.traits.waves
    low, high = _ends(maker, effect) if waves is not None else (0.0, 0.0)
    if waves is None or high - low < least:
        return None
    most = min(waves.highest, orders_told(maker.features, str(effect.site)))
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
