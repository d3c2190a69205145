# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Many regressions on the same candidates at once, one for every half of the data.

Every candidate is a few columns. A sweep [1]_ takes one in, and the same sweep backwards takes it
out again; what each would add, or take with it, is read off the swept matrix.

References
----------
.. [1] J. H. Goodnight, "A tutorial on the SWEEP operator", The American Statistician 33, 1979.

"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ..algebra.gram import Index

SINGULAR = 1e-9
"""Added to the diagonal of ones: a column that others repeat to this share carries nothing new."""

REPEATED = 3.0 * SINGULAR
"""
Part of a column's square left beside those taken from which it is worth anything.

What others repeat has left what was added, and swept in it would make rounding of the rest.
"""

Mask = NDArray[np.bool_]


class Tableau:
    """
    Regressions swept in place.

    Parameters
    ----------
    normal : array, shape (H, P + 1, P + 1)
        Products of all columns with each other, and last with what is to be explained.
    parts : sequence of slice
        Columns of every candidate.
    size : array, shape (H, P + 1)
        Norm of every column before frames were fitted along: what they take of it whole is nothing
        to tell by.

    """

    def __init__(self, normal: Array, parts: Sequence[slice], size: Array) -> None:
        self.table: Array = normal / (size[:, :, None] * size[:, None])
        inner = np.arange(normal.shape[1] - 1)
        self.table[:, inner, inner] += SINGULAR
        self.parts = tuple(parts)
        self.taken: Mask = np.zeros((normal.shape[0], len(self.parts)), bool)

    @property
    def rss(self) -> Array:
        """Return the sums of squares left, shape (H,)."""
        return np.maximum(self.table[:, -1, -1], 1e-300)

    def worth(self) -> Array:
        """
        Return what every candidate takes off, or would leave if it went, shape (H, U).

        One whose columns those taken repeat takes nothing off: what is left of them is rounding.
        """
        out = [
            quadratic(self.table[:, s, s], self.table[:, s, -1], self.taken[:, u])
            for u, s in enumerate(self.parts)
        ]
        return np.stack(out, axis=1)

    def sweep(self, rows: Index, which: int) -> None:
        """
        Take a candidate in, or out again.

        Parameters
        ----------
        rows : array of int
            In which regressions; all of them have it, or none has.
        which : int
            The candidate.

        """
        if not rows.size:
            return
        part, sign = self.parts[which], -1.0 if self.taken[rows[0], which] else 1.0
        own = self.table[rows]
        inverse = np.linalg.inv(own[:, part, part])
        across = inverse @ own[:, part]
        own -= np.swapaxes(own[:, part], 1, 2) @ across
        own[:, part] = sign * across
        own[:, :, part] = sign * np.swapaxes(across, 1, 2)
        own[:, part, part] = -inverse
        self.table[rows] = own
        self.taken[rows, which] = sign > 0.0


def quadratic(square: Array, pull: Array, taken: Mask) -> Array:
    """
    Return the size of b' A^-1 b for many small systems, shape (H,); 0 where A is no more.

    Parameters
    ----------
    square : array, shape (H, K, K)
        A.
    pull : array, shape (H, K)
        b.
    taken : array of bool, shape (H,)
        Where A was swept in, so that it stays what it is.

    """
    if pull.shape[1] == 1:
        left = taken | (square[:, 0, 0] > REPEATED)
        size = np.abs(pull[:, 0] ** 2 / np.where(left, square[:, 0, 0], 1.0))
        return np.asarray(np.where(left, size, 0.0))
    left = taken | (np.linalg.eigvalsh(square)[:, 0] > REPEATED)
    safe = np.where(left[:, None, None], square, np.eye(pull.shape[1]))
    size = np.abs((pull * np.linalg.solve(safe, pull[..., None])[..., 0]).sum(axis=1))
    return np.asarray(np.where(left, size, 0.0))
