# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Factors and inverses of large positive definite matrices, in the place of the matrix.

A copy of a matrix of more than a thousand columns takes as long as a good part of its factor. At unit
scale, as radians and metres in one matrix differ by orders of magnitude.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError
from scipy.linalg.blas import dsymm, dsymv
from scipy.linalg.lapack import dpocon, dpotrf, dpotri, dpotrs, dtrtri

from ...arrays import Array

SAFE = 100.0
"""The condition is an estimate, good to some factor: so much is left between."""
STRIP = 64
"""Rows of a triangle worked on at once: what a strip holds beyond it is a few per cent."""
Index = NDArray[np.intp]

FLAT = 1e-9
"""A column whose norm falls below this share once others are projected out carries nothing new."""
EMPTY = 1e-300
"""Least squared norm of a column; keeps a column of zeros from a division by zero."""


def inverted(matrix: Array) -> Array:
    """
    Return the inverse of a symmetric matrix, which is overwritten, shape (P, P).

    Raises
    ------
    LinAlgError
        The matrix is not positive definite.

    """
    # A symmetric matrix is its own transpose, and that lies as LAPACK wants it.
    factor, failed = dpotrf(matrix.T, lower=1, clean=0, overwrite_a=1)
    if failed:
        raise LinAlgError('the matrix is not positive definite')
    upper = dpotri(factor, lower=1, overwrite_c=1)[0].T
    for start in range(0, len(upper), STRIP):
        here = slice(start, start + STRIP)
        corner = np.triu(upper[here, here])
        upper[here, here] = corner + np.triu(corner, 1).T
        upper[start + STRIP :, here] = upper[here, start + STRIP :].T
    return np.asarray(upper)


@dataclass(frozen=True, eq=False)
class Triangle:
    """
    A symmetric matrix, kept as one triangle.

    Attributes
    ----------
    square : array, shape (P, P)
        In Fortran order; its other triangle may hold anything.
    lower : bool
        Which triangle counts.
    unit : array, shape (P,)
        What rows and columns are multiplied by.

    """

    square: Array
    lower: bool
    unit: Array

    def times(self, right: Array) -> Array:
        """Return the product with a vector, shape (P,), or with several, shape (P, R)."""
        if right.ndim == 1:
            return np.asarray(
                self.unit * dsymv(1.0, self.square, self.unit * right, lower=self.lower)
            )
        unit = self.unit[:, None]
        return np.asarray(unit * dsymm(1.0, self.square, unit * right, lower=self.lower))

    def among(self, index: Index) -> Array:
        """Return the rows and columns of some numbers, ascending, shape (n, n)."""
        part = self.square[np.ix_(index, index)]
        half = np.tril(part, -1) if self.lower else np.triu(part, 1)
        whole = half + half.T
        whole[np.diag_indices_from(whole)] = np.diag(part)
        return np.asarray(whole * np.outer(self.unit[index], self.unit[index]))


def inverses(scaled: Iterable[tuple[Array, Array]]) -> list[Triangle]:
    """
    Return the inverses of symmetric matrices of one size, two in the room of one.

    Parameters
    ----------
    scaled : iterable of (array (P, P), array (P,))
        Each matrix, and what rows and columns of its inverse are multiplied by.

    Raises
    ------
    LinAlgError
        A matrix is not positive definite.

    """
    out: list[Triangle] = []
    for matrix, unit in scaled:
        lower, count = len(out) % 2 == 0, len(matrix)
        if lower:
            room = np.empty((count, count + 1), order='F')
        square = room[:, :count] if lower else room[:, 1:]
        _put(square, matrix, lower=lower)
        factor, failed = dpotrf(square, lower=lower, clean=0, overwrite_a=1)
        if failed:
            raise LinAlgError('the matrix is not positive definite')
        out.append(Triangle(dpotri(factor, lower=lower, overwrite_c=1)[0], lower, unit))
    return out


def _put(square: Array, matrix: Array, *, lower: bool) -> None:
    """Write one triangle of a symmetric matrix into a square, and leave the other as it is."""
    for start in range(0, len(matrix), STRIP):
        here, beyond = slice(start, start + STRIP), slice(start + STRIP, None)
        corner = matrix[here, here]
        own = np.tri(len(corner), dtype=bool)
        np.copyto(square[here, here], corner, where=own if lower else own.T)
        if lower:
            square[beyond, here] = matrix[beyond, here]
        else:
            square[here, beyond] = matrix[here, beyond]


def factored(matrix: Array) -> Callable[[Array], Array]:
    """
    Return what solves for one right-hand side, shape (P,), or several, shape (P, R).

    Parameters
    ----------
    matrix : array, shape (P, P)
        Symmetric, in C order; overwritten.

    Raises
    ------
    LinAlgError
        The matrix is not positive definite.

    """
    if not matrix.size:
        return np.array
    factor, failed = dpotrf(matrix.T, lower=1, clean=0, overwrite_a=1)
    if failed:
        raise LinAlgError('the matrix is not positive definite')

    def solve(right: Array) -> Array:
        return np.asarray(dpotrs(factor, right, lower=1)[0])

    return solve


def well_conditioned(matrix: Array, least: float) -> bool:
    """
    Return whether the least eigenvalue is above a share of the largest for certain.

    Parameters
    ----------
    matrix : array, shape (P, P)
        Symmetric.

    """
    factor, failed = dpotrf(matrix.T, lower=1, clean=0)
    if failed:
        return False
    share, _ = dpocon(factor, np.abs(matrix).sum(axis=0).max(initial=0.0), uplo='L')
    return bool(share > SAFE * least)


def solved(matrix: Array, right: Array) -> tuple[Array, Array] | None:
    """
    Return the solution and the diagonal of the inverse, shapes (P,); None if not definite.

    Parameters
    ----------
    matrix : array, shape (P, P)
        Symmetric, in C order; overwritten.
    right : array, shape (P,)

    """
    factor, failed = dpotrf(matrix.T, lower=1, clean=1, overwrite_a=1)
    if failed:
        return None
    solution, _ = dpotrs(factor, right, lower=1)
    inverse, _ = dtrtri(factor, lower=1, overwrite_c=1)
    upper = inverse.T  # rows that lie together
    return solution, np.einsum('ik,ik->i', upper, upper)


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
