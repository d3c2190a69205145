# SPDX-FileCopyrightText: weld_twin contributors
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

LEVELS = 8
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
                'name': name, 'mu_star': float(self.mu_star[k]),
                'mu_star_half': float(self.mu_star_half[k]), 'sigma': float(self.sigma[k]),
            }
            for k, name in enumerate(self.names)
        ]  # fmt: skip
        return {
            'trajectories': self.trajectories, 'runs': self.runs, 'seed': self.seed,
            'indices': rows,
        }  # fmt: skip


def morris_screening(
    function: Function, names: Sequence[str], trajectories: int = 50, *, seed: int = 0
) -> Screening:
    """
    Return the Morris measures of a function of independent inputs.

    Parameters
    ----------
    function : callable
        Probabilities of every input, shape (D, P), to results, shape (D,).
    names : sequence of str
    trajectories : int
        Every one costs P + 1 runs.
    seed : int

    Raises
    ------
    DataError
        A result is not a number, or fewer than two trajectories.

    """
    from SALib.analyze import morris as analysis  # noqa: PLC0415 - SALib brings pandas along
    from SALib.sample import morris as sampling  # noqa: PLC0415

    if trajectories < 2:
        raise DataError(f'Morris screening needs at least 2 trajectories, got {trajectories}')
    bounds = [[MARGIN, 1.0 - MARGIN]] * len(names)
    problem = {'num_vars': len(names), 'names': list(names), 'bounds': bounds}
    samples = sampling.sample(
        problem, trajectories, num_levels=LEVELS, seed=np.random.default_rng([seed, 0])
    )
    results = np.asarray(function(samples), dtype=np.float64)
    refuse_unfinite(results, 'Morris screening')
    found = analysis.analyze(
        problem, samples, results, num_levels=LEVELS, seed=np.random.default_rng([seed, 1])
    )
    measures = (np.asarray(found[k], dtype=np.float64) for k in ('mu_star', 'mu_star_conf', 'sigma'))
    return Screening(tuple(names), *measures, trajectories, len(samples), seed)
