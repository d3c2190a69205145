# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which arm a model is of: a short name made from its kinematics."""

from __future__ import annotations

import hashlib

import numpy as np

from .robot import Robot

_GRID = 1e-6
"""Rounding [m, rad]: finer than any arm is known, coarser than files and conversions round."""


def fingerprint(robot: Robot) -> str:
    """
    Return 16 hexadecimal digits that stand for the kinematics of a robot.

    Rows and kinds of its joints count. Names, limits, masses, and where the arm stands and what
    tool it carries do not.

    """
    angles = np.stack([robot.alpha, robot.theta, robot.beta])
    turned = np.angle(np.exp(1j * (angles + 0.25 * _GRID))) - 0.25 * _GRID
    rows = np.concatenate([turned, np.stack([robot.a, robot.d])])
    steps = np.round(rows / _GRID).astype(np.int64)
    behind = f'{robot.behind} behind ' if robot.behind else ''
    text = f'{behind}{robot.convention}{robot.prismatic.astype(int).tolist()}{steps.tolist()}'
    return hashlib.sha256(text.encode()).hexdigest()[:16]
