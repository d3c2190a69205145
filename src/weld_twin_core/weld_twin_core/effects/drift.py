# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Drift: the frame creeps at a constant rate from the recording's first stamp on."""

import numpy as np

from .effect import LinearEffect, Traits, register
from .view import Parameter, Robot, Shift, Stage, Value, View
from .wording import numbers


@register
class Drift(LinearEffect):
    """A creeping fixture, instrument or pedestal."""

    xyz_rate: Value = (0.0, 0.0, 0.0)

    name = 'drift'
    traits = Traits(
        title='drift of the frame',
        meaning='everything measured creeps with time',
        formula='p → p + xyz_rate (t − t_first)',
        apart={
            'thermal_growth': 'measure a fixed point beside the arm while it works',
        },
        entered='what the frame stands on, or of the temperature',
        depends_on='time',
        place='base',
        common=False,
    )
    of = 'robot'
    stage = Stage.POSE
    parameters = (
        Parameter('xyz_rate', 'm/s', size=3, typical=1e-6).plausible(
            (5e-6, 1e-4),
            'derived: 6 mm in a minute is a fixture that falls; trackers drift by tenths of a '
            'millimetre in two hours (akjournals.com, 606/15/3 p. 60)',
        ),
    )
    needs = frozenset({'time'})

    def per_unit(self, view: View) -> list[Shift]:
        return [{('pose', k): view.elapsed} for k in range(3)]

    def remedy(self, robot: Robot) -> str:
        each = numbers(np.asarray(self.xyz_rate) * 3.6e6)
        return (
            f'Find what creeps (fixture, tripod, pedestal): ({each}) mm per hour along x, y, z; '
            'measure a fixed point now and then.'
        )
