# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Guide tilt: a carriage pitches, yaws and rolls along its travel.

A lever makes it large: a carriage that pitches by 0.1 mrad moves a tool two metres above it by 0.2 mm,
and its mean over the travel is an error of links.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arm.channels import Shift
from ..arm.robot import Robot
from .carriage import GuideError, carriage_axes, carried
from .registry import register
from .view import Parameter, Plausible, Stage, Value, View
from .wording import number


@register
@dataclass(frozen=True, eq=False)
class GuideTilt(GuideError):
    """The carriage turns by rate * q about the x, y and z of its row; z is along the travel."""

    joint: str
    rate: Value = (0.0, 0.0, 0.0)

    name = 'guide_tilt'
    traits = replace(
        GuideError.traits,
        title='tilting carriage',
        meaning='the carriage of a joint that slides turns on its way',
        entered='program',
    )
    stage = Stage.POSE
    parameters = (
        Parameter(
            'rate',
            'rad/m',
            size=3,
            typical=2e-4,
            range=Plausible.even(
                2e-4, 5e-3, 'derived: rails laid to 0.1 mm on a metre, half a metre apart'
            ),
        ),
    )

    def per_unit(self, view: View) -> list[Shift]:
        """Return how the tool moves with the carriage."""
        i = view.robot.index(self.joint)
        axes = carriage_axes(view, i)
        return [carried(view, i, None, view.joint(i) * axis) for axis in axes]

    def remedy(self, robot: Robot) -> str:
        each = ', '.join(number(float(np.degrees(v))) for v in np.asarray(self.rate))
        return (
            f'Level the guide of {self.site}: its carriage turns by ({each}) deg about x, y, z of '
            'its row on every metre; until then compensate the motion.'
        )
