# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Normal equations shared by every hypothesis.

All columns anybody may ask for are multiplied out once. A hypothesis
is then a handful of indices: fitting it, taking it out or conditioning on it are
operations on small matrices.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array

Index = NDArray[np.intp]

FLAT = 1e-9
"""A column whose norm falls below this share once others are projected out carries nothing new."""
EMPTY = 1e-300
"""Least squared norm of a column; keeps a column of zeros from a division by zero."""


@dataclass(frozen=True, eq=False)
class Gram:
    """
    Normal equations of columns A (P, rows) and residual y (rows,).

    Attributes
    ----------
    normal : array, shape (P, P);  right : array, shape (P,);  rss : float
    rows : int
    size : array, shape (P,)
        Squared norm of every column before anything was projected out.

    """

    normal: Array
    right: Array
    rss: float
    rows: int
    size: Array

    @classmethod
    def of(cls, columns: Array, residual: Array) -> Gram:
        """Return the normal equations of columns, shape (P, rows), and residual, shape (rows,)."""
        normal = columns @ columns.T
        return cls(
            normal,
            columns @ residual,
            float(residual @ residual),
            residual.size,
            np.maximum(np.diag(normal).copy(), EMPTY),
        )

    def live(self, index: Index) -> Index:
        """Return those of an index whose columns still carry something."""
        diagonal = self.normal[index, index]
        return index[diagonal > FLAT * self.size[index]]

    def solve(self, index: Index, precision: Array | float = 0.0) -> Array:
        """Return the least-squares coefficients of some columns, shape (len(index),)."""
        normal, each = self.normal[index[:, None], index], np.arange(index.size)
        normal[each, each] += precision
        scaled, size = unit_diagonal(normal, 1e-11)
        return np.asarray(np.linalg.solve(scaled, self.right[index] / size) / size)

    def gain(self, index: Index) -> float:
        """Return by how much the sum of squares falls when some columns are fitted."""
        if index.size == 1:  # nearly every question of a search
            k = index[0]
            return float(self.right[k] ** 2 / max(self.normal[k, k], EMPTY))
        return float(self.right[index] @ self.solve(index)) if index.size else 0.0

    def without(self, index: Index, precision: Array | float = 0.0) -> Gram:
        """Return the normal equations with some columns fitted and projected out."""
        index = self.live(index)
        if index.size == 0:
            return self
        normal = self.normal[np.ix_(index, index)]
        normal = normal + np.diag(np.broadcast_to(precision, index.shape))
        scaled, size = unit_diagonal(normal, 1e-12)
        cross = self.normal[index] / size[:, None]
        solved = np.linalg.solve(scaled, np.column_stack([cross, self.right[index] / size]))
        left = self.normal - cross.T @ solved[:, :-1]
        right = self.right - cross.T @ solved[:, -1]
        rss = self.rss - float(self.right[index] / size @ solved[:, -1])
        left[index, :] = 0.0
        left[:, index] = 0.0
        right[index] = 0.0
        return replace(self, normal=left, right=right, rss=max(rss, EMPTY))


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
