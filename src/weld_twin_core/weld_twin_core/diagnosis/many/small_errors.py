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

import numpy as np

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
from .wave_lines import with_lines

SEEN = 0.05
"""Part of an error's effect on the tool that fitted frames must leave of it: formulas are a few
per cent off real arms, so that less than this says nothing of the error."""


def many_small(
    problem: Problem,
    model: Model,
    exclude: Sequence[str],
    beliefs: Beliefs,
    progress: Callable[[str], None],
    orders: int | None = None,
) -> tuple[Fit, Scale, Array]:
    """
    Return the fit of all families together, its noise and its prior precision.

    Parameters
    ----------
    orders : int, optional
        The most orders of waves, where the measurements are too few to learn any size from; all
        that they tell when left out, and sizes are learned.

    """
    learn = orders is None
    everything = model.with_found(_everything(problem, model, exclude, beliefs, orders))
    scale = robust_scale(problem, problem.residuals(model))
    model, scale = shrunk_step(problem, everything, scale, beliefs, learn=learn)
    model = model.with_found(tuple(effect.turned() for effect in model.found))
    progress('families fitted together')
    if learn:
        model = with_lines(problem, model, scale, beliefs)
        progress('lines of high order looked for')
    if 'base' in problem.align:
        model = with_setup(problem, model, scale, beliefs)
        progress('motion of the set-up looked for')
    model, scale = shrunk_step(problem, model, scale, beliefs, learn=learn)
    result, precision = shrunk_fit(problem, model, scale, beliefs, learn=learn)
    return result, scale, precision


def _everything(
    problem: Problem,
    model: Model,
    exclude: Sequence[str],
    beliefs: Beliefs,
    orders: int | None,
) -> tuple[Effect, ...]:
    """Return every effect that fits linearly, at zero unless the search has found its value."""
    features = problem.features(model)
    have = {effect.key: effect for effect in model.found}
    # All joints' pairs of coordinates together stay below half the rows.
    most = problem.size // (4 * model.robot.n)
    out: list[Effect] = []
    small: Sequence[Effect]
    for kind in candidate_kinds(exclude, problem.align):
        if kind.stage in (Stage.SERVO, Stage.CLOCK) or not kind.common:
            out += [e for e in model.found if e.name == kind.name]
            continue
        for joint in joints_of(kind, model.robot):
            view = features[moved_most(features, joint)].view
            if kind.applicable(view, joint) is not None:
                continue
            if kind.waves is None:
                small = _as_found(kind.small(view, joint, most), have)
            elif orders is not None or _travel(view, joint) >= beliefs.wave_range:
                told = orders_told(features, str(joint))
                small = kind.small(view, joint, min(orders or most, told))
            else:
                small = []
            out += [effect for effect in small if not hardly_moves(features, effect)]
    out += _bends(features, exclude, {effect.site for effect in out if effect.orders().size})
    out = _apart_from_frames(problem, features, out)
    return (*out, *(e for e in model.found if e.dated))


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
    kinds = [k for k in REGISTRY.values() if k.bends and k.name not in exclude]
    out = []
    for i, joint in enumerate(robot.joint_names):
        if joint not in waved and not robot.prismatic[i]:
            angles = np.concatenate([maker.view.joint(i) for maker in features])
            out += [kind.bend(joint, angles) for kind in kinds]
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
    for kind in [kind for kind in REGISTRY.values() if kind.of_setup and not kind.dated]:
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
