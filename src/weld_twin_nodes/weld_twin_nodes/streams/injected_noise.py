# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The injector's measurement noise, the same one sample at a time as in bulk."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.effects import Effect
from weld_twin_core.effects.measurement import MeasurementNoise


class Noise:
    """Draws for each `measurement_noise` of a list of effects from a stream of its own."""

    def __init__(self, effects: Iterable[Effect], seed: int) -> None:
        self._seed = seed
        self._generators: list[np.random.Generator] = []
        self.change(effects)

    def change(self, effects: Iterable[Effect]) -> None:
        """Take other effects; streams that are running go on."""
        self._effects = [e for e in effects if isinstance(e, MeasurementNoise)]
        for k in range(len(self._generators), len(self._effects)):
            self._generators.append(np.random.default_rng([self._seed, k]))

    def draw(self, samples: int) -> Array:
        """Return errors of measured positions, shape (samples, 3) [m]."""
        total = np.zeros((samples, 3))
        for effect, generator in zip(self._effects, self._generators, strict=False):
            total += effect.draw(samples, generator)
        return total
