# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The library of hypotheses: every family on every joint it can sit on, as columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect
from ...effects.registry import REGISTRY
from ...twin.features import Features, joints_of
from ..algebra.gram import Index
from ..algebra.problem import Model, Problem, Scale
from .still_joints import REASON, hardly_moves


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
    count = sum(block.shape[0] for block in blocks)
    fixed = np.arange(count)
    units: list[Unit] = []
    absent = dict.fromkeys(exclude, 'excluded by the user')
    for kind in candidate_kinds(exclude, problem.align):
        for joint in joints_of(kind, model.robot.joint_names):
            reason = _applicable(kind, joint, features)
            if reason is not None:
                absent[kind.name] = reason
                continue
            seeds, columns = [], []
            found, trials = features[0].seeds(kind, joint, residual)
            for seed in found:
                if hardly_moves(features, seed):
                    absent[kind.name] = f'{REASON} ({joint})'
                    continue
                block = _columns(problem, features, seed, scale)
                if block is None:
                    continue
                seeds.append(seed)
                columns.append(np.arange(count, count + block.shape[0]))
                count += block.shape[0]
                blocks.append(block)
            if seeds:
                units.append(Unit(kind.name, joint, tuple(seeds), tuple(columns), trials))
    for sudden in problem.dated:
        block = None if sudden.name in exclude else _columns(problem, features, sudden, scale)
        if block is not None:
            own = np.arange(count, count + block.shape[0])
            count += block.shape[0]
            blocks.append(block)
            instants = float(sum(problem.samples))
            units.append(Unit(sudden.name, sudden.site, (sudden,), (own,), instants))
    return Library(np.concatenate(blocks), fixed, tuple(units), absent)


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
