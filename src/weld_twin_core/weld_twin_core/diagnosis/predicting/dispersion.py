# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How much farther off models are on a part of a motion that they were not conditioned on than they say.

Rows count as if the model were right but for white noise. What an arm does besides (springs that swing,
gears that no wave describes) hangs together in time, and so many coordinates follow most of it: it
shows little in what they leave, and moves them by more than their covariance has it. It shows where
each region of posture is predicted from the others, as what moved the coordinates in one region is
elsewhere in another. Their covariance is then too small by a factor, the dispersion of generalised
linear models [1]_.

References
----------
.. [1] P. McCullagh, J. A. Nelder, "Generalized Linear Models", 1989, section 9.2.

"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ...arrays import Array
from ..algebra.definite import EMPTY, FLAT
from .sizes import Products

Rooted = Callable[[Products], tuple[Array, Array]]
"""Mean of the coordinates given all rows but those of a part, and a root S of their covariance S S'."""
USUAL = 0.5
"""Standard deviation of the logarithm of a dispersion before the data: a judgement, models of real
arms are seldom off by twice what they say."""
FACTORS = np.exp(np.linspace(-2.0, 2.0, 81))
"""Dispersions that are weighed: four standard deviations to either side."""


def dispersion(parts: Sequence[Products], noise: float, models: Sequence[Rooted]) -> float:
    """
    Return the factor by which the covariance of the coordinates is too small.

    parts: whitened rows of every region of posture, at the fitted model.
    noise: variance of a direction in the space of the rows.
    models: drawn ones.
    """
    likely = np.zeros((len(models), FACTORS.size))
    for own, rooted in zip(likely, models, strict=True):
        for part in parts:
            off, variance = _along(part, *rooted(part))
            whole = FACTORS[:, None] * variance + noise
            own -= (off**2 / whole + np.log(whole)).sum(axis=1) / 2.0
    weights = np.exp(likely - likely.max(axis=1, keepdims=True)).mean(axis=0)
    weights *= np.exp(-((np.log(FACTORS) / USUAL) ** 2) / 2.0)
    return float(weights @ FACTORS / weights.sum())


def _along(part: Products, mean: Array, root: Array) -> tuple[Array, Array]:
    """Return errors of rows along the directions in which they are foretold, and their variances."""
    error = root.T @ (part.residual - part.columns @ mean)
    variance, turn = np.linalg.eigh(root.T @ part.columns @ root)
    open_ = variance > FLAT * max(float(variance[-1]), EMPTY)
    variance = variance[open_]
    return (turn[:, open_].T @ error) / np.sqrt(variance), variance
