# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which seed and columns serve every unit best beside a model, most evidence first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ...effects.effect import Effect
from ..algebra.gram import Index, unit_diagonal
from .library import Unit
from .seed_systems import SINGULAR, Alike, SeedSystems


@dataclass(frozen=True, eq=False)
class Choice:
    """
    A unit with the seed and columns that serve it best.

    Attributes
    ----------
    unit : Unit
    seed : int
    columns : array of int
        Of the seed, those that earn their place.
    nats : float
        Log of the evidence ratio against leaving the unit out (Schwarz's approximation).
    coefficients : array, shape (K,)
        Of all the seed's columns, zero for those left out.

    """

    unit: Unit
    seed: int
    columns: Index
    nats: float
    coefficients: Array

    def effect(self) -> Effect:
        """Return the effect that the linear coefficients stand for."""
        return self.unit.seeds[self.seed].from_atoms(self.coefficients)


def ranking(systems: SeedSystems, units: Sequence[Unit], effective: float) -> list[Choice]:
    """
    Return every unit's best choice, most evidence first.

    Parameters
    ----------
    systems : SeedSystems
        Normal equations of all seeds, with the model projected out.
    units : sequence of Unit
        What may enter, each as a whole.
    effective : float
        Number of independent rows.

    """
    nats = np.full(sum(len(unit.seeds) for unit in units), -np.inf)
    where: dict[int, tuple[Alike, int, Index]] = {}
    for alike, grown in zip(systems.alike, systems.grown(effective), strict=True):
        nats[alike.seeds] = grown.nats
        where.update(
            (int(s), (alike, k, np.flatnonzero(grown.chosen[k])))
            for k, s in enumerate(alike.seeds)
        )
    found, at = [], 0
    for unit in units:
        best = at + int(np.argmax(nats[at : at + len(unit.seeds)]))
        if np.isfinite(nats[best]):
            worth = float(nats[best] - np.log(unit.trials))
            found.append(_choice(unit, best - at, worth, *where[best]))
        at += len(unit.seeds)
    return sorted(found, key=lambda choice: -choice.nats)


def _choice(unit: Unit, seed: int, nats: float, alike: Alike, k: int, chosen: Index) -> Choice:
    """Return a choice with the least-squares coefficients of its columns."""
    scaled, size = unit_diagonal(alike.normal[k][np.ix_(chosen, chosen)], SINGULAR)
    coefficients = np.zeros(alike.columns.shape[1])
    coefficients[chosen] = np.linalg.solve(scaled, alike.right[k][chosen] / size) / size
    return Choice(unit, seed, alike.columns[k][chosen], nats, coefficients)
