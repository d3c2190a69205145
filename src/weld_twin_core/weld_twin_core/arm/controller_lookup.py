# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which arm a model is of, and where the controller of any robot has its base and flange."""

from __future__ import annotations

import hashlib

import numpy as np

from .catalog import load, names
from .controller_frames import ControllerFrames
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
