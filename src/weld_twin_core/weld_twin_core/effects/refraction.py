# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Refraction: the line of sight of a tracker bends where the air is warmer on one side.

Light bends towards colder, denser air, with a curvature of the gradient of the refractive index
over the index. Over a distance L across the gradient the target seems half of curvature * L^2 off,
towards the warmth; along it, the light runs slower or faster than at the instrument. With r from
the instrument to the target and gradient G, both together are
``p -> p + _BEND (r.r G / 2 - (G.r) r)``.

The place of the instrument is the origin of the measuring frame unless it is given. Another place
only adds a turn, a shift and a scale, as multiplying out shows, which a base pose and a scale of
the instrument take up; what bends is the same. A frame whose origin is nearer than any instrument
could stand is not the instrument's own, and with the place unknown nothing is considered.
"""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Real

import numpy as np

from ..errors import ModelError
from .effect import LinearEffect, Traits, register
from .view import Parameter, Robot, Shift, Stage, Value, View
from .wording import numbers

_BEND = 7.86e-4 * 101.325 / 293.15**2
"""By how much the refractive index of air falls [1/K], 9.27e-7 at 20 degC and 101.325 kPa:
n = 1 + 7.86e-4 p / T with p in kPa, less what humidity does (emtoolbox.nist.gov, refractive index
of air calculator, appendix B)."""
_NEAREST = 1.5
"""Distance [m] that the tool keeps from an instrument: nearer, most arms could reach into it, and
the origin is not the instrument's. The bundled arms reach 0.5 to 3 m from their base."""


@register
class Refraction(LinearEffect):
    """
    Air that warms by ``warming`` [K/m] along each axis of the measuring frame bends the sight.

    ``instrument`` is where the line of sight starts, three numbers [m] in the measuring frame;
    left out, its origin.
    """

    warming: Value = (0.0, 0.0, 0.0)
    instrument: Sequence[float] | None = None

    name = 'refraction'
    traits = Traits(
        title='bent line of sight',
        meaning='warm air bends the beam of the instrument',
        formula='p → p + κ (r·r warming / 2 − (warming·r) r), r from the instrument (the '
        "world's origin) to p, κ = 9.27e-7 1/K for air",
        apart={
            'base_pose': 'measure from a second place of the instrument',
        },
        entered='warm air bent the line of sight',
        depends_on='place',
        place='instrument',
        common=False,
    )
    of = 'robot'
    stage = Stage.POSE
    parameters = (
        Parameter('warming', 'K/m', size=3, typical=1.0).plausible(
            (3.0, 30.0),
            'in still air a line of sight bends by 0.2 mm over 12 m (0.008 in over 40 ft; '
            'Hamar Laser, Stealth series, appendix D, manualshive.com), 3 K/m; range '
            'derived: ten times that is air beside a furnace',
        ),
    )
    options = ('instrument',)

    def check(self, robot: Robot) -> None:
        super().check(robot)
        place = self.instrument
        if place is not None and (
            isinstance(place, str)
            or len(place) != 3
            or not all(isinstance(x, Real) for x in place)
        ):
            raise ModelError(f'refraction: instrument must be three numbers in m, got {place!r}')

    def per_unit(self, view: View) -> list[Shift]:
        """Return how far off the target seems for one kelvin a metre along each axis."""
        sight = view.frames.position - (0.0 if self.instrument is None else self.instrument)
        across = 0.5 * (sight**2).sum(axis=-1)
        seen = (
            _BEND * (across[..., None] * axis - sight[..., k, None] * sight)
            for k, axis in enumerate(np.eye(3))
        )
        return [{('pose', j): each[..., j] for j in range(3)} for each in seen]

    @classmethod
    def applicable(cls, view: View, joint: str | None) -> str | None:
        """Return why the data cannot show it: it has to be known where the instrument stands."""
        nearest = np.linalg.norm(view.frames.position, axis=-1).min(initial=np.inf)
        if nearest < _NEAREST:
            return (
                "the tool comes within 1.5 m of the measuring frame's origin, so that this is not "
                'where an instrument stands'
            )
        return super().applicable(view, joint)

    def remedy(self, robot: Robot) -> str:
        return (
            'Stir the air along the line of sight, shield it from heat or stand the instrument '
            f'nearer: the air warms by ({numbers(self.warming)}) K/m along x, y, z and bends it.'
        )
