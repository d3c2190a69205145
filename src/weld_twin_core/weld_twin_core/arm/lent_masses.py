# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Link masses of a bundled arm, lent to a robot file of the same arm that has none.

Many a URDF leaves masses out, and then no spring of a joint can be seen: how far a joint yields
depends on the torque of the links it carries.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..arrays import Array
from . import catalog
from .chain import Frames, frames
from .dynamics import link_point
from .robot import Robot

_NEAR = 0.015
"""Distance [m] between axes up to which two models are of one arm: calibration moves them by
millimetres, the next size of a series by centimetres."""
_TURNED = 0.03
"""Angle [rad] between axes up to which they are the same; calibrated axes turn by milliradians."""


def with_lent_masses(robot: Robot) -> Robot:
    """Return a robot without masses with those of the one bundled arm of the same axes."""
    if robot.mass is not None:
        return robot
    own = _axes(robot)
    fitting = []
    for name in catalog.names():
        other = catalog.load(name)
        if other.mass is not None and other.n == robot.n and _alike(own, _axes(other)):
            fitting.append(other)
    if len(fitting) != 1:
        return robot
    lender = fitting[0]
    return replace(
        robot,
        mass=lender.mass,
        com=_moved(lender, robot),
        source=f'{robot.source}; link masses of the bundled {lender.name}',
    )


def _at_zero(robot: Robot) -> Frames:
    return frames(robot, np.zeros(robot.n))


def _axes(robot: Robot) -> tuple[Array, Array]:
    """Return direction and a point of every joint axis at zero in the world, (n, 3) each."""
    rows = _at_zero(robot).rows
    ways = [np.reshape(row.z, 3) for row in rows], [np.reshape(row.z_point, 3) for row in rows]
    return np.array(ways[0]), np.array(ways[1])


def _alike(one: tuple[Array, Array], other: tuple[Array, Array]) -> bool:
    """Return whether all axes of two arms lie on each other."""
    turned = np.linalg.norm(np.cross(one[0], other[0]), axis=1)
    if (turned > _TURNED).any() or ((one[0] * other[0]).sum(axis=1) < 0.0).any():
        return False
    away = np.linalg.norm(np.cross(one[1] - other[1], other[0]), axis=1)
    return bool((away < _NEAR).all())


def _moved(lender: Robot, robot: Robot) -> Array:
    """Return the lender's centres of mass in the other's link frames, shape (n, 3) [m]."""
    assert lender.com is not None
    theirs, own = _at_zero(lender), _at_zero(robot)
    out = []
    for i in range(robot.n):
        there = np.reshape(link_point(lender, theirs, i, lender.com[i]), 3)
        origin = np.reshape(link_point(robot, own, i, np.zeros(3)), 3)
        axes = [np.reshape(link_point(robot, own, i, unit), 3) - origin for unit in np.eye(3)]
        out.append(np.linalg.solve(np.array(axes).T, there - origin))
    return np.array(out)
