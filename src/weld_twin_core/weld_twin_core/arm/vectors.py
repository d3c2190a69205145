# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Vectors kept components first, shape (3, ...), so that operations run over contiguous data."""

import numpy as np

from ..arrays import Array


def components(vector: Array) -> Array:
    """Return vectors (..., 3) with their components first, shape (3, ...)."""
    first: Array = vector.transpose(-1, *range(vector.ndim - 1))
    return first


def samples_first(vector: Array) -> Array:
    """Return vectors (3, ...) with their samples first, shape (..., 3)."""
    last: Array = vector.transpose(*range(1, vector.ndim), 0)
    return last


def pad(vector: Array, axes: int) -> Array:
    """Return components-first vectors with at least ``axes`` sample axes, new ones in front."""
    missing = axes + 1 - vector.ndim
    if missing <= 0:
        return vector
    return vector.reshape(vector.shape[:1] + (1,) * missing + vector.shape[1:])


def cross(a: Array, b: Array) -> Array:
    """Return the cross product (numpy's own is several times slower on this layout)."""
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def dot(a: Array, b: Array) -> Array:
    """Return the scalar product, shape (...)."""
    product: Array = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return product
