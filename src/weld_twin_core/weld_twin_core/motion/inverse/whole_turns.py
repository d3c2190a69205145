# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Whole turns of revolute joints: which of the equal positions suits the limits."""

import numpy as np

from ...arm.robot import Robot
from ...arrays import Array

TURN = 2.0 * np.pi
"""A whole turn [rad]."""


def middle(robot: Robot) -> Array:
    """Return the middle of each joint's range, shape (n,); 0 where it has no limits."""
    finite = np.isfinite(robot.lower) & np.isfinite(robot.upper)
    total = np.where(finite, robot.lower, 0.0) + np.where(finite, robot.upper, 0.0)
    return np.asarray(0.5 * total)


def centred(robot: Robot, q: Array) -> Array:
    """Return the positions, shape (..., n), on the turn nearest the middle of the limits."""
    return q + TURN * turns_to_middle(robot, q, q)


def turns_to_middle(robot: Robot, low: Array, high: Array) -> Array:
    """
    Return how many whole turns bring a range of positions to the middle of the limits.

    low, high: ends of the range of every joint, shape (..., n) [rad or m].

    Returns
    -------
    array, shape (..., n)
        Whole numbers; 0 for joints that slide.

    """
    turns = np.round((middle(robot) - 0.5 * (low + high)) / TURN)
    return np.where(robot.prismatic, 0.0, turns)
