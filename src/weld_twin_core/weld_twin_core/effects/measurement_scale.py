# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Measurement scale: the instrument reads (1 + scale) times the position in its own frame."""

from dataclasses import dataclass

from ..arm.channels import Shift
from ..arm.robot import Robot
from .effect import LinearEffect
from .hooks import Traits
from .registry import register
from .view import Parameter, Plausible, Stage, Value, View
from .wording import number


@register
@dataclass(frozen=True, eq=False)
class MeasurementScale(LinearEffect):
    """A wrong unit of length of the measuring system, about the origin of its frame."""

    scale: Value = 0.0

    name = 'measurement_scale'
    traits = Traits(
        title='scale error of the instrument',
        meaning="the instrument's millimetre is too long or too short",
        entered='the scale of the instrument',
        depends_on='place',
        place='instrument',
        common=False,
    )
    of = 'robot'
    stage = Stage.POSE
    parameters = (
        Parameter(
            'scale',
            '-',
            typical=5e-5,
            range=Plausible.even(
                1e-4,
                2e-3,
                'trackers are within 6 um/m across the beam (user manual of an AT9xx, section 2.8.2); '
                'range derived: 2 mm/m is a wrong length, not an instrument',
            ),
        ),
    )

    def per_unit(self, view: View) -> list[Shift]:
        """Return the position."""
        position = view.frames.position
        return [{('pose', k): position[..., k] for k in range(3)}]

    def remedy(self, robot: Robot) -> str:
        return (
            'Have the instrument calibrated, or correct for air temperature: lengths read '
            f'{number(self._plain("scale") * 1e3)} mm per m too long.'
        )
