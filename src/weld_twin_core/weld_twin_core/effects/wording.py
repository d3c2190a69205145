# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Numbers with the units people read, and the phrases that sentences about effects share.

Where a joint stands at a reading, and what its zero has to become, is said here and nowhere else.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array

_LEAST_MM = 0.005
"""Shift of a frame [mm] that is not reported: no arm repeats that well."""
_FINE = 1e-3
"""Length [m] below which three decimals of mm are reported: a controller takes no more."""
_LEAST_DEG = 0.0003
"""Turn of a frame [degrees] that is not reported: a metre away it moves the tool by 0.005 mm."""

TURNED_ROUND = (
    'X is the recorded reading with its sign turned round: a controller that shows the joint as '
    'it was recorded needs the opposite sign in all of this.'
)
"""What a person has to know of a joint whose readings were recorded with the other sign."""


def number(value: float, digits: int = 3) -> str:
    """Return a signed number with a few significant digits and no exponent."""
    if value == 0.0 or not np.isfinite(value):
        return '0'
    places = max(0, digits - 1 - int(np.floor(np.log10(abs(value)))))
    return f'{value:+.{min(places, 9)}f}'


def numbers(values: ArrayLike) -> str:
    """Return signed numbers (K,) as a list in words; see `number`."""
    return ', '.join(number(float(value)) for value in np.asarray(values))


def size(value: float, digits: int = 3) -> str:
    """Return a number without its sign."""
    return number(abs(value), digits).lstrip('+')


def metres(value: float) -> str:
    """Return a signed length [m] in mm."""
    digits = f'{value * 1e3:+.3f}' if abs(value) < _FINE else number(value * 1e3)
    return f'{digits} mm'


def radians(value: float) -> str:
    """Return a signed angle [rad] in degrees."""
    return f'{number(np.degrees(value))} deg'


def turn(value: float) -> str:
    """Return an angle [rad] in degrees without its sign."""
    return f'{size(np.degrees(value))} deg'


def travel(value: float, *, sliding: bool) -> str:
    """Return how far a joint moves, [m] where it slides or [rad], without its sign."""
    return f'{size(value * 1e3)} mm' if sliding else turn(value)


def frame(step: Array, shifted: str, turned: str) -> str:
    """Return a step (6,) [m, rad] of a frame in mm and degrees, along and about whose axes."""
    moved = _axes(np.asarray(step[:3]) * 1e3, _LEAST_MM, 'mm along', 3)
    about = _axes(np.degrees(step[3:]), _LEAST_DEG, 'deg about', 4)
    parts = [f'{moved} {shifted}' if moved else '', f'{about} {turned}' if about else '']
    return ' and '.join(filter(None, parts)) or 'less than 0.005 mm'


def _axes(values: Array, least: float, words: str, places: int) -> str:
    """Return the parts that are worth entering, each with its axis."""
    parts = [
        f'{value:+.{places}f} {words} axis {axis}'
        for value, axis in zip(values.tolist(), 'xyz', strict=True)
        if abs(value) >= least
    ]
    return ', '.join(parts)


def controller_pose(pose: Array) -> str:
    """Return a frame as controllers take it: mm, and turns about fixed x, y and z in degrees."""
    place = ', '.join(f'{value * 1e3:.3f}' for value in pose[:3, 3])
    yaw = np.arctan2(pose[1, 0], pose[0, 0])
    pitch = np.arctan2(-pose[2, 0], np.hypot(pose[0, 0], pose[1, 0]))
    roll = np.arctan2(pose[2, 1], pose[2, 2])
    angles = ', '.join(f'{np.degrees(value):.4f}' for value in (roll, pitch, yaw))
    return f'x, y, z = ({place}) mm, turned by ({angles}) deg about them'


def further(offset: float, *, sliding: bool = False) -> str:
    """Return how much further than its reading a joint stands [rad or m], as ``+ 0.0456 deg``."""
    places, unit = (3, 'mm') if sliding else (4, 'deg')
    shown = offset * 1e3 if sliding else float(np.degrees(offset))
    return f'{"-" if shown < 0.0 else "+"} {abs(shown):.{places}f} {unit}'


def stands(joint: str, offset: float, *, sliding: bool = False) -> str:
    """Return where a joint stands at any reading, as a sentence; see `further`."""
    return f'At reading X {joint} stands at X {further(offset, sliding=sliding)}.'


def to_mend(offset: float, *, sliding: bool = False) -> str:
    """Return what mends a zero, by the readings before and after; see `further`."""
    return (
        'To mend: set its zero anew so that, with the joint left where it is, the reading X '
        f'becomes X {further(offset, sliding=sliding)}.'
    )
