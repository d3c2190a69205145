# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Factors and inverses of large positive definite matrices, in the place of the matrix.

A copy of a matrix of more than a thousand columns takes as long as a good part of its factor.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import LinAlgError
from scipy.linalg.lapack import dpocon, dpotrf, dpotri, dpotrs, dtrtri

from ...arrays import Array

SAFE = 100.0
"""The condition is an estimate, good to some factor: so much is left between."""
STRIP = 64
"""Rows of a triangle worked on at once: what a strip holds beyond it is a few per cent."""


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


def well_conditioned(matrix: Array, least: float) -> bool:
    """
    Return whether the least eigenvalue is above a share of the largest for certain.

    Parameters
    ----------
    matrix : array, shape (P, P)
        Symmetric.
    least : float

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
    factor, failed = dpotrf(matrix.T, lower=1, clean=0, overwrite_a=1)
    if failed:
        return None
    solution, _ = dpotrs(factor, right, lower=1)
    inverse, _ = dtrtri(factor, lower=1, overwrite_c=1)
    return solution, _squared_rows(inverse.T)


def _squared_rows(upper: Array) -> Array:
    """Return the sum of squares of every row of an upper triangle, whatever lies below it."""
    out = np.empty(len(upper))
    for start in range(0, len(upper), STRIP):
        strip = upper[start : start + STRIP, start:]
        parts = np.triu(strip[:, :STRIP]), strip[:, STRIP:]
        out[start : start + STRIP] = sum(np.einsum('ij,ij->i', part, part) for part in parts)
    return out
