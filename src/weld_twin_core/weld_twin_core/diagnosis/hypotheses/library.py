# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The library of hypotheses: every family on every joint it can sit on, as columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect
from ...effects.registry import REGISTRY
from ...twin.features import Features, joints_of
from ..algebra.gram import Index
from ..algebra.problem import Model, Problem, Scale
from .still_joints import REASON, hardly_moves

EXCLUDED = 'excluded by the user'


@dataclass(frozen=True, eq=False)
class Unit:
    """
    One family on one joint: the smallest thing a verdict can name.

    Attributes
    ----------
    family : str
    joint : str or None
    seeds : tuple of Effect
        Instances that span it; more than one where a parameter bends the response.
    columns : tuple of array of int
        Column numbers of every seed.
    trials : float
        Among how many instances the seeds were chosen.

    """

    family: str
    joint: str | None
    seeds: tuple[Effect, ...]
    columns: tuple[Index, ...]
    trials: float

    @property
    def site(self) -> tuple[str, str | None]:
        """Return family and joint."""
        return self.family, self.joint

    def __str__(self) -> str:
        """Return family and joint as people read them."""
        return f'{self.family} of {self.joint}' if self.joint else self.family


@dataclass(frozen=True, eq=False)
class Library:
    """
    Columns of every unit, after those of the nuisance frames and of the effects in the model.

    Attributes
    ----------
    columns : array, shape (P, rows)
        Whitened.
    fixed : array of int
        Frames and effects already in the model; conditioned on in everything.
    units : tuple of Unit
    absent : dict
        Why a family is not considered, by name.

    """

    columns: Array
    fixed: Index
    units: tuple[Unit, ...]
    absent: dict[str, str]

    def unit(self, family: str, joint: str | None) -> Unit | None:
        """Return a unit by name, or None."""
        for unit in self.units:
            if unit.site == (family, joint):
                return unit
        return None


def candidate_kinds(exclude: Sequence[str], align: frozenset[str]) -> list[type[Effect]]:
    """Return the kinds of effect that may be a cause, in the order of their stages."""
    kinds = [
        kind
        for kind in REGISTRY.values()
        if kind.cause
        and not kind.dated
        and kind.name not in exclude
        and kind.fitted_with not in align
    ]
    return sorted(kinds, key=lambda kind: (kind.stage, kind.name))


def build(problem: Problem, model: Model, scale: Scale, exclude: Sequence[str] = ()) -> Library:
    """
    Return the library at a model: one set of columns that all hypotheses share.

    Parameters
    ----------
    problem : Problem
        The recordings to explain, and the frames that are fitted along.
    model : Model
        What is believed so far; everything is taken about it.
    scale : Scale
        The noise that residuals are measured in, and the weight of every sample.
    exclude : sequence of str
        Families taken out of the library.

    """
    features = problem.features(model)
    residual = problem.residuals(model)[0]
    residual[:3] *= scale.weights[0] / scale.position**2
    residual[3:] *= scale.weights[0] / scale.orientation**2
    blocks = [problem.whitened(problem.frame_columns(features)[0], scale)]
    for effect in model.found:
        parts = problem.effect_columns(features, effect, atoms=False)
        blocks.append(problem.whitened(parts, scale))
    making = _Making(problem, features, residual, scale, blocks, dict.fromkeys(exclude, EXCLUDED))
    fixed = np.arange(making.count)
    for kind in candidate_kinds(exclude, problem.align):
        for joint in joints_of(kind, model.robot.joint_names):
            making.add(kind, joint)
    for sudden in problem.dated:
        if sudden.name not in exclude:
            making.add_dated(sudden)
    columns = np.concatenate(making.blocks)
    return Library(columns, fixed, tuple(making.units), making.absent)


@dataclass(eq=False)
class _Making:
    """A library in the making: the columns so far, and the units that they belong to."""

    problem: Problem
    features: list[Features]
    pull: Array
    scale: Scale
    blocks: list[Array]
    absent: dict[str, str]
    units: list[Unit] = field(default_factory=list)
    count: int = 0

    def __post_init__(self) -> None:
        self.count = sum(block.shape[0] for block in self.blocks)

    def add(self, kind: type[Effect], joint: str | None) -> None:
        """Add a family on a joint, or tell why it is absent."""
        reason = _applicable(kind, joint, self.features)
        if reason is not None:
            self.absent[kind.name] = reason
            return
        seeds, columns = [], []
        found, trials = self.features[0].seeds(kind, joint, self.pull)
        for seed in found:
            if hardly_moves(self.features, seed):
                self.absent[kind.name] = f'{REASON} ({joint})'
                continue
            own = self._columns(seed)
            if own is not None:
                seeds.append(seed)
                columns.append(own)
        if seeds:
            self.units.append(Unit(kind.name, joint, tuple(seeds), tuple(columns), trials))

    def add_dated(self, sudden: Effect) -> None:
        """Add what gave way at an instant that the data checks found."""
        own = self._columns(sudden)
        if own is not None:
            instants = float(sum(self.problem.samples))
            self.units.append(Unit(sudden.name, sudden.site, (sudden,), (own,), instants))

    def _columns(self, seed: Effect) -> Index | None:
        """Return the numbers of a seed's columns, now added, or None if the data hide it."""
        block = _columns(self.problem, self.features, seed, self.scale)
        if block is None:
            return None
        own = self.count + np.arange(block.shape[0])
        self.count += block.shape[0]
        self.blocks.append(block)
        return own


def _applicable(kind: type[Effect], joint: str | None, features: list[Features]) -> str | None:
    reasons = [kind.applicable(maker.view, joint) for maker in features]
    return None if None in reasons else reasons[0]


def _columns(
    problem: Problem, features: list[Features], seed: Effect, scale: Scale
) -> Array | None:
    """Return a seed's whitened columns, or None when the data do not show it."""
    parts = problem.effect_columns(features, seed)
    block = problem.whitened(parts, scale)
    # Even a thousand times the typical effect would stay far below the noise.
    scales = seed.coordinate_scales()
    reach = 1e3 * float(scales.max()) if scales.size else 1.0
    return block if np.abs(block).max(initial=0.0) * reach > 1e-2 else None
