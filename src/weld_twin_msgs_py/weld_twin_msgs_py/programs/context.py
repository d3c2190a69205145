# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a reader of programs is given besides the text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array

from .controllers import Controller
from .source import Notation, Number, joint_notation


class Context(NamedTuple):
    """The robot that runs a program."""

    robot: Robot
    controller: Controller
    pulses_per_degree: Array | None = None
    """Of a Yaskawa arm whose points are in pulses, shape (n,)."""

    @property
    def axes(self) -> int:
        """Return how many joints the controller has as the arm's own."""
        return self.robot.n - len(self.controller.external)

    def external(self, numbers: Sequence[Number | None]) -> Array | None:
        """
        Return the external axes of a point as joints of the model; None where one is missing.

        numbers: degrees or mm, in the order of ``controller.external``.
        """
        values = [number.value for number in numbers if number is not None]
        if len(values) < len(numbers):
            return None
        shown = [0.0] * self.axes + values
        return self.degrees().value(shown)[: len(values)]

    def degrees(self, decimals: int = 5) -> Notation:
        """Return joint positions in degrees, of sliding joints in millimetres."""
        slides = np.abs(self.controller.mix.T) @ self.robot.prismatic > 0.0
        unit = np.where(slides, 1e-3, np.pi / 180.0)
        return joint_notation(unit, self.controller.mix, decimals, 'joints in degrees')

    def radians(self, decimals: int = 7) -> Notation:
        """Return joint positions in radians, of sliding joints in metres."""
        return joint_notation(
            np.ones(self.robot.n), self.controller.mix, decimals, 'joints in radians'
        )
