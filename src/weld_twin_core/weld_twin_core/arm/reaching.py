# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Postures in which the tool point is at given points, from postures to start with."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from .chain import forward, jacobian
from .robot import Robot

ROUNDS = 80
"""Newton steps at the most: from a start at random they reach a point within some thirty."""
_STRIDE = 0.2
"""Longest step of a joint [rad, m]: longer ones jump to and fro near the edge of the reach."""
_DAMPING = 1e-6
"""Added to the squares [m^2/rad^2]: an arm that is stretched has no step that leads outwards."""
_REACHED = 1e-9
"""Distance [m] from which on the point counts as reached."""


def least_step(robot: Robot, q: Array, off: Array) -> Array:
    """Return the least steps (M, n) that move tool points by (M, 3) [m] from postures (M, n)."""
    turn = jacobian(robot, q)[:, :3]
    inverse = np.linalg.inv(turn @ np.swapaxes(turn, 1, 2) + _DAMPING * np.eye(3))
    return np.asarray(np.einsum('mji,mjk,mk->mi', turn, inverse, off))


def reaching(robot: Robot, points: Array, start: Array) -> tuple[Array, NDArray[np.bool_]]:
    """
    Return postures (M, n) near starts with tool points at points (M, 3) [m], and which are there.

    Limits of the joints are not looked at.
    """
    q = np.array(start)
    for _ in range(ROUNDS):
        off = points - forward(robot, q)[:, :3, 3]
        if np.abs(off).max(initial=0.0) < _REACHED:
            break
        q = q + np.clip(least_step(robot, q, off), -_STRIDE, _STRIDE)
    off = points - forward(robot, q)[:, :3, 3]
    return q, np.linalg.norm(off, axis=1) < _REACHED
