# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Measurement noise: white noise of the instrument; the floor, never a cause."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..arm.channels import Shift
from ..arrays import Array
from .effect import Effect
from .hooks import Traits
from .registry import register
from .view import Parameter, Stage, Value, View


@register
@dataclass(frozen=True, eq=False)
class MeasurementNoise(Effect):
    """Independent errors of ``sigma`` on each coordinate; drawn by the injector only."""

    sigma: Value = 0.0

    name = 'measurement_noise'
    traits = Traits(depends_on='constant', place='instrument', cause=False)
    of = 'robot'
    stage = Stage.NOISE
    parameters = (Parameter('sigma', 'm', typical=2e-5, lower=0.0, differentiable=False),)

    def displace(self, view: View) -> Shift:
        """Return nothing: the expected error is zero."""
        return {}

    def gradient(self, view: View) -> list[Shift | None]:
        return [None]

    def draw(self, samples: int, rng: np.random.Generator) -> Array:
        """Return errors of measured positions, shape (samples, 3) [m]."""
        return rng.normal(scale=float(self.sigma), size=(samples, 3))

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """Yield nothing: noise is no cause."""
        return ()
