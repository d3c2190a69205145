# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The joint columns of a table: each in its unit, counted as the model counts them."""

import re
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.recording import Counted

from .cells import Cells
from .header import unit_of
from .unit_guess import METRES, RADIANS, factor, largest
from .words import TableOptions, flag_of

CLEARLY = 3.0
"""Other units than the usual guess are taken where the measured positions fit them so many times
better; between degrees and radians, or millimetres and metres, it is a hundred and more."""
FITS = 0.05
"""A typical misfit below this share of the way of the tool: joints and positions belong together."""
ENOUGH = 8
"""Stations from which a fit of base and tool can tell one unit from another."""
_TURN = 2.0 * np.pi + 1e-3
"""No joint of most arms goes further [rad]."""
_LONGEST = 20.0
"""A slide is shorter [m]; a larger number is in millimetres."""


class Units(NamedTuple):
    """Units of what turns and of what slides, where the header of a column says nothing."""

    angle: str
    slide: str


def station_joints(
    cells: Cells, robot: Robot, names: tuple[str, ...], options: TableOptions, said: list[str]
) -> Array:
    """Return `joint_angles` of stations; refuses a row that lacks one."""
    q = joint_angles(cells, robot, names, options, said)
    gaps = np.flatnonzero(~np.isfinite(q).all(axis=1))
    if gaps.size:
        line = cells.lines[gaps[0]]
        raise DataError(f"table '{cells.path}' line {line} has an empty joint angle")
    return q


Judge = Callable[[Array], float]
"""Joint positions as the model counts them, shape (M, n) [rad, m], to how far off they are."""


def joint_angles(
    cells: Cells,
    robot: Robot,
    names: tuple[str, ...],
    options: TableOptions,
    said: list[str],
    units: Units | None = None,
) -> Array:
    """
    Return the joint columns of a table, shape (M, n) [rad or m], and say how they were read.

    Where neither names nor ``units`` tell it, the size of the numbers does.
    """
    q = cells.stack(names)
    if units is None:
        units = joint_units(q, robot, names, options, said)
    q = _in_model(q, units, robot, names, options, said)
    outside = ((q < robot.lower - 1e-6) | (q > robot.upper + 1e-6)).any(axis=1)
    if outside.any():
        said.append(f'{outside.sum()} rows leave the joint limits of robot {robot.name!r}')
    return q


def joint_units(
    q: Array,
    robot: Robot,
    names: Sequence[str],
    options: TableOptions,
    said: list[str],
    judge: Judge | None = None,
) -> Units:
    """Return the units of the columns without one of their own."""
    turning, sliding = ~robot.prismatic, robot.prismatic
    units = [_given_unit(names, kind, given) for kind, given in _kinds(robot, options)]
    angle = 'deg' if largest(q[:, turning]) > _TURN else 'rad'
    usual = Units(units[0] or angle, units[1] or _usual_slide(q, robot))
    chosen = usual
    if judge is not None and len(q) >= ENOUGH:
        open_angle = units[0] is None and bool(turning.any())
        open_slide = units[1] is None and bool(sliding.any())
        others = [
            Units(angle, slide)
            for angle in (('rad', 'deg') if open_angle else (usual.angle,))
            for slide in (('m', 'mm') if open_slide else (usual.slide,))
        ]
        chosen = _fitting(q, usual, others, robot, names, options, judge)
    fitted = ' (the measured positions fit no other unit)' if chosen != usual else ''
    if units[0] is None and turning.any():
        word = {'deg': 'degrees', 'rad': 'radians'}[chosen.angle]
        size = largest(q[:, turning])
        said.append(f'joint angles are in {word} (up to {size:.4g}){fitted}')
    if units[1] is None and sliding.any():
        size = largest(q[:, sliding])
        said.append(
            f'sliding joints are in {chosen.slide} (up to {size:.4g}){fitted}; --slide-unit decides'
        )
    return chosen


def _in_model(
    q: Array,
    units: Units,
    robot: Robot,
    names: Sequence[str],
    options: TableOptions,
    said: list[str],
) -> Array:
    """Return joint columns, shape (M, n), in SI units and as the model counts them."""
    scale = np.empty(robot.n)
    for k, (name, slides) in enumerate(zip(names, robot.prismatic, strict=True)):
        table, given, usual = (
            (METRES, options.slide_unit, units.slide)
            if slides
            else (RADIANS, options.angle_unit, units.angle)
        )
        what = f'{robot.joint_names[k]}, which {"slides" if slides else "turns"}'
        scale[k] = factor(table, given or unit_of(name) or usual, name, what)
    return as_modelled(q * scale, robot, options, said)


