# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The instrument: its unit of length, and its white noise, which is the floor and never a cause.

A wrong unit reads (1 + scale) times the position in the instrument's own frame.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from .effect import Effect, LinearEffect, Traits, register
from .view import Array, Parameter, Robot, Shift, Stage, Value, View
from .wording import number


@register
class MeasurementScale(LinearEffect):
    """A wrong unit of length of the measuring system, about the origin of its frame."""

    scale: Value = 0.0

    name = 'measurement_scale'
    traits = Traits(
        title='scale error of the instrument',
        meaning="the instrument's millimetre is too long or too short",
        formula="p → (1 + scale) p, about the world's origin",
        apart={
            'link_length': 'measure a bar of known length',
        },
        entered='the scale of the instrument',
        depends_on='place',
        place='instrument',
        common=False,
    )
    of = 'robot'
    stage = Stage.POSE
    parameters = (
        Parameter('scale', '-', typical=5e-5).plausible(
            (1e-4, 2e-3),
            'trackers are within 6 um/m across the beam (user manual of an AT9xx, section 2.8.2); '
            'range derived: 2 mm/m is a wrong length, not an instrument',
        ),
    )

    def per_unit(self, view: View) -> list[Shift]:
        position = view.frames.position
        return [{('pose', k): position[..., k] for k in range(3)}]

    def remedy(self, robot: Robot) -> str:
        return (
            'Have the instrument calibrated, or correct for air temperature: lengths read '
            f'{number(self._plain("scale") * 1e3)} mm per m too long.'
        )


@register
class MeasurementNoise(Effect):
    """Independent errors of ``sigma`` on each coordinate; drawn by the injector only."""

    sigma: Value = 0.0

    name = 'measurement_noise'
    traits = Traits(
        depends_on='constant',
        place='instrument',
        cause=False,
        formula='white noise on every coordinate of the measured position; the floor, never a '
        'cause',
    )
    of = 'robot'
    stage = Stage.NOISE
    parameters = (Parameter('sigma', 'm', typical=2e-5, lower=0.0, differentiable=False),)

    def displace(self, view: View) -> Shift:
        """Return nothing: the expected error is zero."""
        return {}

    def draw(self, samples: int, rng: np.random.Generator) -> Array:
        """Return errors of measured positions, shape (samples, 3) [m]."""
        return rng.normal(scale=float(self.sigma), size=(samples, 3))

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """Yield nothing: noise is no cause."""
        return ()
