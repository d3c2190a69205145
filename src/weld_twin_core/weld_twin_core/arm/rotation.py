# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Rotations: vectors, matrices and quaternions (x y z w), batched over leading axes.

Examples
--------
>>> import numpy as np
>>> import weld_twin_core as wt
>>> quarter = wt.rotation.rotation_matrix([0.0, 0.0, np.pi / 2])
>>> print(quarter.round(3) @ [1.0, 0.0, 0.0])
[0. 1. 0.]

References
----------
.. [1] J. Sola, J. Deray, D. Atchuthan, "A micro Lie theory for state estimation in robotics",
   arXiv:1812.01537, eqs. 132-146.
.. [2] F. L. Markley, "Unit quaternion from rotation matrix", J. Guidance, Control, and Dynamics 31,
   2008.

"""

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, readonly
from ..errors import DataError

SMALL_ANGLE = 1e-4
"""Below this angle [rad] the series of sin and cos are exact to rounding."""
LARGE_TURN = 0.5
"""Cosine of the turn (60 degrees) that a matrix's skew part tells to rounding; near half a turn none."""


def skew(vector: Array) -> Array:
    """Return the cross-product matrices, shape (..., 3, 3), of vectors, shape (..., 3)."""
    x, y, z = vector[..., 0], vector[..., 1], vector[..., 2]
    out = np.zeros((*vector.shape, 3), dtype=vector.dtype)
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -z, y, -x
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = z, -y, x
    return out


def _series(angle: Array) -> tuple[Array, Array, Array]:
    """Return sin(a)/a, (1-cos a)/a^2 and (a-sin a)/a^3 without cancellation at zero."""
    square = angle * angle
    safe = np.where(angle < SMALL_ANGLE, 1.0, angle)
    half = np.sin(0.5 * safe)
    small = angle < SMALL_ANGLE
    first = np.where(small, 1.0 - square / 6.0, np.sin(safe) / safe)
    second = np.where(small, 0.5 - square / 24.0, 2.0 * half * half / (safe * safe))
    third = np.where(small, 1.0 / 6.0 - square / 120.0, (safe - np.sin(safe)) / safe**3)
    return first, second, third


def rotation_matrix(rotvec: ArrayLike) -> Array:
    """Return rotation matrices, shape (..., 3, 3), of rotation vectors, shape (..., 3) [rad]."""
    vector = np.asarray(rotvec, dtype=np.float64)
    cross = skew(vector)
    sine, cosine, _ = _series(np.linalg.norm(vector, axis=-1)[..., None, None])
    return np.eye(3) + sine * cross + cosine * (cross @ cross)


def left_jacobian(rotvec: ArrayLike) -> Array:
    """Return J with R(v + dv) = R(J dv) R(v) to first order; shape (..., 3, 3)."""
    vector = np.asarray(rotvec, dtype=np.float64)
    cross = skew(vector)
    _, cosine, third = _series(np.linalg.norm(vector, axis=-1)[..., None, None])
    return np.eye(3) + cosine * cross + third * (cross @ cross)


def rotation_vector(matrix: Array) -> Array:
    """Return rotation vectors, shape (..., 3) [rad], of rotation matrices, shape (..., 3, 3)."""
    if not matrix.size:
        return np.zeros(matrix.shape[:-2] + (3,))
    # sin(angle) times the axis, and cos(angle)
    sine = np.empty(matrix.shape[:-1])
    for k in range(3):
        sine[..., k] = 0.5 * (matrix[..., k - 1, k - 2] - matrix[..., k - 2, k - 1])
    cosine = 0.5 * (matrix[..., 0, 0] + matrix[..., 1, 1] + matrix[..., 2, 2] - 1.0)
    if cosine.min() < LARGE_TURN:
        return _from_quaternion(quaternion_from_matrix(matrix))
    length = np.sqrt((sine**2).sum(axis=-1))
    angle = np.arctan2(length, cosine)
    ratio = np.divide(angle, length, out=np.ones_like(angle), where=length > 0.0)
    return np.asarray(ratio[..., None] * sine)