def _kinds(robot: Robot, options: TableOptions) -> tuple[tuple[Sequence[bool], str | None], ...]:
    turns = [not slides for slides in robot.prismatic]
    return (
        (turns, options.angle_unit),
        ([bool(slides) for slides in robot.prismatic], options.slide_unit),
    )


def _given_unit(names: Sequence[str], kind: Sequence[bool], given: str | None) -> str | None:
    """Return the unit that an option or the header gives one of some columns."""
    own = (unit_of(name) for name, meant in zip(names, kind, strict=True) if meant)
    return given or next((unit for unit in own if unit), None)


def _usual_slide(q: Array, robot: Robot) -> str:
    slides = robot.prismatic
    if not slides.any():
        return 'm'
    values, lower, upper = q[:, slides], robot.lower[slides], robot.upper[slides]
    inside = {
        unit: bool(((values * METRES[unit] >= lower) & (values * METRES[unit] <= upper)).all())
        for unit in ('m', 'mm')
    }
    if largest(values) > _LONGEST or (inside['mm'] and not inside['m']):
        return 'mm'
    return 'm'


def _fitting(
    q: Array,
    usual: Units,
    others: Sequence[Units],
    robot: Robot,
    names: Sequence[str],
    options: TableOptions,
    judge: Judge,
) -> Units:
    """Return the usual units, or others that the measured positions fit far better."""
    if len(others) < 2:
        return usual
    off = {
        units: judge(_in_model(q, units, robot, names, options, [])) for units in (usual, *others)
    }
    best = min(off, key=lambda units: off[units])
    fits = off[best] < FITS and off[best] * CLEARLY < off[usual]
    return best if fits else usual


def as_modelled(q: Array, robot: Robot, options: TableOptions, said: list[str]) -> Array:
    """
    Return joint columns, shape (M, n) [rad or m], counted as the model counts them.

    Signs come first, then what one joint adds to another, then offsets in the model's sense.
    """
    for name in ('joint_signs', 'joint_offsets'):
        given = getattr(options, name)
        if given is not None and len(given) != robot.n:
            raise DataError(f'{flag_of(name)} needs {robot.n} numbers, got {len(given)}')
    if options.joint_signs is not None:
        q = q * np.array(options.joint_signs)
        said.append('signs of the joints are ' + _listed(options.joint_signs))
    if options.coupled is not None:
        q = _coupled(q, options.coupled)
        said.append(f'joints are coupled by {options.coupled}')
    if options.joint_offsets is not None:
        q = q + np.array(options.joint_offsets) * np.where(robot.prismatic, 1e-3, np.pi / 180.0)
        said.append(
            f'added to the joints are {_listed(options.joint_offsets)} deg (mm for a slide)'
        )
    return q


def counted(robot: Robot, options: TableOptions) -> Counted | None:
    """Return how the controller counts the joints; None where it does as the robot."""
    zero, *ones = as_modelled(np.eye(robot.n + 1, robot.n, -1), robot, options, []) + 0.0
    matrix = np.column_stack(ones) - zero[:, None]
    same = np.array_equal(matrix, np.eye(robot.n)) and not zero.any()
    return None if same else Counted(matrix, zero)


def _listed(values: tuple[float, ...]) -> str:
    return ', '.join(f'{value:g}' for value in values)


def _coupled(q: Array, text: str) -> Array:
    """Return joint columns after '3+2': what the model's third joint is, the second added."""
    match = re.fullmatch(r'\s*(\d+)\s*([+-])\s*(\d+)\s*', text)
    count = q.shape[1]
    one, other = (int(match[1]), int(match[3])) if match else (0, 0)
    if match is None or not (1 <= one <= count and 1 <= other <= count) or one == other:
        raise DataError(f'--coupled needs two joints such as 3+2 or 3-2, got {text!r}')
    out = np.array(q)
    out[:, one - 1] += (1.0 if match[2] == '+' else -1.0) * q[:, other - 1]
    return out
