# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Plain numbers that signs are made of: logarithms that end, and nothing that is not finite."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...arrays import Array

FAR = 1e3
"""Signs are cut here: nothing beyond says more."""
Numbers = dict[str, float]


def rms(values: Array) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt((values**2).mean()))


def log(value: float) -> float:
    """Return the decimal logarithm of what cannot be negative."""
    return float(np.log10(max(value, 1.0 / FAR)))


def log1(value: float) -> float:
    """Return a logarithm that is linear near zero, with the sign of the value."""
    return float(np.sign(value) * np.log10(1.0 + abs(value)))


def plain(numbers: Mapping[str, float]) -> Numbers:
    """Return finite numbers, cut where nothing beyond says more."""
    return {k: float(np.clip(np.nan_to_num(v, nan=0.0), -FAR, FAR)) for k, v in numbers.items()}
