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
from numpy.typing import NDArray

from ...arrays import Array
from ..algebra.definite import unit_diagonal

Given = Callable[[NDArray[np.bool_]], tuple[Array, Array]]
"""Mean and covariance of the coordinates given all rows but those of a mask."""
USUAL = 0.5
"""Standard deviation of the logarithm of a dispersion before the data: a judgement, models of real
arms are seldom off by twice what they say."""
FACTORS = np.exp(np.linspace(-2.0, 2.0, 81))
"""Dispersions that are weighed: four standard deviations to either side."""
ROUNDING = 1e-9
"""Share of the largest variance below which a direction is certain."""


def dispersion(
    columns: Array, residual: Array, noise: float, models: Sequence[Given], regions: Array
) -> float:
    """
    Return the factor by which the covariance of the coordinates is too small.

    columns, residual: whitened rows at the fitted model, shapes (P, rows) and (rows,).
    noise: variance of a direction in the space of the rows.
    models: drawn ones.
    regions: the region of posture of every row, shape (rows,).
    """
    likely = np.zeros((len(models), FACTORS.size))
    for own, given in zip(likely, models, strict=True):
        for region in np.unique(regions):
            out = regions == region
            mean, covariance = given(out)
            error = residual[out] - mean @ columns[:, out]
            off, variance = _along(error, covariance, columns[:, out])
            whole = FACTORS[:, None] * variance + noise
            own -= 0.5 * (off**2 / whole + np.log(whole)).sum(axis=1)
    weights = np.exp(likely - likely.max(axis=1, keepdims=True)).mean(axis=0)
    weights *= np.exp(-0.5 * (np.log(FACTORS) / USUAL) ** 2)
    return float(weights @ FACTORS / weights.sum())


def _along(error: Array, covariance: Array, columns: Array) -> tuple[Array, Array]:
    """Return errors of rows along the directions in which they are foretold, and their variances."""
    scaled, size = unit_diagonal(covariance, 0.0)
    values, vectors = np.linalg.eigh(scaled)
    ways = (vectors * np.sqrt(np.maximum(values, 0.0))).T @ (size[:, None] * columns)
    variance, turn = np.linalg.eigh(ways @ ways.T)
    open_ = variance > ROUNDING * max(float(variance[-1]), 1e-300)
    variance = variance[open_]
    return (turn[:, open_].T @ (ways @ error)) / np.sqrt(variance), variance
