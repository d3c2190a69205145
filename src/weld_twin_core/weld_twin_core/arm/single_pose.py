# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The pose of one joint position at a time, as a node needs it.

For one pose a call into numpy costs more than the arithmetic it does. Plain numbers are faster:
two axes and the tool point are carried from the tool back to the base, and the third axis is
their cross product.
"""

from __future__ import annotations

from math import atan2, cos, sin, sqrt
from struct import Struct
from typing import Any, NamedTuple

import numpy as np

from ..arrays import Array
from .channels import row_factors
from .robot import Robot
from .rotation import LARGE_TURN, SMALL_ANGLE, matrix_from_quaternion, rotation_vector


class _Row(NamedTuple):
    """One turn and slide about z, then along and about x."""

    joint: int
    """Index of the joint that moves it, -1 for a fixed row."""
    slides: bool
    theta: float
    d: float
    a: float
    cosine: float
    sine: float

    @property
    def link(self) -> tuple[float, float, float]:
        """Return the slide along x and cosine and sine of the turn about it."""
        return self.a, self.cosine, self.sine


_PACKED = Struct('16d').pack


class SinglePose:
    """The chain of one robot, prepared for one joint position at a time."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self._foot: SinglePose | None = None
        if robot.behind:
            foot, arm = robot.branches
            self._foot = SinglePose(foot)
            self._arm = SinglePose(arm)
            return
        *rows, last = _rows(robot)
        # The last link does not move against the tool; the joints come with the link before them.
        a, cosine, sine = last.link
        link = np.array([[1, 0, 0, a], [0, cosine, -sine, 0], [0, sine, cosine, 0], [0, 0, 0, 1]])
        columns = (link @ robot.T_flange_tool)[:3, [0, 2, 3]].T
        self._tool = tuple(columns.ravel().tolist())
        onward = [*rows[1:], last]
        self._rows = tuple(
            (*row[:4], *before.link) for before, row in zip(rows[::-1], onward[::-1], strict=True)
        )
        self._first = (rows[0] if rows else last)[:4]
        plain = np.array_equal(robot.T_world_base, np.eye(4))
        self._base = None if plain else robot.T_world_base

    def __call__(self, q: Array) -> Array:
        """Return the tool pose ``T_world_tool``, shape (4, 4), of a joint position (n,)."""
        if self._foot is not None:
            behind = self.robot.behind
            there = np.linalg.inv(self._foot(q[:behind][::-1]))
            return np.asarray(there @ self._arm(q[behind:]))
        values = [*q.tolist(), 0.0]
        x0, x1, x2, z0, z1, z2, p0, p1, p2 = self._tool
        for joint, slides, angle, d, a, cosine, sine in self._rows:
            if slides:
                d += values[joint]
            else:
                angle += values[joint]
            c, s = cos(angle), sin(angle)
            y = s * x0 + c * x1
            x0 = c * x0 - s * x1
            x1 = cosine * y - sine * x2
            x2 = sine * y + cosine * x2
            y = s * z0 + c * z1
            z0 = c * z0 - s * z1
            z1 = cosine * y - sine * z2
            z2 = sine * y + cosine * z2
            y = s * p0 + c * p1
            p0 = c * p0 - s * p1 + a
            p2 += d
            p1 = cosine * y - sine * p2
            p2 = sine * y + cosine * p2
        joint, slides, angle, d = self._first
        if slides:
            d += values[joint]
        else:
            angle += values[joint]
        c, s = cos(angle), sin(angle)
        x0, x1 = c * x0 - s * x1, s * x0 + c * x1
        z0, z1 = c * z0 - s * z1, s * z0 + c * z1
        p0, p1, p2 = c * p0 - s * p1, s * p0 + c * p1, p2 + d
        # Packed numbers become an array in less time than a tuple of them.
        y0, y1, y2 = z1 * x2 - z2 * x1, z2 * x0 - z0 * x2, z0 * x1 - z1 * x0
        packed = _PACKED(x0, y0, z0, p0, x1, y1, z1, p1, x2, y2, z2, p2, 0.0, 0.0, 0.0, 1.0)
        pose: Array = np.ndarray((4, 4), np.float64, bytearray(packed))
        return pose if self._base is None else self._base @ pose


def _rows(robot: Robot) -> list[_Row]:
    """Return the chain as rows of one kind, each link with the joint before it."""
    rows: list[_Row] = []
    for i in range(robot.n):
        a, alpha, beta = float(robot.a[i]), float(robot.alpha[i]), float(robot.beta[i])
        slides = bool(robot.prismatic[i])
        joint = _Row(i, slides, float(robot.theta[i]), float(robot.d[i]), 0.0, 1.0, 0.0)
        parts: list[_Row] = []
        for kinds in row_factors(robot.convention, without='' if beta else 'beta'):
            if 'theta' in kinds:
                parts.append(joint)
            elif 'beta' in kinds:
                # Ry(beta) is Rz(90 deg) Rx(beta) Rz(-90 deg).
                quarter = 0.5 * np.pi
                first, last = _link(0.0, beta), _link(0.0, 0.0)
                parts += [first._replace(theta=quarter), last._replace(theta=-quarter)]
            else:
                parts.append(_link(a if 'a' in kinds else 0.0, alpha if 'alpha' in kinds else 0.0))
        for part in parts:
            if rows and part.joint < 0 and part.theta == 0.0 and rows[-1][4:] == (0.0, 1.0, 0.0):
                part = rows.pop()._replace(a=part.a, cosine=part.cosine, sine=part.sine)
            rows.append(part)
    return rows


def _link(a: float, alpha: float) -> _Row:
    return _Row(-1, False, 0.0, 0.0, a, cos(alpha), sin(alpha))


_UNIT = (0.981, 1.019)
"""Squared lengths between which a quaternion is one of a rotation for sure."""


def quaternion_matrix(x: float, y: float, z: float, w: float, name: str) -> Array:
    """Return the matrix (3, 3) of a quaternion; DataError as `matrix_from_quaternion`."""
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
