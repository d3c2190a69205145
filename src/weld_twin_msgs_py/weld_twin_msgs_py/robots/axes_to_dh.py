# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Joint axes to standard Denavit-Hartenberg rows, exactly.

Between clearly skew axes the common normal fixes the row. Between axes that are parallel, or
nearly so (a calibrated arm's are off by fractions of a degree), the common normal runs away; there
Hayati's row is used: d is zero and a small turn beta about y takes what alpha cannot.

References
----------
.. [1] J. Denavit, R. S. Hartenberg, "A kinematic notation for lower-pair mechanisms based on
   matrices", J. Appl. Mech. 22, 1955.
.. [2] S. Hayati, "Robot arm geometric link parameter estimation", IEEE CDC 1983.

"""

from typing import NamedTuple

import numpy as np

from weld_twin_core.arm.rotation import transform
from weld_twin_core.arrays import Array

from .urdf_tree import turn

NEARLY_PARALLEL = 0.05
"""Sine of the angle between axes below which the row is Hayati's."""
ROUNDING = 1e-14
"""Numbers below this are left over from rounding [m or rad]."""


class Axis(NamedTuple):
    """A joint axis at joint position zero, in the base: unit direction and a point on it [m]."""

    direction: Array
    point: Array
    prismatic: bool = False


class Row(NamedTuple):
    """One row: Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta) [rad, m]."""

    theta: float
    d: float
    a: float
    alpha: float
    beta: float

    def matrix(self) -> Array:
        """Return the transform of the row at joint position zero, shape (4, 4)."""
        rotation = turn(2, self.theta)
        position = np.array([0.0, 0.0, self.d]) + self.a * rotation[:, 0]
        return transform(rotation @ turn(0, self.alpha) @ turn(1, self.beta), position)


def dh_rows(axes: list[Axis], T_base_tip: Array) -> tuple[Array, list[Row], list[Array]]:
    """
    Return the first frame, the rows of a chain of axes, and the frame at the end of each.

    All are in the base, at joint position zero, where the tip is ``T_base_tip``.
    """
    first = _first_frame(axes[0])
    frame, rows, frames = first, [], []
    for k in range(len(axes)):
        if k + 1 < len(axes):
            u = frame[:3, :3].T @ axes[k + 1].direction
            p = frame[:3, :3].T @ (axes[k + 1].point - frame[:3, 3])
            row = _row_to_axis(u, p)
        else:
            row = _last_row(inverse(frame) @ T_base_tip)
        row = Row(*(0.0 if abs(value) < ROUNDING else float(value) for value in row))
        frame = frame @ row.matrix()
        rows.append(row)
        frames.append(frame)
    return first, rows, frames


def inverse(T: Array) -> Array:
    """Return the inverse of a homogeneous transform, shape (4, 4)."""
    rotation = T[:3, :3].T
    return transform(rotation, -rotation @ T[:3, 3])


def _first_frame(axis: Axis) -> Array:
    """Return the frame on the first axis that lies closest to the base link."""
    z = axis.direction
    x = np.eye(3)[0] - z[0] * z
    if np.linalg.norm(x) < 0.1:
        x = np.eye(3)[1] - z[1] * z
    x = x / np.linalg.norm(x)
    point = axis.point if axis.prismatic else axis.point - (axis.point @ z) * z
    return transform(np.stack([x, np.cross(z, x), z], axis=1), point)


def _row_to_axis(u: Array, p: Array) -> Row:
    """Return the row from the z axis to the line through p along u, all in the local frame."""
    sine = float(np.hypot(u[0], u[1]))
    if sine < NEARLY_PARALLEL:
        return _hayati_row(u, p)
    normal = np.array([-u[1], u[0], 0.0]) / sine
    sign = -1.0 if normal[0] < -ROUNDING else 1.0  # keep x as near to the last x as it can be
    d = p[2] - (p[0] * u[0] + p[1] * u[1]) * u[2] / sine**2
    theta = np.arctan2(sign * normal[1], sign * normal[0])
    return Row(theta, d, sign * float(p @ normal), sign * np.arctan2(sine, u[2]), 0.0)


def _hayati_row(u: Array, p: Array) -> Row:
    crossing = p - u * (p[2] / u[2])
    a = float(np.hypot(crossing[0], crossing[1]))
    theta = 0.0
    if a > ROUNDING:
        a = -a if crossing[0] < -ROUNDING else a
        theta = float(np.arctan2(crossing[1] / a, crossing[0] / a))
    turned = turn(2, theta).T @ u
    return Row(theta, 0.0, a, np.arctan2(-turned[1], turned[2]), np.arcsin(turned[0]))


def _last_row(T: Array) -> Row:
    """Return the row that ends beside the tip; the tool frame takes what is left."""
    x, y = T[0, 0], T[1, 0]
    theta = np.arctan2(y, x) if np.hypot(x, y) > 0.1 else 0.0
    return Row(theta, T[2, 3], 0.0, 0.0, 0.0)
