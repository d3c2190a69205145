# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
One turn at a time in plain numbers, as a node needs it with every message.

`weld_twin_core.arm.rotation` has the same for many; for one, calls into numpy cost thirty times what
the arithmetic does.
"""

from __future__ import annotations

from math import atan2, cos, sin, sqrt
from typing import Any

import numpy as np

from ..arm.rotation import (
    LARGE_TURN,
    SMALL_ANGLE,
    matrix_from_quaternion,
    rotation_vector,
)
from ..arrays import Array

_UNIT = (0.981, 1.019)
"""Squared lengths between which a quaternion is one of a rotation for sure."""


def quaternion_matrix(x: float, y: float, z: float, w: float, name: str) -> Array:
    """
    Return the rotation matrix, shape (3, 3), of a quaternion.

    Raises DataError: it is not finite or its length is not 1 within 1 %; ``name`` says whose it
    is.
    """
    square = x * x + y * y + z * z + w * w
    if not _UNIT[0] < square < _UNIT[1]:
        return matrix_from_quaternion([x, y, z, w], name)
    return _matrix(x, y, z, w, 2.0 / square)


def turn_matrix(turn: Array) -> Array:
    """Return the rotation matrix, shape (3, 3), of a rotation vector, shape (3,) [rad]."""
    x, y, z = turn.tolist()
    square = x * x + y * y + z * z
    if square < SMALL_ANGLE**2:
        share, w = 0.5 - square / 48.0, 1.0 - square / 8.0
    else:
        angle = sqrt(square)
        share, w = sin(0.5 * angle) / angle, cos(0.5 * angle)
    return _matrix(share * x, share * y, share * z, w, 2.0)


def turn_between(first: Array, second: Array) -> tuple[float, float, float]:
    """Return the rotation vector [rad] that turns ``second`` into ``first``, both of shape (3, 3)."""
    turned = first @ second.T
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = turned.tolist()
    cosine = 0.5 * (xx + yy + zz - 1.0)
    if cosine < LARGE_TURN:
        x, y, z = rotation_vector(turned).tolist()
        return x, y, z
    x, y, z = 0.5 * (zy - yz), 0.5 * (xz - zx), 0.5 * (yx - xy)
    length = sqrt(x * x + y * y + z * z)
    ratio = atan2(length, cosine) / length if length else 1.0
    return ratio * x, ratio * y, ratio * z


def _matrix(x: float, y: float, z: float, w: float, two: float) -> Array:
    """Return the matrix of a quaternion; ``two`` is 2 over its squared length."""
    xx, yy, zz = two * x * x, two * y * y, two * z * z
    xy, xz, yz = two * x * y, two * x * z, two * y * z
    wx, wy, wz = two * w * x, two * w * y, two * w * z
    rows: Any = (
        (1.0 - yy - zz, xy - wz, xz + wy),
        (xy + wz, 1.0 - xx - zz, yz - wx),
        (xz - wy, yz + wx, 1.0 - xx - yy),
    )
    return np.array(rows)
