# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How an arm stands: which way is up, and which way it rises from its foot.

Gravity tells what is up. The z axis of the first row does not: it is the first joint's axis, which
a URDF may let point down, as KUKA's do.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from .chain import frames
from .robot import Robot

_FLAT = 0.02
"""Share of the arm's length that the second axis lies beyond the foot, from which it tells the way."""


def up(robot: Robot) -> Array:
    """Return the direction against gravity in the base frame of the rows, shape (3,)."""
    weight = float(np.linalg.norm(robot.gravity))
    return np.asarray(-robot.gravity / weight) if weight > 0.0 else np.array([0.0, 0.0, 1.0])


def rising(robot: Robot) -> float:
    """Return 1 where the arm rises from its foot along z of its first row, -1 where against it."""
    if robot.n > 1 and not robot.prismatic[0]:
        chain = frames(robot.with_frames(base=np.eye(4)), np.zeros(robot.n))
        rise = float(chain.rows[1].z_point[2])
        if abs(rise) > _FLAT * float(np.abs(robot.a).sum() + np.abs(robot.d).sum()):
            return float(np.sign(rise))
    return -1.0 if robot.T_base_origin[2, 2] < -0.5 else 1.0
