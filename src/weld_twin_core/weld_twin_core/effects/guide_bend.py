# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Guide bend: the track of a joint that slides is not straight.

A constant and a slope of the guide are errors of links; what is left of a bent guide is first of all
a parabola.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arm.channels import Shift
from ..arm.robot import Robot
from .carriage import GuideError, carriage_axes, carried
from .registry import register
from .view import Parameter, Plausible, Stage, Value, View
from .wording import size


@register
@dataclass(frozen=True, eq=False)
class GuideBend(GuideError):
    """The carriage is off by curvature * q^2 / 2 along the x and the y of its row."""

    joint: str
    curvature: Value = (0.0, 0.0)

    name = 'guide_bend'
    traits = replace(
        GuideError.traits,
        title='bent guide',
        meaning='the guide of a joint that slides is no straight line',
        entered='program',
    )
    stage = Stage.POSE
    parameters = (
        Parameter(
            'curvature',
            '1/m',
            size=2,
            typical=2e-4,
            range=Plausible.even(
                2e-4,
                5e-3,
                'derived: a rail laid to 0.1 mm on a metre; range derived: 2.5 mm on a metre is '
                'seen by the eye',
            ),
        ),
    )

    def per_unit(self, view: View) -> list[Shift]:
        """Return how the tool moves with the carriage."""
        i = view.robot.index(self.joint)
        x, y, _ = carriage_axes(view, i)
        bow = 0.5 * view.joint(i) ** 2
        return [carried(view, i, bow * axis, None) for axis in (x, y)]

    def remedy(self, robot: Robot) -> str:
        x, y = np.asarray(self.curvature) * 0.125e3
        return (
            f'Align the guide of {self.site}: over a metre it is bent by {size(float(x))} mm along x '
            f'and {size(float(y))} mm along y of its row; until then compensate the motion.'
        )
