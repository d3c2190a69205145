# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Rigid motions as exponentials of screws, batched over leading axes.

A motion is a pair (rotation, position); a screw is a pair (omega, v) with omega a unit vector
(turning) or zero (sliding). Lynch and Park, Modern Robotics, section 3.3.3.
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation


class Motion(NamedTuple):
    """Rigid motion, equally the pose of a frame."""

    rotation: np.ndarray
    """Shape (..., 3, 3)."""
    position: np.ndarray
    """Shape (..., 3) [m]."""


def identity() -> Motion:
    """Return the motion that moves nothing."""
    return Motion(np.eye(3), np.zeros(3))


def compose(*motions: Motion) -> Motion:
    """Return the product of the motions, the leftmost outermost."""
    total = motions[0]
    for motion in motions[1:]:
        position = np.einsum('...ij,...j->...i', total.rotation, motion.position)
        total = Motion(total.rotation @ motion.rotation, position + total.position)
    return total


def inverse(motion: Motion) -> Motion:
    """Return the motion that undoes the given one."""
    back = np.swapaxes(motion.rotation, -1, -2)
    return Motion(back, -np.einsum('...ij,...j->...i', back, motion.position))


def skew(vector: np.ndarray) -> np.ndarray:
    """Return the cross-product matrix, shape (..., 3, 3), of a vector (..., 3)."""
    x, y, z = np.moveaxis(vector, -1, 0)
    zero = np.zeros_like(x)
    rows = [np.stack(row, axis=-1) for row in ((zero, -z, y), (z, zero, -x), (-y, x, zero))]
    return np.stack(rows, axis=-2)


def exp_screw(omega: np.ndarray, v: np.ndarray, amount: np.ndarray) -> Motion:
    """
    Return the motion along a screw.

    omega: unit axis, or zero for a slide, shape (..., 3).
    v: velocity of the origin per unit of the amount [m/rad or -], shape (..., 3).
    amount: shape (...) [rad or m].
    """
    w = skew(np.asarray(omega, dtype=float))
    ww = w @ w
    s = np.asarray(amount, dtype=float)[..., None, None]
    rotation = np.eye(3) + np.sin(s) * w + (1.0 - np.cos(s)) * ww
    lever = np.eye(3) * s + (1.0 - np.cos(s)) * w + (s - np.sin(s)) * ww
    return Motion(rotation, np.einsum('...ij,...j->...i', lever, np.asarray(v, dtype=float)))


def turn(axis: str, angle: np.ndarray) -> Motion:
    """Return the turn about a coordinate axis, 'x', 'y' or 'z', by an angle (...) [rad]."""
    return exp_screw(np.eye(3)['xyz'.index(axis)], np.zeros(3), angle)


def slide(axis: str, length: np.ndarray) -> Motion:
    """Return the shift along a coordinate axis, 'x', 'y' or 'z', by a length (...) [m]."""
    return exp_screw(np.zeros(3), np.eye(3)['xyz'.index(axis)], length)


def from_rotvec(rotvec: np.ndarray, position: np.ndarray) -> Motion:
    """Return the motion of a rotation vector (..., 3) [rad] and a position (..., 3) [m]."""
    rotvec = np.asarray(rotvec, dtype=float)
    flat = Rotation.from_rotvec(rotvec.reshape(-1, 3)).as_matrix()
    return Motion(flat.reshape(rotvec.shape + (3,)), np.asarray(position, dtype=float))


def from_quaternion(quaternion: np.ndarray, position: np.ndarray) -> Motion:
    """Return the motion of a quaternion (4,) x y z w and a position (3,) [m]."""
    rotation = Rotation.from_quat(np.asarray(quaternion, dtype=float)).as_matrix()
    return Motion(rotation, np.asarray(position, dtype=float))
