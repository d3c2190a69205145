# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Points that fill a box evenly."""

from __future__ import annotations

import numpy as np

from .arrays import Array

_PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71)
"""One base for every dimension; more joints than these no arm has."""


def halton(dimensions: int, count: int) -> Array:
    """
    Return Halton's points [1]_ without the first, which is the origin, shape (count, dimensions).

    References
    ----------
    .. [1] J. H. Halton, "On the efficiency of certain quasi-random sequences of points in evaluating
       multi-dimensional integrals", Numerische Mathematik 2, 1960.

    """
    out = np.zeros((count, dimensions))
    for k, base in enumerate(_PRIMES[:dimensions]):
        rest, weight = np.arange(1, count + 1), 1.0 / base
        while rest.any():
            rest, digit = np.divmod(rest, base)
            out[:, k] += digit * weight
            weight /= base
    return out
