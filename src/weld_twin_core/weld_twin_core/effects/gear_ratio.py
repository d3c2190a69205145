# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Gear ratio: theta -> (1 + scale) theta."""

from __future__ import annotations

from dataclasses import dataclass

from ..arm.channels import Shift
from ..arm.robot import Robot
from .effect import LinearEffect
from .hooks import Hooked, Traits, TwinHooks
from .registry import register
from .view import Parameter, Plausible, Stage, Value, View, single
from .wording import number


class _Twin(TwinHooks):
    effect: GearRatio

    def slope(self, view: View) -> Shift:
        """Return the scale."""
        return single(
            ('q', view.robot.index(self.effect.joint)), self.effect.number('scale'), view
        )


@register
@dataclass(frozen=True, eq=False)
class GearRatio(LinearEffect):
    """A wrong transmission or encoder scale: the error grows with the joint's angle."""

    joint: str
    scale: Value = 0.0

    name = 'gear_ratio'
    traits = Traits(
        title='gear ratio error',
        meaning='a joint turns by a constant factor too far',
        entered='ratio',
        depends_on='angle',
        demand=2,
        by_motion=True,
        everywhere=True,
    )
    of = 'joint'
    stage = Stage.JOINT
    parameters = (
        Parameter(
            'scale',
            '-',
            typical=3e-4,
            range=Plausible.even(
                1e-3,
                2e-2,
                'derived: tooth numbers are exact, what is left is belts and scales of encoders; '
                'one tooth in fifty is the coarsest wrong ratio',
            ),
        ),
    )
    twin = Hooked(_Twin)

    def per_unit(self, view: View) -> list[Shift]:
        """Return theta."""
        i = view.robot.index(self.joint)
        return [{('q', i): view.joint(i)}]

    def remedy(self, robot: Robot) -> str:
        scale = self._plain('scale')
        if self.on_slide(robot):
            return (
                f'Enter the feed of {self.site} (mm of travel per turn of the motor) times '
                f'{1.0 + scale:.6f}: it goes {number(scale * 1e3)} mm further on every metre than it '
                'reads.'
            )
        return (
            f'Enter the gear ratio of {self.site} times {1.0 + scale:.6f} where it is turns of the '
            'joint per turn of the motor, divided by it where it is turns of the motor per turn of '
            f'the joint: it turns {number(scale * 100.0)} % of its angle further than it reads.'
        )
