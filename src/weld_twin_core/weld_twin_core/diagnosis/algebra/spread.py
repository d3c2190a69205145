# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How sure fitted coordinates are: covariances that hold where the model is not quite the arm.

As wide as the noise makes them, or as scores do that hang together within a stretch of time or differ
between stretches [1]_, each coordinate by the larger; they hang together as their columns do.

References
----------
.. [1] H. White, "Maximum likelihood estimation of misspecified models", Econometrica 50, 1982.

"""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from .columns import Columns, rows_of
from .definite import inverted, unit_diagonal, well_conditioned

BLOCKS = 24
"""Stretches whose scores are held apart: enough to tell a variance to a third."""
SINGULAR = 1e-12
"""Share of the largest eigenvalue below which a direction is one that columns repeat."""
TINY = 1e-300
"""Keeps a division by the variance of a coordinate that nothing moves finite."""


def covariance(
    columns: Columns, ridge: Array, residual: Array, labels: Array, share: float
) -> Array:
    """
    Return the covariance of all columns' coefficients, shape (P, P).

    columns: p whitened columns.
    ridge: prior precision, shape (P,).
    residual: what the fit leaves, whitened, shape (rows,).
    labels: stretch of every row, some `BLOCKS` in all, shape (rows,).
    share: of the rows that count as independent.
    """
    inverse, size = unit_inverse(columns, ridge)
    stretches = rows_of(np.unique(labels, return_inverse=True)[1].astype(float))
    each = [columns.within(rows).times(residual[rows]) / size for rows in stretches]
    scores = inverse @ np.stack(each, axis=1)
    blocks = max(len(each), 2)
    together = (scores**2).sum(axis=1) * blocks / (blocks - 1)
    own = np.diag(inverse)
    wider = np.sqrt(np.maximum(own / share, together) / np.maximum(own, TINY)) / size
    return np.asarray(inverse * np.outer(wider, wider))


def unit_inverse(columns: Columns, ridge: Array) -> tuple[Array, Array]:
    """
    Return the inverse of the normal matrix with ones on its diagonal, and the norms of its columns.

    ridge: prior precision, shape (P,).
    """
    normal = columns.normal()
    normal[np.diag_indices_from(normal)] += ridge
    scaled, size = unit_diagonal(normal)
    if not size.size:
        return scaled, size  # LAPACK complains of a matrix of no columns.
    if well_conditioned(scaled, SINGULAR):
        return inverted(scaled), size
    return np.asarray(np.linalg.pinv(scaled, rcond=SINGULAR, hermitian=True)), size