def _from_quaternion(quaternion: Array) -> Array:
    """Return rotation vectors, shape (..., 3), of quaternions with w >= 0."""
    vector, w = quaternion[..., :3], quaternion[..., 3]
    length = np.linalg.norm(vector, axis=-1)
    angle = 2.0 * np.arctan2(length, w)
    ratio = np.divide(angle, length, out=np.zeros_like(angle), where=length > 0.0)
    return np.asarray(ratio[..., None] * vector)


def matrix_from_quaternion(quaternion: ArrayLike, name: str = 'quaternion') -> Array:
    """
    Return rotation matrices, shape (..., 3, 3), of quaternions x y z w, shape (..., 4).

    Raises
    ------
    DataError
        A quaternion is not finite or its length is not 1 within 1 %.

    """
    values = np.asarray(quaternion, dtype=np.float64)
    flat = readonly(values.reshape(-1, 4), (None, 4), name)
    length = np.linalg.norm(flat, axis=1)
    if flat.size and (abs(length - 1.0) > 0.01).any():
        k = int(np.argmax(abs(length - 1.0) > 0.01))
        raise DataError(
            f'{name} {k} has length {length[k]:.4g}, a rotation needs 1; '
            'check the order (x y z w) and that it is not left at zero'
        )
    vector, w = flat[:, :3] / length[:, None], (flat[:, 3] / length)[:, None, None]
    cross = skew(vector)
    matrices = np.eye(3) + 2.0 * (w * cross + cross @ cross)
    return np.reshape(matrices, values.shape[:-1] + (3, 3))


def quaternion_from_matrix(matrix: Array) -> Array:
    """Return quaternions x y z w with w >= 0, shape (..., 4), of rotation matrices."""
    m = np.moveaxis(np.reshape(matrix, (-1, 3, 3)), 0, -1)
    trace = m[0, 0] + m[1, 1] + m[2, 2]
    # Four ways to the same quaternion; the one with the largest divisor loses no digits [2]_.
    ways = np.empty((4, 4, trace.size))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        ways[i, i] = 1.0 - trace + 2.0 * m[i, i]
        ways[i, j] = ways[j, i] = m[i, j] + m[j, i]
        ways[i, 3] = ways[3, i] = m[k, j] - m[j, k]
    ways[3, 3] = 1.0 + trace
    best = np.argmax([m[0, 0], m[1, 1], m[2, 2], trace], axis=0)
    values = ways[best, :, np.arange(trace.size)]
    values /= np.linalg.norm(values, axis=1, keepdims=True)
    canonical = np.where(values[:, 3:] < 0.0, -values, values)
    return np.reshape(canonical, matrix.shape[:-2] + (4,))


def wrapped(angle: Array | float) -> Array:
    """Return angles [rad] of any shape less whole turns, in [-pi, pi)."""
    return np.asarray((angle + np.pi) % (2.0 * np.pi) - np.pi)


def nearest_rotation(matrix: Array) -> Array:
    """Return the rotations R that make trace(R' matrix) largest, shape (..., 3, 3)."""
    u, _, vt = np.linalg.svd(matrix)
    u[..., 2] *= np.linalg.det(u @ vt)[..., None]
    return np.asarray(u @ vt)


def transform(rotation: Array, position: Array) -> Array:
    """Return homogeneous transforms, shape (..., 4, 4)."""
    out = np.zeros(np.broadcast_shapes(rotation.shape[:-2], position.shape[:-1]) + (4, 4))
    out[..., :3, :3] = rotation
    out[..., :3, 3] = position
    out[..., 3, 3] = 1.0
    return out


def angle_between(first: Array, second: Array) -> Array:
    """Return the rotation vectors, shape (..., 3) [rad], that turn ``second`` into ``first``."""
    return rotation_vector(first @ np.swapaxes(second, -1, -2))


def missing(wanted: Array, real: Array) -> Array:
    """Return what is missing to poses (..., 4, 4), (..., 6) [m, rad], in fixed axes, linear first."""
    turn = angle_between(wanted[..., :3, :3], real[..., :3, :3])
    return np.concatenate([wanted[..., :3, 3] - real[..., :3, 3], turn], axis=-1)


def moved(pose: Array, twist: Array) -> Array:
    """Return poses (..., 4, 4) moved by what `missing` returns of others, (..., 6) [m, rad]."""
    turned = rotation_matrix(twist[..., 3:]) @ pose[..., :3, :3]
    return transform(turned, pose[..., :3, 3] + twist[..., :3])
