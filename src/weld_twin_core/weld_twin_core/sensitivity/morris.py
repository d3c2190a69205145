# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Morris screening: which of many errors matter at all, in a few runs for each.

References
----------
.. [1] M. D. Morris, "Factorial sampling plans for preliminary computational experiments",
   Technometrics 33(2), 1991.
.. [2] F. Campolongo, J. Cariboni, A. Saltelli, "An effective screening design for sensitivity
   analysis of large models", Environmental Modelling & Software 22, 2007: mu star.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Array
from ..errors import DataError
from .evaluate import Function
from .outcome import refuse_unfinite
from .salib import salib

LEVELS = 8
"""Levels of the grid of each input; even, as the method wants, so that all are visited alike."""
MARGIN = 0.02
"""Probability left out at either end, where a normal distribution is infinitely far out."""


@dataclass(frozen=True, eq=False)
class Screening:
    """
    Elementary effects of P inputs over the range of their tolerance.

    Attributes
    ----------
    names : tuple of str, length P
    mu_star, mu_star_half, sigma : array, shape (P,)
        Mean size of the effect with the half-width of its 95 % interval, and its scatter; in the
        unit of the result.
    trajectories, runs, seed : int

    """

    names: tuple[str, ...]
    mu_star: Array
    mu_star_half: Array
    sigma: Array
    trajectories: int
    runs: int
    seed: int

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers and lists."""
        rows = [
            {
                'name': name,
                'mu_star': float(self.mu_star[k]),
                'mu_star_half': float(self.mu_star_half[k]),
                'sigma': float(self.sigma[k]),
            }
            for k, name in enumerate(self.names)
        ]
        return {
            'trajectories': self.trajectories,
            'runs': self.runs,
            'seed': self.seed,
            'indices': rows,
        }


@dataclass(frozen=True)
class MorrisDesign:
    """
    Which runs Morris screening needs.

    Attributes
    ----------
    names : tuple of str, length P
    trajectories : int
        Every one costs P + 1 runs.
    seed : int

    """

    names: tuple[str, ...]
    trajectories: int = 50
    seed: int = 0

    def __post_init__(self) -> None:
        if self.trajectories < 2:
            raise DataError(
                f'Morris screening needs at least 2 trajectories, got {self.trajectories}'
            )
        if self.seed < 0:
            raise DataError(f'a seed must not be negative, got {self.seed}')

    def _problem(self) -> dict[str, Any]:
        bounds = [[MARGIN, 1.0 - MARGIN]] * len(self.names)
        return {'num_vars': len(self.names), 'names': list(self.names), 'bounds': bounds}

    def samples(self) -> Array:
        """Return probabilities of every input, shape (trajectories (P + 1), P)."""
        values: Array = salib('sample.morris').sample(
            self._problem(),
            self.trajectories,
            num_levels=LEVELS,
            seed=np.random.default_rng([self.seed, 0]),
        )
        return values

    def screening(self, results: Array) -> Screening:
        """
        Return the measures of model results in the order of `samples`.

        Raises
        ------
        DataError
            A result is not a number.

        """
        values = np.asarray(results, dtype=np.float64)
        refuse_unfinite(values, 'Morris screening')
        found = salib('analyze.morris').analyze(
            self._problem(),
            self.samples(),
            values,
            num_levels=LEVELS,
            seed=np.random.default_rng([self.seed, 1]),
        )
        mean, half, scatter = (
            np.asarray(found[key], dtype=np.float64)
            for key in ('mu_star', 'mu_star_conf', 'sigma')
        )
        return Screening(
            self.names, mean, half, scatter, self.trajectories, values.size, self.seed
        )


def morris_screening(
    function: Function, names: Sequence[str], trajectories: int = 50, *, seed: int = 0
) -> Screening:
    """
    Return the Morris measures of a function of independent inputs.

    Parameters
    ----------
    function : callable
        Probabilities of every input, shape (D, P), to results, shape (D,).
    names, trajectories, seed
        See `MorrisDesign`.

    Raises
    ------
    DataError
        A result is not a number, or fewer than two trajectories.

    """
    design = MorrisDesign(tuple(names), trajectories, seed)
    return design.screening(function(design.samples()))
