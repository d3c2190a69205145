# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Factors and inverses of large positive definite matrices, in the place of the matrix.

A copy of a matrix of more than a thousand columns takes as long as a good part of its factor. At unit
scale, as radians and metres in one matrix differ by orders of magnitude. Spans tell what of an error
others can do as well: on the data a tie, on postures all over the range what no motion can part.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError
from scipy.linalg.lapack import dpocon, dpotrf, dpotri, dpotrs, dtrtri

from ...arrays import Array
from ..negligible import EMPTY, FLAT

SAFE = 100.0
"""The condition is an estimate, good to some factor: so much is left between."""
Index = NDArray[np.intp]


def inverted(matrix: Array) -> Array:
    """Return the inverse of a matrix, as of `root_of`, which is overwritten; else LinAlgError."""
    return inverse_of(root_of(matrix))


def inverse_of(root: Array) -> Array:
    """Return the inverse (P, P) of a matrix by its root, as of `root_of`, which is overwritten."""
    lower = dpotri(root, lower=1, overwrite_c=1)[0]
    out: Array = lower + lower.T  # above its diagonal the root is empty
    diagonal = np.einsum('ii->i', out)
    diagonal /= 2.0
    return out


def root_of(matrix: Array, *, clean: bool = True) -> Array:
    """Return L of a matrix L L' in C order, in its place; LinAlgError if it is not definite."""
    # A symmetric matrix is its own transpose, and that lies as LAPACK wants it.
    factor, failed = dpotrf(matrix.T, lower=1, clean=clean, overwrite_a=1)
    if failed:
        raise LinAlgError('the matrix is not positive definite')
    return np.asarray(factor)


def factored(matrix: Array) -> Callable[[Array], Array]:
    """Return what solves for (P,) or (P, R) by a matrix, overwritten; LinAlgError if not definite."""
    if not matrix.size:
        return np.array
    factor = root_of(matrix, clean=False)

    def solve(right: Array) -> Array:
        return np.asarray(dpotrs(factor, right, lower=1)[0])

    return solve


def well_conditioned(matrix: Array, least: float) -> bool:
    """Return whether the least eigenvalue is above a share of the largest for certain."""
    factor, failed = dpotrf(matrix.T, lower=1, clean=0)
    if failed:
        return False
    share, _ = dpocon(factor, np.abs(matrix).sum(axis=0).max(initial=0.0), uplo='L')
    return bool(share > SAFE * least)


def solved(matrix: Array, right: Array) -> tuple[Array, Array]:
    """Return solution and diagonal of the inverse, (P,); overwrites as `root_of` does."""
    factor = root_of(matrix)
    solution, _ = dpotrs(factor, right, lower=1)
    upper = dtrtri(factor, lower=1, overwrite_c=1)[0].T  # rows that lie together
    return solution, np.einsum('ik,ik->i', upper, upper)


def unit_diagonal(normal: Array, damping: float = 0.0) -> tuple[Array, Array]:
    """
    Return a normal matrix with ones, and damping, on its diagonal, and the norms of its columns.

    Solve ``normal / outer(size, size)`` for ``right / size`` and divide by ``size``.
    """
    size = np.sqrt(np.maximum(normal.diagonal(), EMPTY))
    scaled = normal / (size[:, None] * size)
    each = np.arange(size.size)
    scaled[each, each] += damping
    return scaled, size


def span_of(columns: Array) -> Array:
    """Return orthonormal rows that span columns (P, rows), of any size, which may repeat each other."""
    size = np.linalg.norm(columns, axis=1)
    shown = columns[size > 0.0] / size[size > 0.0, None]
    if not shown.size:
        return np.zeros((0, columns.shape[1]))
    _, strength, span = np.linalg.svd(shown, full_matrices=False)
    return np.asarray(span[strength > FLAT * strength[0]])


def outside(columns: Array, span: Array) -> Array:
    """Return columns, (K, rows), without what a span, as `span_of` gives it, holds of them."""
    return np.asarray(columns - (columns @ span.T) @ span)


def share_outside(columns: Array, span: Array) -> Array:
    """Return the share of each column, shape (K,), that a span does not hold; 0 of one that is zero."""
    remaining = np.linalg.norm(outside(columns, span), axis=1)
    return np.asarray(remaining / np.maximum(np.linalg.norm(columns, axis=1), EMPTY))
