# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Normal equations shared by every hypothesis.

All columns anybody may ask for are multiplied out once, per stretch of the recording. A hypothesis
is then a handful of indices: fitting it, taking it out, conditioning on it or scoring it on a
stretch it has not seen are operations on small matrices.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array

Index = NDArray[np.intp]

FLAT = 1e-9
"""A column whose norm falls below this share once others are projected out carries nothing new."""


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
            np.maximum(np.diag(normal).copy(), 1e-300),
        )

    def __sub__(self, other: Gram) -> Gram:
        """Return the normal equations without another's rows."""
        return Gram(
            self.normal - other.normal,
            self.right - other.right,
            self.rss - other.rss,
            self.rows - other.rows,
            np.maximum(self.size - other.size, 1e-300),
        )

    def live(self, index: Index) -> Index:
        """Return those of an index whose columns still carry something."""
        diagonal = self.normal[index, index]
        return index[diagonal > FLAT * self.size[index]]

    def solve(self, index: Index, precision: Array | float = 0.0) -> Array:
        """Return the least-squares coefficients of some columns, shape (len(index),)."""
        scaled, each = self.normal[index[:, None], index], np.arange(index.size)
        scaled[each, each] += precision
        size = np.sqrt(np.maximum(scaled.diagonal(), 1e-300))
        scaled /= size[:, None] * size
        scaled[each, each] += 1e-11
        return np.asarray(np.linalg.solve(scaled, self.right[index] / size) / size)

    def gain(self, index: Index) -> float:
        """Return by how much the sum of squares falls when some columns are fitted."""
        if index.size == 1:  # nearly every question of a search
            k = index[0]
            return float(self.right[k] ** 2 / max(self.normal[k, k], 1e-300))
        return float(self.right[index] @ self.solve(index)) if index.size else 0.0

    def residual_of(self, index: Index, coefficients: Array) -> float:
        """Return the sum of squares with given coefficients on some columns."""
        quadratic = coefficients @ self.normal[np.ix_(index, index)] @ coefficients
        return self.rss - 2.0 * float(self.right[index] @ coefficients) + float(quadratic)

    def without(self, index: Index, precision: Array | float = 0.0) -> Gram:
        """Return the normal equations with some columns fitted and projected out."""
        index = self.live(index)
        if index.size == 0:
            return self
        normal = self.normal[np.ix_(index, index)]
        normal = normal + np.diag(np.broadcast_to(precision, index.shape))
        size = np.sqrt(np.diag(normal))
        scaled = normal / np.outer(size, size)
        scaled[np.diag_indices_from(scaled)] += 1e-12
        cross = self.normal[index] / size[:, None]
        solved = np.linalg.solve(scaled, np.column_stack([cross, self.right[index] / size]))
        left = self.normal - cross.T @ solved[:, :-1]
        right = self.right - cross.T @ solved[:, -1]
        rss = self.rss - float(self.right[index] / size @ solved[:, -1])
        left[index, :] = 0.0
        left[:, index] = 0.0
        right[index] = 0.0
        return replace(self, normal=left, right=right, rss=max(rss, 1e-300))


def by_block(columns: Array, residual: Array, labels: Array) -> tuple[Gram, list[Gram]]:
    """
    Return the normal equations of all rows and of every block.

    Parameters
    ----------
    columns : array, shape (P, rows);  residual : array, shape (rows,)
    labels : array of int, shape (rows,)
        Non-decreasing block number of every row.

    """
    blocks = []
    for label in range(int(labels[-1]) + 1):
        low, high = np.searchsorted(labels, [label, label + 1])
        blocks.append(Gram.of(columns[:, low:high], residual[low:high]))
    total = blocks[0]
    for block in blocks[1:]:
        total = Gram(
            total.normal + block.normal,
            total.right + block.right,
            total.rss + block.rss,
            total.rows + block.rows,
            total.size + block.size,
        )
    return total, blocks
