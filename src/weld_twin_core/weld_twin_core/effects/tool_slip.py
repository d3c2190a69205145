# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Tool slip: the tool slips in its holder, or the reflector in its nest, at an instant."""

from __future__ import annotations

from dataclasses import dataclass

from ..arm.robot import Robot
from .registry import register
from .sudden import SuddenFrame
from .view import Value
from .wording import frame


@register
@dataclass(frozen=True, eq=False)
class ToolSlip(SuddenFrame):
    """The tool is displaced by xyz of the flange and turned by rotvec from ``time`` [s] on."""

    xyz: Value = (0.0, 0.0, 0.0)
    rotvec: Value = (0.0, 0.0, 0.0)
    time: float = 0.0

    name = 'tool_slip'
    place = 'tool'
    of_setup = True
    channel = 'tool'

    def remedy(self, robot: Robot) -> str:
        """Return what to mend, in words; see `Hooks.remedy`."""
        return (
            f'Fasten the tool or the reflector: it moved by '
            f'{frame(self.vector()[:6], "of the flange", "of the tool")} at '
            f't = {self.plain("time"):.4g}; measure its centre point again.'
        )
