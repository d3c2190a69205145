# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a reader of programs is told besides the text."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array

from .controllers import Controller
from .notation import Notation, joint_notation


class Context(NamedTuple):
    """
    The robot that runs a program.

    Attributes
    ----------
    robot : Robot
    controller : Controller
    pulses_per_degree : array, shape (n,), optional
        Of a Yaskawa arm whose points are in pulses.

    """

    robot: Robot
    controller: Controller
    pulses_per_degree: Array | None = None

    def degrees(self, decimals: int = 5) -> Notation:
        """Return joint positions in degrees, of sliding joints in millimetres."""
        unit = np.where(self.robot.prismatic, 1e-3, np.pi / 180.0)
        return joint_notation(unit, self.controller.mix, decimals, 'joints in degrees')

    def radians(self, decimals: int = 7) -> Notation:
        """Return joint positions in radians, of sliding joints in metres."""
        return joint_notation(
            np.ones(self.robot.n), self.controller.mix, decimals, 'joints in radians'
        )
