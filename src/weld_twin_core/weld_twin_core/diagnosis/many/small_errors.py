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

from collections.abc import Callable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...effects import REGISTRY
from ...effects.effect import Effect, Stage, View
from ...twin.features import Features, joints_of
from ..algebra.alias import outside, share_outside, span_of
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
                small = _as_found(kind.search.small(view, joint, most), have)
            elif _travel(view, joint) >= beliefs.wave_range:
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


def _as_found(small: Sequence[Effect], have: Mapping[tuple[str, ...], Effect]) -> Sequence[Effect]:
    """Return instances, each as the search has found it where it has."""
    each = {seed.key: seed for seed in reversed(small)}
    return [have.get(key, seed) for key, seed in reversed(each.items())]


def _travel(view: View, joint: str | None) -> float:
    return float(np.ptp(view.joint(view.robot.index(str(joint)))))


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
class Waves:
    """
    Sine and cosine of every order of one joint, and what never changes from look to look.

    Attributes
    ----------
    columns : list of array, shape (c, M)
        d pose / d joint of every recording.
    masses : list of array, shape (c, M)
        The same, weighted by the noise.
    waves : list of array, shape (2 O, M)
        Single precision: their sums over thousands of stations are good to 1e-6.
    normal : array, shape (O, 2, 2)
    apart : float
        Half the resolution in orders that the range of motion allows.

    """

    joint: int
    columns: list[Array]
    masses: list[Array]
    waves: list[np.ndarray]
    normal: Array
    apart: float

    @classmethod
    def of(
        cls,
        problem: Problem,
        features: list[Features],
        scale: Scale,
        joint: int,
        orders: Array,
        least: float,
    ) -> Waves | None:
        """
        Return the waves of a joint, or None when it travels less than ``least`` [rad].

        Parameters
        ----------
        joint : int
            Counted from 0.
        orders : array, shape (K,) [1/rev]
            Orders to look at.
        least : float [rad]
            Travel below which nothing is looked for.

        """
        low = min(float(maker.view.q[:, joint].min()) for maker in features)
        high = max(float(maker.view.q[:, joint].max()) for maker in features)
        if high - low < least:
            return None
        columns, masses, waves = [], [], []
        normal = np.zeros((orders.size, 2, 2))
        for r, maker in enumerate(features):
            column = problem.seen(r, maker.column(('q', joint)))
            mass = problem.informed(r, column, scale)
            angle = orders[:, None] * maker.view.q[:, joint]
            sine, cosine = np.sin(angle), np.cos(angle)
            weight = (column * mass).sum(axis=0)
            squares = sine**2 @ weight
            cross = (sine * cosine) @ weight
            terms = [squares, cross, cross, weight.sum() - squares]
            normal += np.stack(terms, -1).reshape(-1, 2, 2)
            columns.append(column)
            masses.append(mass)
            waves.append(np.concatenate([sine, cosine]).astype(np.float32))
        normal += 1e-9 * np.eye(2) * np.trace(normal[0])
        apart = float(np.ceil(np.pi / (high - low)))
        return cls(joint, columns, masses, waves, normal, apart)

    def peak(
        self, residual: list[Array], free: NDArray[np.bool_]
    ) -> tuple[float, int, int, Array]:
        """
        Return the strongest order: chi-square, joint, its place among the orders, (sine, cosine).

        ``free``, shape (O,), marks the orders that may enter.
        """
        pull = np.zeros(2 * free.size)
        for mass, part, wave in zip(self.masses, residual, self.waves, strict=True):
            pull += wave @ (mass * part).sum(axis=0).astype(np.float32)
        right = np.where(free, pull.reshape(2, -1), 0.0).T
        step = np.linalg.solve(self.normal, right[..., None])[..., 0]
        chi = (right * step).sum(axis=-1)
        k = int(np.argmax(chi))
        return float(chi[k]), self.joint, k, step[k]


def with_lines(problem: Problem, model: Model, scale: Scale, beliefs: Beliefs) -> Model:
    """
    Return the model with narrow lines above the dense orders of its waves.

    The score statistic of sine and cosine at every order costs one small product per joint; the
    strongest line enters, the residual it explains is taken off, and the look is repeated.
    """
    kinds = [effect.traits.waves for effect in model.found if effect.traits.waves is not None]
    if not kinds:
        return model
    residual = problem.residuals(model)
    features = problem.features(model)
    orders = np.arange(kinds[0].dense + 1.0, kinds[0].highest + 1.0)
    each = [
        Waves.of(problem, features, scale, i, orders, beliefs.wave_range)
        for i in range(model.robot.n)
    ]
    waves = {w.joint: w for w in each if w is not None}
    free = {i: _free(model, features, w, orders) for i, w in waves.items()}
    result = list(model.found)
    for _ in range(LINES if waves else 0):
        chi, i, k, step = max(
            (w.peak(residual, free[i]) for i, w in waves.items()), key=lambda item: item[0]
        )
        if chi < beliefs.line_chi2:
            break
        for r, maker in enumerate(features):
            angle = orders[k] * maker.view.q[:, i]
            wave = step[0] * np.sin(angle) + step[1] * np.cos(angle)
            residual[r] = residual[r] - waves[i].columns[r] * wave
        free[i] = free[i] & (np.abs(orders - orders[k]) >= waves[i].apart)
        result = _with_order(result, model.robot.joint_names[i], float(orders[k]))
    return model.with_found(tuple(result))


def _free(
    model: Model, features: list[Features], waves: Waves, orders: Array
) -> NDArray[np.bool_]:
    """Return which orders no wave of the joint is too close to, shape (O,)."""
    joint = model.robot.joint_names[waves.joint]
    free: NDArray[np.bool_] = orders <= orders_told(features, joint)
    for effect in model.found:
        if effect.site == joint:
            for order in effect.search.orders():
                free &= np.abs(orders - order) >= waves.apart
    return free


def _with_order(result: list[Effect], joint: str, order: float) -> list[Effect]:
    return [
        effect.search.with_orders(np.append(effect.search.orders(), order))
        if effect.traits.waves and effect.site == joint
        else effect
        for effect in result
    ]
