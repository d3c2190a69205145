# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Numbers with the units people read: mm, degrees, ms."""

from __future__ import annotations

import numpy as np

from ...arrays import Array


def number(value: float, digits: int = 3) -> str:
    """Return a signed number with a few significant digits and no exponent."""
    if value == 0.0 or not np.isfinite(value):
        return '0'
    places = max(0, digits - 1 - int(np.floor(np.log10(abs(value)))))
    return f'{value:+.{min(places, 9)}f}'


def size(value: float, digits: int = 3) -> str:
    """Return a number without its sign."""
    return number(abs(value), digits).lstrip('+')


def metres(value: float) -> str:
    """Return a signed length [m] in mm."""
    return f'{number(value * 1e3)} mm'


def radians(value: float) -> str:
    """Return a signed angle [rad] in degrees and mrad."""
    return f'{number(np.degrees(value))} deg ({number(value * 1e3)} mrad)'


def frame(step: Array) -> str:
    """Return a displacement [m] and a turn [rad] of a frame, shape (6,), in mm and degrees."""
    moved = ', '.join(f'{float(v) * 1e3:+.3f}' for v in step[:3])
    turned = ', '.join(f'{float(np.degrees(v)):+.4f}' for v in step[3:])
    return f'({moved}) mm and ({turned}) deg about x, y, z'
