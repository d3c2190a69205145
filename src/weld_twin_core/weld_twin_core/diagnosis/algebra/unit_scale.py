# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Normal equations at unit scale: radians and metres in one matrix differ by orders of magnitude."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array

Index = NDArray[np.intp]

FLAT = 1e-9
"""A column whose norm falls below this share once others are projected out carries nothing new."""
EMPTY = 1e-300
"""Least squared norm of a column; keeps a column of zeros from a division by zero."""


def unit_diagonal(normal: Array, damping: float = 0.0) -> tuple[Array, Array]:
    """
    Return a normal matrix with ones on its diagonal, and the norms of its columns.

    Parameters
    ----------
    normal : array, shape (P, P)
    damping : float
        Added to the diagonal of ones, so that columns that repeat others do no harm.

    Returns
    -------
    scaled : array, shape (P, P)
        ``normal / outer(size, size)``; solve it for ``right / size`` and divide by ``size``.
    size : array, shape (P,)

    """
    size = np.sqrt(np.maximum(normal.diagonal(), EMPTY))
    scaled = normal / (size[:, None] * size)
    each = np.arange(size.size)
    scaled[each, each] += damping
    return scaled, size
