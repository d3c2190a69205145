# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Options that say how tables of measurements and robot programs are read, and what is read by them."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

from weld_twin_core.errors import DataError

from .options import cameras_of

if TYPE_CHECKING:
    from weld_twin_core.arm.robot import Robot
    from weld_twin_core.arrays import Array
    from weld_twin_msgs_py.programs import Context
    from weld_twin_msgs_py.programs.controllers import Cell
    from weld_twin_msgs_py.tables import Table, TableOptions

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


TABLE = """
--measured FILE          the table has the joints alone; this one has what the instrument measured
rare:
--clamped                both ends of the chain hold one bar, and the table has joint angles alone
--clock-offset S         added to the stamps of --measured [default: 0]
where the header does not tell:
--length-unit {m,mm}     unit of lengths
--angle-unit {rad,deg}   unit of the joint angles
rare:
--slide-unit {m,mm}      unit of joints that slide
--rotation-unit {rad,deg}  unit of measured angles
--rotation ORDER         order of the angles: XYZ, ZYX, ... (intrinsic), or rotvec
how to read the table:
rare:
--joint-columns A,B,C    columns of the joint
--position-columns A,B,C  columns of the position
--target-columns A,B,C   columns of the target
--difference-columns A,B,C  columns of the difference
--rotation-columns A,B,C  columns of the rotation
--sigma-columns A,B,C    columns of the sigma
--temperature-column A   column of the temperature
--time-column A          column of the stamps
--difference {add,subtract}  whether measured is target plus or minus difference [default: add]
--positions-only         do not read orientations
--skip-rows N,N          rows to leave out; the first row under the header is 1
--marker NAME            what is meant, where an export has several markers
--delimiter SIGN         comma, semicolon or tab
--decimal SIGN           sign of decimals: . or ,
how the controller counts its joints:
--joint-signs 1,-1,...   -1 for every joint that the controller counts the other way than the model
--joint-offsets DEG,DEG,...  added to every joint [deg, mm for a slide], such as 0,-90,90,0,0,0
--coupled 3+2            the model's joint 3 is that of the table plus joint 2; 3-2 takes it off
"""
RARE_TABLE = f'tables:\n{TABLE}'.replace(':\n', ':\nrare:\n')
"""The same where tables are rarely given."""


def table_of(args: argparse.Namespace, robot: Robot, file: str) -> Table:
    """
    Return what a table holds, with a sentence for everything that was assumed.

    The options are those of `TABLE`, of cameras, and `contacts`. A DataError says what cannot be read
    so, where, and how to mend it.
    """
    from weld_twin_msgs_py.files.artefact_file import read_artefact
    from weld_twin_msgs_py.tables import (
        TableOptions,
        read_contacts,
        read_pixels,
        read_table,
        read_two_tables,
    )

    given: dict[str, Any] = {
        f.name: getattr(args, f.name) or f.default for f in fields(TableOptions)
    }
    options = TableOptions(**given)
    if args.contacts:
        return read_contacts(file, robot, read_artefact(args.contacts), options)
    if args.clamped:
        return _clamped(file, robot, options)
    if args.camera or args.target:
        return read_pixels(file, robot, *cameras_of(args), options)
    if not args.measured:
        return read_table(file, robot, options)
    return read_two_tables(file, args.measured, robot, options, args.clock_offset)


def _clamped(file: str, robot: Robot, options: TableOptions) -> Table:
    """
    Return postures in which the tool was one thing with where the chain begins.

    The pose between them is the same in all, and is that of the tool, which is fitted: measured is
    none at all.
    """
    import numpy as np

    from weld_twin_core.contacts import Artefact, Contact
    from weld_twin_core.recording import Measurements
    from weld_twin_msgs_py.tables import Table, read_contacts

    touches, said = read_contacts(file, robot, Artefact((Contact('bar'),)), options)
    count = touches.joints.t.size
    clamped = Measurements(
        touches.joints.t, np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1))
    )
    note = f'{count} postures with one bar clamped at both ends; diagnose with --align tool'
    said = (*(one for one in said if 'touch' not in one), note)
    return Table(replace(touches, contacts=None, measured=clamped, notes=said), said)
