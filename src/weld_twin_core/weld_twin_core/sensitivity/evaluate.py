# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""From draws of the tolerances to what the runs come to, exactly or by the expansion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Array, readonly
from ..errors import ModelError
from .expansion import CHUNK, Expansion, expand, expandable
from .seam_study import Outcomes, Study, joined, outcomes
from .tolerance import Tolerance, with_draws

_CHECKED = 32
"""Runs on which the expansion is compared with the exact twin."""
_AGREED = 1e-3
"""Difference, relative to the largest deviation of a run, at which the expansion is not used."""


@dataclass(frozen=True, eq=False)
class Model:
    """A study as a function of draws; see `model`."""

    study: Study
    tolerances: tuple[Tolerance, ...]
    expansion: Expansion | None
    """None where every run is exact."""
    error: float
    """Largest difference of a deviation to the exact twin, relative to the largest deviation of
    its run, over the runs compared; 0 for exact runs."""

    def __call__(self, draws: Array) -> Outcomes:
        """Return what runs come to, draws shape (D, P)."""
        wanted = readonly(draws, (None, len(self.tolerances)), 'draws of the tolerances')
        if self.expansion is not None:
            return self.expansion.outcomes(wanted)
        rows = max(1, CHUNK // self.study.samples)
        parts = []
        for start in range(0, len(wanted), rows):
            off = exact_deviations(self.study, self.tolerances, wanted[start : start + rows])
            parts.append(outcomes(np.moveaxis(off, -1, 0), self.study.length))
        return joined(parts)

    def at_probabilities(self, unit: Array) -> Outcomes:
        """Return what runs come to at probabilities of every tolerance, shape (D, P)."""
        return self(draws_at(self.tolerances, unit))


def model(
    study: Study, tolerances: Sequence[Tolerance], *, exact: bool = False, seed: int = 0
) -> Model:
    """
    Return the fastest model of a study that agrees with the exact twin.

    Parameters
    ----------
    study : Study
    tolerances : sequence of Tolerance
    exact : bool
        Run every draw exactly.
    seed : int
        Chooses the runs on which the expansion is compared.

    Raises
    ------
    ModelError
        There are no tolerances.

    """
    if not tolerances:
        raise ModelError('a study needs at least one tolerance')
    if not exact and expandable(tolerances):
        expansion = expand(study, tolerances)
        error = _disagreement(expansion, np.random.default_rng(seed))
        if error <= _AGREED:
            return Model(study, tuple(tolerances), expansion, error)
    return Model(study, tuple(tolerances), None, 0.0)


def draws_at(tolerances: Sequence[Tolerance], unit: Array) -> Array:
    """
    Return draws at probabilities of every tolerance, shape (D, P), each in its own unit.

    Parameters
    ----------
    tolerances : sequence of Tolerance, length P
    unit : array, shape (D, P)
        Probabilities between 0 and 1.

    """
    columns = [t.distribution.values(unit[:, k]) for k, t in enumerate(tolerances)]
    return np.stack(columns, axis=1)


def exact_deviations(study: Study, tolerances: Sequence[Tolerance], draws: Array) -> Array:
    """Return the exact twin's deviations in seam axes, (D, N, 3) [m], of draws (D, P) in their units."""
    return study.deviations(with_draws(study.known, tolerances, draws))


def _disagreement(expansion: Expansion, rng: np.random.Generator) -> float:
    study, tolerances = expansion.study, expansion.tolerances
    draws = draws_at(tolerances, rng.random((_CHECKED, len(tolerances))))
    exact = np.moveaxis(exact_deviations(study, tolerances, draws), -1, 0)
    off = np.abs(expansion.deviations(draws) - exact).max(axis=(0, 2))
    size = np.abs(exact).max(axis=(0, 2))
    return float((off / np.where(size > 0.0, size, 1.0)).max())


Function = Callable[[Array], Array]
"""A model as a study sees it: probabilities (D, P) in, one number per run (D,) out."""
