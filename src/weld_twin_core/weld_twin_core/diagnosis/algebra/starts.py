# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a local fit of an effect starts: the best of many instances, each with its best size."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect, Stage, View
from ...twin.features import Features
from ...twin.stages import Picker
from ..negligible import EMPTY, FLAT, ROUNDING
from .columns import Maker, Piece, Rows, rows_of
from .definite import outside, span_of
from .fit import design
from .motions import moved_most
from .problem import Model, Problem, Scale

MEMORY = (Stage.SERVO, Stage.PLAY)
USUAL = 0.8
"""Spread of the logarithm of a frequency or a damping about the typical one."""
CHANCE = 0.01
"""How probable it may be that one of many unrelated instances fits as well."""
SAME = 0.5
"""Two choices whose difference has less than this share of the squares of one are the same but for
edges: unrelated ones, as large as each other, differ by twice as much as one has."""
Tried = tuple[list[Effect], Array]
"""Instances of an effect, and by how much the whitened sum of squares falls with each, (D,)."""


def started(problem: Problem, model: Model, scale: Scale, effect: Effect) -> Effect:
    """Return where to fit an effect from, beside those of a model: itself if nothing is searched."""
    if not effect.fit.searched:
        return effect
    return _Looker.of(problem, model, scale).best(effect)


def chosen_anew(problem: Problem, model: Model, scale: Scale, k: int, labels: Array) -> Array:
    """
    Return what found effect k takes off beyond what it takes off now, chosen without each part.

    For an effect that a search alone chooses (`FitHooks.chosen`), from the seeds of its kind. What
    was found is among the choices only where the others show more of it than chance would: the best
    of D unrelated instances takes more than 1 - (D / p)^(-2 / M) off M samples with probability p
    (`CHANCE`). Where the choice is what was found but for samples on the edge of a stair, that
    stays: on which side those lie the others cannot know. Whitened, shape (parts, rows).
    """
    whole, effect = _Looker.of(problem, model.without(k), scale), model.found[k]
    now, out = whole.taken(effect), np.zeros((int(labels.max()) + 1, problem.size))
    for b, rows in enumerate(rows_of(labels)):
        look = whole.without(rows)
        seeds, trials = look.seeds(effect)
        tried = [effect, *map(look.best, seeds)]
        taken = np.array([whole.taken(each) for each in tried])
        gains = look.gains(taken)
        by_chance = 1.0 - (trials / CHANCE) ** (-2.0 / (look.seen.mean() * sum(problem.samples)))
        if gains[0] < by_chance * _square(look.residual):
            gains[0] = -np.inf
        more = taken[int(np.argmax(gains + _prior(tried)))] - now
        if _square(more * look.seen) > SAME * _square(now * look.seen):
            out[b] = more
    return out


def _square(row: Array) -> float:
    return float(row @ row)


def profile(problem: Problem, model: Model, scale: Scale, k: int) -> Tried | None:
    """Return instances in place of found effect k, if searched, and how many squares each fits worse."""
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
    """Return how plausible instances are by the size of what bends them, shape (D,)."""
    sizes = enumerate(effects[0].parameters)
    bent = [k for k, p in sizes if not p.linear and p.lower >= 0.0]
    typical = np.array([effects[0].parameters[k].typical for k in bent])
    values = np.array([effect.vector()[bent] for effect in effects])
    off = np.log(np.maximum(values / typical, FLAT)) / USUAL
    return np.asarray(-(off**2).sum(axis=1) / 2.0)


@dataclass(frozen=True, eq=False)
class _Looker:
    """What every look at a joint shares: the residual, and what must be fitted along."""

    maker: Maker
    target: Array  # the residual of the model, zero where nothing is looked at, shape (rows,)
    columns: Array  # of frames and effects in the model, zero there, too, shape (P, rows)
    seen: Array  # one where it is looked, else zero, shape (rows,)

    @classmethod
    def of(cls, problem: Problem, model: Model, scale: Scale) -> _Looker:
        target = problem.whitened(problem.residuals(model), scale)
        maker = Maker(problem, problem.features(model), scale)
        return cls(maker, target, design(problem, model, scale), np.ones(target.size))

    def without(self, rows: Rows) -> _Looker:
        """Return one that does not look at some rows, all those of a sample or none."""
        seen = self.seen.copy()
        seen[rows] = 0.0
        return replace(self, target=self.target * seen, columns=self.columns * seen, seen=seen)

    @cached_property
    def span(self) -> Array:
        return span_of(self.columns)

    @cached_property
    def residual(self) -> Array:
        """Return the residual with frames and effects in the model fitted, shape (rows,)."""
        return np.asarray(outside(self.target[None], self.span)[0])

    def taken(self, effect: Effect) -> Array:
        """Return what an effect takes off the residual, to first order, shape (rows,)."""
        return np.asarray(self.maker.piece(effect).written_out().sum(axis=0))

    def seeds(self, effect: Effect) -> tuple[list[Effect], float]:
        """Return where a search for an effect's kind on its joint starts, and among how many."""
        features, joint = self.maker.features, str(effect.site)
        at = moved_most(features, joint)
        pull = self.maker.moved(features[at].twin.robot.index(joint)).summed(self.residual)
        ends = np.cumsum(self.maker.problem.samples)[:-1]
        return features[at].seeds(type(effect), joint, np.split(pull, ends)[at])

    def best(self, effect: Effect) -> Effect:
        zoom = 0
        while (tried := self.tried(effect, zoom)) is not None:
            effects, gains = tried
            effect = effects[int(np.argmax(gains + _prior(effects)))]
            zoom += 1
        return effect

    def gains(self, taken: Array) -> Array:
        """Return by how much the sum of squares falls with what each takes, (D, rows), (D,)."""
        moved = taken * self.seen
        mass = (moved**2).sum(axis=1) - ((moved @ self.span.T) ** 2).sum(axis=1)
        return np.asarray(2.0 * moved @ self.residual - mass)

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
                shifts = (e.displace(view)['q', joint] for e in effects)
                moved = np.stack([np.broadcast_to(shift, view.t.shape) for shift in shifts])
            if effect.stage in MEMORY:  # at the stamps of the measurements
                moved = Picker(maker.recording.joints, maker.run.view.t).pick(moved)
            parts.append(moved)
        piece = Piece(np.concatenate(parts, axis=1), self.maker.moved(joint))
        assert piece.joint is not None
        pull = piece.products(self.residual[None])[:, 0]
        mass = piece.each**2 @ piece.joint.summed(piece.joint.row * self.seen)
        shared = (piece.products(self.span) ** 2).sum(axis=1)
        return _sized(effects, pull, np.maximum(mass - shared, ROUNDING * mass + EMPTY))


def _view(maker: Features, effect: Effect) -> View:
    return maker.joint_view if effect.stage in MEMORY else maker.view


def _sized(effects: list[Effect], pull: Array, mass: Array) -> Tried:
    """Return the instances with their linear parameter fitted, where they have one."""
    linear = [p for p in effects[0].parameters if p.linear]
    if not linear:
        return effects, 2.0 * pull - mass
    best = np.clip(pull / mass, linear[0].lower, linear[0].upper)
    sized = [replace(e, **{linear[0].name: float(b)}) for e, b in zip(effects, best, strict=True)]
    return sized, best * (2.0 * pull - best * mass)
