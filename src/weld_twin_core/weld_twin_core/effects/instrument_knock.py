# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Instrument knock: the instrument, or the base of the robot, stands elsewhere from an instant on."""

from __future__ import annotations

from dataclasses import dataclass

from ..arm.robot import Robot
from .registry import register
from .sudden import SuddenFrame
from .view import Value
from .wording import base_frame


@register
@dataclass(frozen=True, eq=False)
class InstrumentKnock(SuddenFrame):
    """The base is displaced by xyz in the world and turned by rotvec from ``time`` [s] on."""

    xyz: Value = (0.0, 0.0, 0.0)
    rotvec: Value = (0.0, 0.0, 0.0)
    time: float = 0.0

    name = 'instrument_knock'
    place = 'instrument'
    of_setup = True
    channel = 'base'

    def remedy(self, robot: Robot) -> str:
        """Return what to mend, in words; see `Hooks.remedy`."""
        return (
            f'Fasten the instrument and the base: one moved by {base_frame(self.vector()[:6])} at '
            f't = {self.plain("time"):.4g}; measure what came before and after apart.'
        )
