# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Paden-Kahan subproblems, batched: what angle about an axis brings a vector where it should be.

Where no angle does, the nearest one is returned; the caller checks the closure.

References
----------
.. [1] A. J. Elias, J. T. Wen, "IK-Geo: unified robot inverse kinematics using subproblem
   decomposition", Mechanism and Machine Theory 209, 2025.

"""

import numpy as np

from ...arm.rotation import skew
from ...arrays import Array


def turn(axis: Array, angle: Array, vector: Array) -> Array:
    """
    Return vectors turned about a fixed axis, shape (..., 3).

    axis: shape (3,), of length 1.
    angle: shape (...) [rad].
    vector: shape (..., 3).
    """
    cosine, sine = np.cos(angle)[..., None], np.sin(angle)[..., None]
    along = (vector @ axis)[..., None] * axis
    return along + cosine * (vector - along) + sine * _cross(axis, vector)


def turn_matrix(axis: Array, angle: Array) -> Array:
    """Return rotation matrices (..., 3, 3) by angles (...) about a fixed unit axis (3,)."""
    along, around = np.outer(axis, axis), skew(axis)
    cosine, sine = np.cos(angle)[..., None, None], np.sin(angle)[..., None, None]
    return along + cosine * (np.eye(3) - along) + sine * around


def angle_onto(axis: Array, start: Array, end: Array) -> Array:
    """
    Return the angle that turns one vector onto another, shape (...) [rad].

    axis: shape (3,), of length 1.
    start, end: of equal length and height along the axis, shape (..., 3); otherwise the nearest
    angle is returned.
    """
    sine = _cross(start, end) @ axis
    cosine = (start * end).sum(axis=-1) - (start @ axis) * (end @ axis)
    return np.asarray(np.arctan2(sine, cosine))


def angle_to_height(along: Array, axis: Array, start: Array, height: Array) -> Array:
    """
    Return both angles at which a turned vector has a given component, shape (2, ...) [rad].

    along: direction of the component, shape (..., 3); the component counts in units of its length.
    axis: shape (3,), of length 1.
    start: the vector to turn, shape (..., 3).
    height: the component wanted, shape (...).
    """
    level = (start @ axis)[..., None] * axis
    cosine = ((start - level) * along).sum(axis=-1)
    sine = (_cross(axis, start) * along).sum(axis=-1)
    wanted = height - (level * along).sum(axis=-1)
    size = np.hypot(cosine, sine)
    spread = np.arccos(np.clip(wanted / np.where(size > 0.0, size, 1.0), -1.0, 1.0))
    middle = np.arctan2(sine, cosine)
    return np.stack([middle + spread, middle - spread])


def angle_to_distance(offset: Array, axis: Array, start: Array, distance: Array) -> Array:
    """
    Return both angles at which a sum has a given length, shape (2, ...) [rad].

    offset: shape (..., 3).
    axis: shape (3,), of length 1.
    start: the vector to turn, shape (..., 3); the sum is ``offset`` plus the turned vector.
    distance: the length wanted, shape (...).
    """
    height = 0.5 * (distance**2 - (offset**2).sum(axis=-1) - (start**2).sum(axis=-1))
    return angle_to_height(offset, axis, start, height)


def _cross(first: Array, second: Array) -> Array:
    """Return cross products (..., 3); numpy's own spends most of its time on moving axes."""
    a, b, c = first[..., 0], first[..., 1], first[..., 2]
    x, y, z = second[..., 0], second[..., 1], second[..., 2]
    out = np.empty(np.broadcast_shapes(first.shape, second.shape))
    out[..., 0] = b * z - c * y
    out[..., 1] = c * x - a * z
    out[..., 2] = a * y - b * x
    return out
