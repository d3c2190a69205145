# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a reader of programs is given besides the text."""

from collections.abc import Sequence
from typing import NamedTuple, NoReturn

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.recording import Counted

from .controllers import Controller, shown_order
from .source import Notation, Number, Source, joint_notation


class Context(NamedTuple):
    """The robot that runs a program."""

    robot: Robot
    controller: Controller
    pulses_per_degree: Array | None = None
    """Of a Yaskawa arm whose points are in pulses, shape (n,)."""
    counted: Counted | None = None
    """How the controller counts the joints, where a recording of it tells."""
    beside: tuple[Source, ...] = ()
    """Other programs of its folder, whose routines it may call."""

    @property
    def axes(self) -> int:
        """Return how many joints the controller has as the arm's own."""
        return self.robot.n - len(self.controller.external)

    def external(self, numbers: Sequence[Number | None]) -> Array | None:
        """Return external axes [deg, mm] as joints of the model; None where one is missing."""
        values = [number.value for number in numbers if number is not None]
        if len(values) < len(numbers):
            return None
        shown = [0.0] * self.axes + values
        return self.degrees().value(shown)[: len(values)]

    def degrees(self, decimals: int = 5) -> Notation:
        """Return joint positions in degrees, of sliding joints in millimetres."""
        slides = np.abs(self.controller.mix.T) @ self.robot.prismatic > 0.0
        unit = np.where(slides, 1e-3, np.pi / 180.0)
        return self.shown(unit, decimals, 'joints in degrees')

    def radians(self, decimals: int = 7) -> Notation:
        """Return joint positions in radians, of sliding joints in metres."""
        return self.shown(np.ones(self.robot.n), decimals, 'joints in radians')

    def shown(self, unit: Array, decimals: int, name: str) -> Notation:
        """
        Return joint positions as the controller shows them, in units of the model's, shape (n,).

        They can be neither read nor written where it is known to count otherwise.
        """
        out = joint_notation(unit, self.controller.mix, decimals, name)
        return out._replace(value=self._refuse, numbers=self._refuse) if self.otherwise() else out

    def otherwise(self) -> str:
        """Return why joint values of the controller are not known; empty where they are."""
        if self.counted is None:
            return ''
        matrix, offset = self.counted
        order = abs(shown_order(self.robot, self.controller.external))
        if not offset.any() and np.allclose(matrix @ order, self.controller.mix):
            return ''
        names = self.robot.joint_names
        off = abs(matrix - np.eye(len(names))).any(axis=1) | (offset != 0.0)
        which = ', '.join(name for name, one in zip(names, off, strict=True) if one)
        return (
            f'the controller counts {which} otherwise, as the table of the recording was read, and '
            'joint values of its programs are not known here; take poses, or a robot file that counts '
            'as the controller does'
        )

    def _refuse(self, *_: object) -> NoReturn:
        raise DataError(self.otherwise())
