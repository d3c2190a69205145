# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Degrees or radians, millimetres or metres: from the header, else from what the arm can do."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

METRES = {'m': 1.0, 'mm': 1e-3, 'cm': 1e-2, 'um': 1e-6, 'in': 0.0254, 'ft': 0.3048}
"""Lengths a table may be in."""
RADIANS = {'rad': 1.0, 'deg': np.pi / 180.0, 'mrad': 1e-3}
"""Angles a table may be in."""
_WIDEST = 20.0
"""Spread [m] of measured positions beyond that of any cell with one robot."""
_DOUBT = 6.0
"""The spread of the measurements may differ from the arm's own by this factor."""


def largest(values: Array) -> float:
    """Return the largest size of some numbers, zero for none; gaps do not count."""
    return float(np.nanmax(abs(values), initial=0.0))


def factor(known: Mapping[str, float], unit: str, column: str, what: str) -> float:
    """
    Return what a column is multiplied with.

    Raises DataError: the unit is that of something else.

    known: units that fit, and what they are in SI.
    unit: that the header or the user gives.
    column, what: for people: the column, and what it is taken for.
    """
    if unit not in known:
        raise DataError(
            f'column {column!r} is taken for {what}, and its unit {unit!r} does not fit; name '
            'the right columns or units with the options of import'
        )
    return known[unit]


def angle_unit(values: Array, given: str | None, what: str) -> tuple[str, str]:
    """Return the unit of angles and the sentence that says how it was found."""
    if given is not None:
        return given, ''
    size = largest(values)
    if size > 2.0 * np.pi + 1e-3:
        return 'deg', f'{what} are in degrees (up to {size:.4g})'
    return 'rad', f'{what} are in radians (none beyond {size:.3g})'


def length_unit(position: Array, robot: Robot, q: Array, given: str | None) -> tuple[str, str]:
    """
    Return the unit of the measured positions and the sentence that says how it was found.

    The spread of the measurements must be that of the poses the joints give, whatever frame the
    instrument has. Where neither unit fits, columns are mixed up: what no cell spans in metres is
    then taken for millimetres.
    """
    if given is not None:
        return given, ''
    own = _spread(forward(robot, q)[:, :3, 3])
    theirs = _spread(position)
    for unit in ('m', 'mm'):  # inches must not pass for centimetres
        factor = METRES[unit]
        if own / _DOUBT < theirs * factor < own * _DOUBT:
            return unit, f'positions are in {unit} (they spread as far as the arm moves)'
    unit = 'mm' if theirs > _WIDEST else 'm'
    return unit, (
        f'positions spread over {theirs:.4g}, the arm moves over {own:.4g} m: neither metres nor '
        f'millimetres fit, {unit} is taken; --length-unit decides, or the columns are not what '
        'they seem'
    )


def _spread(position: Array) -> float:
    return float(np.sqrt(((position - position.mean(axis=0)) ** 2).sum(axis=1).mean()))
