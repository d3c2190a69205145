# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Options of the commands that read or write robot programs."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from weld_twin_core.errors import DataError

if TYPE_CHECKING:
    from weld_twin_core.arm.robot import Robot
    from weld_twin_core.arrays import Array
    from weld_twin_msgs_py.programs import Context
    from weld_twin_msgs_py.programs.controllers import Cell

_UNITS = {'mm': 1e-3, 'um': 1e-6, 'm': 1.0, 'deg': 0.017453292519943295, 'rad': 1.0}
PROGRAM = """
how the numbers of a program are meant:
rare:
--tool NAME=X,Y,Z,...    numbers of a tool that the program only names, as the controller shows them
                         (mm and degrees, ABB with a quaternion, Universal Robots in m and rad); may
                         be given again
--base NAME=X,Y,Z,...    the same of a base (user frame, work object); may be given again
--pulses-per-degree N,N,...  of every axis of a Yaskawa arm whose points are in pulses
--external E=JOINT,...   which joint of the robot file each external axis is, such as
                         E1=rail,E2=-tilt (KUKA), eax_a=rail (ABB), GP2.J1=tilt (FANUC); a minus
                         where it counts the other way
--on-positioner NAME,...  bases that go along with the positioner, where the program does not say; or
                         none
--world X,Y,Z,...        where a track begins in the controller's world, for positions in frames that
                         stand still
"""
TRIGGER = """
rare:
--trigger N              digital output that tells the instrument when to measure [default: 1]
"""


def check_program(args: argparse.Namespace) -> None:
    """Refuse a language that there is not, and an output that no controller has."""
    from weld_twin_msgs_py.programs.writing import WRITERS

    if args.controller not in WRITERS:
        raise DataError(
            f'--controller: there is no language {args.controller!r}; known are '
            + ', '.join(WRITERS)
        )
    if not 0 <= args.trigger <= 9999:
        raise DataError('--trigger must be the number of an output')


def context_of(args: argparse.Namespace, robot: Robot, language: str) -> Context:
    """Return the robot and frames of a program; its language says how --tool and --base are written."""
    import numpy as np

    from weld_twin_msgs_py.programs import Context, controller_of

    pulses = None
    if args.pulses_per_degree:
        pulses = np.array(_numbers(args.pulses_per_degree, '--pulses-per-degree'))
        if pulses.size != robot.n or not (pulses != 0.0).all():
            raise DataError(f'--pulses-per-degree needs {robot.n} numbers that are not zero')
    tools = _frames(args.tool, '--tool', language)
    bases = _frames(args.base, '--base', language)
    cell = _cell(args, language)
    return Context(robot, controller_of(robot, language, tools, bases, cell), pulses)


def _cell(args: argparse.Namespace, language: str) -> Cell:
    from weld_twin_msgs_py.programs.controllers import Cell

    along = None
    if args.on_positioner:
        names = {name.strip().lower() for name in args.on_positioner.split(',')}
        along = frozenset(names - {'none', ''})
    world = _frames([f'world={args.world}'], '--world', language) if args.world else {}
    return Cell(args.external, along, world.get('world'))


def _frames(given: Sequence[str], option: str, language: str) -> dict[str, Array]:
    from weld_twin_msgs_py.programs.languages import pose_notation

    notation = pose_notation(language)
    count = len(notation.name.split())
    out = {}
    for text in given:
        name, sign, numbers = text.partition('=')
        values = _numbers(numbers, option)
        if not sign or not name or len(values) != count:
            raise DataError(f'{option} needs NAME={",".join(notation.name.split())}, got {text!r}')
        out[name] = notation.value(values)
    return out


def _numbers(text: str, option: str) -> list[float]:
    try:
        values = [float(part) for part in text.split(',')]
    except ValueError:
        raise DataError(f'{option} needs numbers with commas between, got {text!r}') from None
    if not all(abs(value) < 1e9 for value in values):
        raise DataError(f'{option} needs finite numbers, got {text!r}')
    return values


def quantity(text: str, units: Sequence[str], option: str) -> float:
    """
    Return a size with its unit, such as ``2mm`` or ``0.5deg``, in SI.

    Of ``units`` the first is meant where none is written. A DataError names the ``option`` where the
    text is no size in one of them.
    """
    result = re.fullmatch(r'\s*([\d.]+(?:[eE][-+]?\d+)?)\s*([a-z]*)\s*', text)
    unit = result[2] or units[0] if result else ''
    try:
        value = float(result[1]) if result else -1.0
    except ValueError:
        value = -1.0
    if unit not in units or not 0.0 <= value < 1e9:
        raise DataError(f'{option} needs a size in {" or ".join(units)}, got {text!r}')
    return value * _UNITS[unit]


def start_of(args: argparse.Namespace, robot: Robot) -> Array | None:
    """Return the joint positions of --start, degrees as written, in the model's units."""
    import numpy as np

    if not args.start:
        return None
    values = np.array(_numbers(args.start, '--start'))
    if values.size != robot.n:
        raise DataError(f'--start needs {robot.n} joint positions, got {values.size}')
    q = np.where(robot.prismatic, values * 1e-3, np.radians(values))
    robot.check_positions(q)
    return np.asarray(q)
