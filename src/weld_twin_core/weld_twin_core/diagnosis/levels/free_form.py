# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What explains the gap when no name does: places, dependences, and the curves between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect
from ..algebra.fit import Fit, design
from ..algebra.problem import Problem, Scale
from ..beliefs import Beliefs
from ..unseen.folds import ways_to_divide
from .groups import Group, all_groups, wandering_groups
from .sparse_groups import choosing, chosen, rival_weights, worth
from .whole_arm import whole_arm_groups

STANDS_OUT, NAMED = 0.5, 3
"""Weight from which one place is named alone, and how many are named where none has it."""


@dataclass(frozen=True, eq=False)
class Part:
    """
    One group that helps to explain the gap.

    Attributes
    ----------
    group : Group
    ridge : float
    rivals : tuple of (Group, float)
        Each group that could stand in its place and its weight, itself included.
    share : float
        Of the squared error that is lost without it on unseen folds.

    """

    group: Group
    ridge: float
    rivals: tuple[tuple[Group, float], ...]
    share: float = 0.0

    def weight_of(self, kind: str) -> dict[str, float]:
        """Return the weight of every place ('at') or dependence ('on'), largest first."""
        out: dict[str, float] = {}
        for group, weight in self.rivals:
            name = str(getattr(group, kind))
            out[name] = out.get(name, 0.0) + weight
        return dict(sorted(out.items(), key=lambda item: -item[1]))

    @property
    def words(self) -> str:
        """Return the group as people read it, or the places where none stands out."""
        places = self.weight_of('at')
        if max(places.values(), default=1.0) > STANDS_OUT:
            return str(self.group)
        return ' or '.join(list(places)[:NAMED])


@dataclass(frozen=True, eq=False)
class FreeForm:
    """
    The free-form explanation.

    Attributes
    ----------
    parts : tuple of Part
        In the order in which they were found.
    gain : float
        Share of the squared error that they take away on unseen folds, together.
    steady : float
        The same in standard errors between folds.

    """

    parts: tuple[Part, ...]
    gain: float = 0.0
    steady: float = 0.0

    @property
    def curves(self) -> tuple[Effect, ...]:
        """Return the curves to fit, their values zero."""
        return tuple(curve for part in self.parts for curve in part.group.carried)

    @property
    def precision(self) -> Array:
        """Return the prior precision of the curves' values, in units of noise, shape (K,)."""
        held = [part.group.held(part.ridge) for part in self.parts if part.group.carried]
        return np.concatenate([np.zeros(0), *held])


STRETCHES = 10
"""Stretches of time that take turns in being unseen."""
SHORT = 60
"""Short stretches of which every tenth is left out together: what wanders is told from its
neighbours in time, though not a minute later."""


def free_form(
    problem: Problem,
    scale: Scale,
    bare: Fit,
    precision: Array,
    beliefs: Beliefs,
    *,
    wandering: bool = False,
    whole_arm: bool = False,
) -> FreeForm:
    """
    Return the few groups that explain what a fit leaves, each with its rivals.

    Parameters
    ----------
    problem : Problem
    scale : Scale
    bare : Fit
        Frames and the effects that are named beyond doubt.
    precision : array, shape (K,)
        Prior precision of those effects' coordinates.
    beliefs : Beliefs
    wandering : bool
        Look for what changes as the recording goes on, and ask no more of it than to predict
        short stretches from their neighbours.
    whole_arm : bool
        Look also for causes that act at several joints at once, which no curve can carry.

    """
    columns, _ = design(problem, bare.model, scale)
    held = np.zeros(columns.shape[0])
    if precision.size:
        held[-precision.size :] = precision
    groups = all_groups(problem, bare.model, scale)
    if whole_arm:
        groups += whole_arm_groups(problem, bare.model, scale)
    ways = ways_to_divide(problem, STRETCHES)
    if wandering:
        groups += wandering_groups(problem, bare.model, scale)
        ways = [problem.block_labels(SHORT) % STRETCHES]
    work = choosing(groups, columns, held, bare.residual, ways)
    members = chosen(work, beliefs)
    parts, total = [], worth(work, members)
    for k, member in enumerate(members):
        weights = rival_weights(work, members, k, beliefs)
        rivals = tuple((groups[g], w) for g, w in weights if w > 0.0)
        parts.append(Part(groups[member.group], member.ridge, rivals, total.shares[k]))
    return FreeForm(tuple(parts), total.gain, total.steady)
