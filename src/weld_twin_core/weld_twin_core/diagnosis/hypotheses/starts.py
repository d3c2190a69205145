# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a local fit of an effect starts: the best of many instances, each with its best size."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect, Stage, View
from ...twin.features import Features
from ...twin.memory import Picker
from ..algebra.columns import Maker, Piece
from ..algebra.definite import outside, span_of
from ..algebra.fit import design
from ..algebra.problem import Model, Problem, Scale
from ..algebra.still_joints import moved_most

MEMORY = (Stage.SERVO, Stage.PLAY)
LEAST = 1e-9
"""Size, as a share of the typical one, that is taken for less: zero has no logarithm."""
USUAL = 0.8
"""Spread of the logarithm of a frequency or a damping about the typical one."""
Tried = tuple[list[Effect], Array]
"""Instances of an effect, and by how much the whitened sum of squares falls with each, (D,)."""


def started(problem: Problem, model: Model, scale: Scale, effect: Effect) -> Effect:
    """
    Return the instance of an effect from which to fit it beside those a model has.

    The effect itself where its kind has no need of a search.
    """
    if not effect.fit.searched:
        return effect
    looker, zoom = _Looker.of(problem, model, scale), 0
    while (tried := looker.tried(effect, zoom)) is not None:
        effects, gains = tried
        effect = effects[int(np.argmax(gains + _prior(effects)))]
        zoom += 1
    return effect


def profile(problem: Problem, model: Model, scale: Scale, k: int) -> Tried | None:
    """
    Return instances in the place of found effect k, and by how much each fits worse, (D,).

    In whitened squares; None where the effect's kind has no need of a search.

    k: which of the found effects, counted from 0.
    """
    effect = model.found[k]
    if not effect.fit.searched:
        return None
    looker = _Looker.of(problem, model.without(k), scale)
    tried = looker.tried(effect, 0)
    if tried is None:
        return None
    remaining = problem.whitened(problem.residuals(model), scale)
    here = float(looker.residual @ looker.residual - remaining @ remaining)
    return tried[0], here - tried[1]


def _prior(effects: list[Effect]) -> Array:
    """Return how plausible instances are by the size of what bends them, shape (D,) [nats]."""
    sizes = enumerate(effects[0].parameters)
    bent = [k for k, p in sizes if not p.linear and p.lower >= 0.0]
    typical = np.array([effects[0].parameters[k].typical for k in bent])
    values = np.array([effect.vector()[bent] for effect in effects])
    return np.asarray(
        -0.5 * ((np.log(np.maximum(values / typical, LEAST)) / USUAL) ** 2).sum(axis=1)
    )


@dataclass(frozen=True, eq=False)
class _Looker:
    """What every look at a joint shares: the residual, and what must be fitted along."""

    maker: Maker
    residual: Array
    """With frames and effects in the model fitted, shape (rows,)."""
    span: Array
    """Orthonormal rows that span those, shape (P, rows)."""

    @classmethod
    def of(cls, problem: Problem, model: Model, scale: Scale) -> _Looker:
        """Take the residual and its columns at a model."""
        span = span_of(design(problem, model, scale))
        residual = outside(problem.whitened(problem.residuals(model), scale)[None], span)[0]
        return cls(Maker(problem, problem.features(model), scale), residual, span)

    def tried(self, effect: Effect, zoom: int) -> Tried | None:
        """Return the instances of one zoom, each with its best linear parameter."""
        features = self.maker.features
        most = features[moved_most(features, effect.site)]
        # What moves the joint most says which instances; the others say what they do there.
        starts = effect.fit.starts(_view(most, effect), zoom)
        if starts is None:
            return None
        effects, joint = starts[0], most.twin.robot.index(str(effect.site))
        parts = []
        for maker in features:
            moved, view = starts[1], _view(maker, effect)
            if maker is not most:
                shifts = [
                    np.broadcast_to(e.displace(view)['q', joint], view.t.shape) for e in effects
                ]
                moved = np.stack(shifts)
            if effect.stage in MEMORY:  # at the stamps of the measurements
                moved = Picker(maker.recording.joints, maker.run.view.t).pick(moved)
            parts.append(moved)
        piece = Piece(np.concatenate(parts, axis=1), self.maker.moved(joint))
        assert piece.joint is not None
        pull = piece.products(self.residual[None])[:, 0]
        mass = piece.each**2 @ piece.joint.square
        shared = (piece.products(self.span) ** 2).sum(axis=1)
        return _sized(effects, pull, np.maximum(mass - shared, 1e-12 * mass + 1e-300))


def _view(maker: Features, effect: Effect) -> View:
    """Return what an effect sees of a recording."""
    return maker.joint_view if effect.stage in MEMORY else maker.view


def _sized(effects: list[Effect], pull: Array, mass: Array) -> Tried:
    """Return the instances with their linear parameter fitted, where they have one."""
    linear = [p for p in effects[0].parameters if p.linear]
    if not linear:
        return effects, 2.0 * pull - mass
    best = np.clip(pull / mass, linear[0].lower, linear[0].upper)
    sized = [replace(e, **{linear[0].name: float(b)}) for e, b in zip(effects, best, strict=True)]
    return sized, best * (2.0 * pull - best * mass)
