# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The joint columns of a table: each in its unit, counted as the model counts them."""

import re
from collections.abc import Callable, Iterable
from itertools import product, starmap
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

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


Judge = Callable[[Array], float]
"""Joint positions as the model counts them, shape (M, n) [rad, m], to how far off they are."""


class JointColumns(NamedTuple):
    """The columns of a robot's joints, what a user says of them, and the sentences of what is found."""

    robot: Robot
    names: tuple[str, ...]
    options: TableOptions
    said: list[str]

    def stations(self, cells: Cells) -> Array:
        """Return `angles` of stations; refuses a row that lacks one."""
        q = self.angles(cells)
        gaps = np.flatnonzero(~np.isfinite(q).all(axis=1))
        if gaps.size:
            line = cells.lines[gaps[0]]
            raise DataError(f"table '{cells.path}' line {line} has an empty joint angle")
        return q

    def angles(self, cells: Cells, units: Units | None = None) -> Array:
        """
        Return the columns, shape (M, n) [rad or m], and say how they were read.

        Where neither names nor ``units`` tell it, the size of the numbers does.
        """
        robot, q = self.robot, cells.stack(self.names)
        q = self._in_model(q, self.units(q) if units is None else units)
        outside = ((q < robot.lower - 1e-6) | (q > robot.upper + 1e-6)).any(axis=1)
        if outside.any():
            self.said.append(
                f'{outside.sum()} rows leave the joint limits of robot {robot.name!r}'
            )
        return q

    def units(self, q: Array, judge: Judge | None = None) -> Units:
        """Return the units of the columns without one of their own, by their numbers (M, n)."""
        slides = self.robot.prismatic
        angle = self._given(~slides, self.options.angle_unit)
        slide = self._given(slides, self.options.slide_unit)
        size = largest(q[:, ~slides])
        usual = Units(
            angle or ('deg' if size > _TURN else 'rad'), slide or _usual_slide(q, self.robot)
        )
        open_angle, open_slide = angle is None and not slides.all(), slide is None and slides.any()
        chosen = usual
        if judge is not None and len(q) >= ENOUGH and (open_angle or open_slide):
            angles = ('rad', 'deg') if open_angle else (usual.angle,)
            others = product(angles, ('m', 'mm') if open_slide else (usual.slide,))
            chosen = self._fitting(q, usual, starmap(Units, others), judge)
        fitted = ' (the measured positions fit no other unit)' if chosen != usual else ''
        if open_angle:
            word = {'deg': 'degrees', 'rad': 'radians'}[chosen.angle]
            self.said.append(f'joint angles are in {word} (up to {size:.4g}){fitted}')
        if open_slide:
            self.said.append(
                f'sliding joints are in {chosen.slide} (up to {largest(q[:, slides]):.4g}){fitted}; '
                '--slide-unit decides'
            )
        return chosen

    def _given(self, meant: NDArray[np.bool_], option: str | None) -> str | None:
        """Return the unit that an option or the header gives one of some columns."""
        own = (unit_of(name) for name, one in zip(self.names, meant, strict=True) if one)
        return option or next((unit for unit in own if unit), None)

    def _fitting(self, q: Array, usual: Units, others: Iterable[Units], judge: Judge) -> Units:
        """Return the usual units, or others that the measured positions fit far better."""
        quiet = self._replace(said=[])
        off = {units: judge(quiet._in_model(q, units)) for units in (usual, *others)}
        best = min(off, key=lambda units: off[units])
        fits = off[best] < FITS and off[best] * CLEARLY < off[usual]
        return best if fits else usual

    def _in_model(self, q: Array, units: Units) -> Array:
        """Return columns, shape (M, n), in SI units and as the model counts them."""
        robot, options = self.robot, self.options
        scale = np.empty(robot.n)
        for k, (name, slides) in enumerate(zip(self.names, robot.prismatic, strict=True)):
            table, given, usual = (
                (METRES, options.slide_unit, units.slide)
                if slides
                else (RADIANS, options.angle_unit, units.angle)
            )
            what = f'{robot.joint_names[k]}, which {"slides" if slides else "turns"}'
            scale[k] = factor(table, given or unit_of(name) or usual, name, what)
        return as_modelled(q * scale, robot, options, self.said)


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
