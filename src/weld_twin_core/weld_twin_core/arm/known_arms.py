# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Which arm a model is of, and what is known of it for that: its controller's frames, its masses.

Many a URDF leaves masses out, and then no spring of a joint can be seen: how far a joint yields
depends on the torque of the links it carries.
"""

from __future__ import annotations

import hashlib
from dataclasses import replace

import numpy as np

from ..arrays import Array
from .catalog import load, names
from .chain import Frames, frames
from .controller_frames import ControllerFrames
from .dynamics import link_point
from .robot import Robot

_NO_TOOL = 1e-9
"""Length of a tool [m] up to which it is none: such a frame only turns the flange as it is drawn."""


def controller_frames(robot: Robot) -> ControllerFrames:
    """
    Return the controller's base and flange on a robot.

    A robot that says them has its own; an arm with the rows of a bundled one has the flange of
    that; of any other robot file the rows begin at the base and end at the flange, which a tool
    frame without a length turns.
    """
    if robot.controller is not None:
        return robot.controller
    name = bundled_name(robot)
    if name:
        return ControllerFrames(flange=load(name).T_flange_tool)
    bare = np.abs(robot.T_flange_tool[:3, 3]).max() <= _NO_TOOL
    return ControllerFrames(flange=robot.T_flange_tool if bare else np.eye(4))


def bundled_name(robot: Robot) -> str:
    """Return the name of the bundled robot with the same kinematics; empty for none."""
    own = fingerprint(robot)
    if robot.name in names() and fingerprint(load(robot.name)) == own:
        return robot.name
    return next((name for name in names() if fingerprint(load(name)) == own), '')


_GRID = 1e-6
"""Rounding [m, rad]: finer than any arm is known, coarser than files and conversions round."""


def fingerprint(robot: Robot) -> str:
    """Return 16 hexadecimal digits that stand for a robot's rows and kinds of joints alone."""
    angles = np.stack([robot.alpha, robot.theta, robot.beta])
    turned = np.angle(np.exp(1j * (angles + 0.25 * _GRID))) - 0.25 * _GRID
    rows = np.concatenate([turned, np.stack([robot.a, robot.d])])
    steps = np.round(rows / _GRID).astype(np.int64)
    behind = f'{robot.behind} behind ' if robot.behind else ''
    text = f'{behind}{robot.convention}{robot.prismatic.astype(int).tolist()}{steps.tolist()}'
    return hashlib.sha256(text.encode()).hexdigest()[:16]


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
    for name in names():
        other = load(name)
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
