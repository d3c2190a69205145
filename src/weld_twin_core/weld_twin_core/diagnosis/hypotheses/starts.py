# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a local fit of an effect starts: the best of many instances, each with its best size."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect, Stage, View
from ...twin.features import Features
from ...twin.resampling import Picker
from ..algebra.alias import span_of
from ..algebra.fit import design
from ..algebra.problem import Model, Problem, Scale
from .still_joints import moved_most

MEMORY = (Stage.SERVO, Stage.PLAY)
LEAST = 1e-9
"""Size, as a share of the typical one, that is taken for less: zero has no logarithm."""
USUAL = 0.8
"""Spread of the logarithm of a frequency or a damping about the typical one."""


class Profile(NamedTuple):
    """
    Instances of an effect and what each explains.

    Attributes
    ----------
    gains : array, shape (D,)
        Fall of the whitened sum of squares, frames and the other effects fitted anew.

    """

    effects: list[Effect]
    gains: Array


def started(problem: Problem, model: Model, scale: Scale, effect: Effect) -> Effect:
    """
    Return the instance of an effect from which to fit it beside those a model has.

    The effect itself where its kind has no need of a search.
    """
    if not searched(effect):
        return effect
    looker = _Looker.of(problem, model, scale)
    zoom, result = 0, looker.profile(effect, 0)
    while result is not None:
        effect = result.effects[int(np.argmax(result.gains + _prior(result.effects)))]
        zoom += 1
        result = looker.profile(effect, zoom)
    return effect


def searched(effect: Effect) -> bool:
    """Return whether an effect's kind needs a search for its start."""
    return effect.fit.searched


def profile(
    problem: Problem, model: Model, scale: Scale, k: int
) -> tuple[list[Effect], Array] | None:
    """
    Return instances in the place of found effect k, and by how much each fits worse, (D,).

    In whitened squares; None where the effect's kind has no need of a search.

    Parameters
    ----------
    k : int
        Which of the found effects, counted from 0.

    """
    effect = model.found[k]
    if not searched(effect):
        return None
    looker = _Looker.of(problem, model.without(k), scale)
    result = looker.profile(effect, 0)
    if result is None:
        return None
    remaining = problem.whitened(problem.residuals(model), scale)
    here = float(looker.residual @ looker.residual - remaining @ remaining)
    return result.effects, here - result.gains


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
    """
    What every look at a joint shares: the residual, and what must be fitted along.

    Attributes
    ----------
    residual : array, shape (rows,)
        With frames and effects in the model fitted.
    basis : array, shape (rows, P)
        Orthonormal columns of those.

    """

    problem: Problem
    scale: Scale
    features: list[Features]
    residual: Array
    basis: Array

    @classmethod
    def of(cls, problem: Problem, model: Model, scale: Scale) -> _Looker:
        """Take the residual and its columns at a model."""
        basis = span_of(design(problem, model, scale)[0]).T
        residual = problem.whitened(problem.residuals(model), scale)
        residual = residual - basis @ (basis.T @ residual)
        return cls(problem, scale, problem.features(model), residual, basis)

    def profile(self, effect: Effect, zoom: int) -> Profile | None:
        """Return the instances of one zoom, each with its best linear parameter."""
        joint = self.features[0].twin.robot.index(str(effect.site))
        residuals = self.problem.by_sample(self.residual)
        bases = self.problem.by_sample(self.basis)
        memory = effect.stage in MEMORY
        views = [maker.joint_view if memory else maker.view for maker in self.features]
        trials = [effect.fit.starts(view, zoom) for view in views]
        # What moves the joint most says which instances; the others say what they do there.
        most = trials[moved_most(self.features, effect.site)]
        reported = most or next((own for own in trials if own is not None), None)
        if reported is None:
            return None
        result = reported[0]
        pull, mass, shared = (np.zeros(()) for _ in range(3))
        for k, (maker, view) in enumerate(zip(self.features, views, strict=True)):
            own = trials[k]
            same = own is not None and _same(own[0], result)
            moved = own[1] if own is not None and same else _moved(result, view, joint)
            if memory:
                moved = Picker(maker.recording.joints, maker.run.view.t).pick(moved)
            column = self._white(maker, joint, k)
            pull = pull + moved @ (column * residuals[k]).sum(axis=1)
            mass = mass + moved**2 @ (column**2).sum(axis=1)
            shared = shared + moved @ np.einsum('mc,mcp->mp', column, bases[k])
        remaining = np.maximum(mass - (shared**2).sum(axis=1), 1e-12 * mass + 1e-300)
        return _sized(result, pull, remaining)

    def _white(self, maker: Features, joint: int, k: int) -> Array:
        """Return what one joint does in recording k, whitened, shape (M, c)."""
        column = self.problem.seen(k, maker.column(('q', joint)))
        return self.problem.in_noise(k, column, self.scale)


def _same(one: list[Effect], other: list[Effect]) -> bool:
    """Return whether two lists hold the same instances."""
    return len(one) == len(other) and all(
        np.array_equal(a.vector(), b.vector()) for a, b in zip(one, other, strict=True)
    )


def _moved(effects: list[Effect], view: View, joint: int) -> Array:
    """Return what each instance does to the joint, shape (D, N)."""
    each = [effect.displace(view) for effect in effects]
    return np.stack([np.broadcast_to(shift['q', joint], view.t.shape) for shift in each])


def _sized(effects: list[Effect], pull: Array, mass: Array) -> Profile:
    """Return the instances with their linear parameter fitted, where they have one."""
    linear = [p for p in effects[0].parameters if p.linear]
    if not linear:
        return Profile(effects, 2.0 * pull - mass)
    best = np.clip(pull / mass, linear[0].lower, linear[0].upper)
    sized = [replace(e, **{linear[0].name: float(b)}) for e, b in zip(effects, best, strict=True)]
    return Profile(sized, best * (2.0 * pull - best * mass))
