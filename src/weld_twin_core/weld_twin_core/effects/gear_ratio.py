# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Gear ratio: theta -> (1 + scale) theta."""

from dataclasses import dataclass

from ..arm.channels import Shift
from .effect import Effect
from .registry import register
from .view import Parameter, Stage, Value, View, single


@register
@dataclass(frozen=True, eq=False)
class GearRatio(Effect):
    """A wrong transmission or encoder scale: the error grows with the joint's angle."""

    joint: str
    scale: Value = 0.0

    name = 'gear_ratio'
    title = 'gear ratio error'
    entered = 'ratio'
    everywhere = True
    by_motion = True
    demand = 2
    depends_on = 'angle'
    of = 'joint'
    stage = Stage.JOINT
    parameters = (Parameter('scale', '-', typical=3e-4),)

    def displace(self, view: View) -> Shift:
        """Return scale * theta on the joint."""
        i = view.robot.index(self.joint)
        return {('q', i): self.number('scale') * view.joint(i)}

    def gradient(self, view: View) -> list[Shift | None]:
        """Return theta."""
        i = view.robot.index(self.joint)
        return [{('q', i): view.joint(i)}]

    def slope(self, view: View) -> Shift:
        """Return the scale."""
        return single(('q', view.robot.index(self.joint)), self.number('scale'), view)
