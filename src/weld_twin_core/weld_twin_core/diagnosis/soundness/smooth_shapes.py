# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Smooth changes in time that a step has to beat: settling, creeping, swaying."""

from __future__ import annotations

import numpy as np

from ...arrays import Array

CONSTANTS = np.geomspace(0.05, 0.7, 7)
"""Time constants of settling, as shares of the recording."""


def other_shapes(age: Array) -> list[Array]:
    """Return smooth shapes over age (M,), from 0 to 1, that are no settling, each (M,)."""
    waves = [wave(n * np.pi * age) for n in (1, 2) for wave in (np.sin, np.cos)]
    late = [np.exp(-(1.0 - age) / constant) for constant in CONSTANTS]
    return [age, age**2, *late, *waves]


def smooth_shapes(age: Array) -> list[Array]:
    """Return smooth shapes over age (M,), from 0 to 1, settling among them, each (M,)."""
    return [*(np.exp(-age / constant) for constant in CONSTANTS), *other_shapes(age)]
