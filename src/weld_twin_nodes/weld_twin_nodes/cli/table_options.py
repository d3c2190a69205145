# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Options that say how tables of measurements are read, and what is read by them."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import TYPE_CHECKING

from .options import cameras_of
from .parsing import Adder

if TYPE_CHECKING:
    from weld_twin_core.arm.robot import Robot
    from weld_twin_msgs_py.tables import Table, TableOptions

COLUMNS = ('joint', 'position', 'target', 'difference', 'rotation', 'sigma')
"""Options that take several columns."""


def add_table_options(parser: argparse.ArgumentParser, *, rare: bool = False) -> None:
    """Add the options; each is an attribute of `weld_twin_msgs_py.tables.TableOptions` or a file."""
    add = Adder(parser, 'tables' if rare else '', rare=rare)
    text = 'both ends of the chain hold one bar, and the table has joint angles alone'
    add('--clamped', text, rare=True)
    text = 'the table has the joints alone; this one has what the instrument measured'
    add('--measured', 'FILE', text)
    text = 'added to the stamps of --measured'
    add('--clock-offset', 'S', text, type=float, default=0.0, rare=True)
    _add_units(parser, rare)
    _add_reading(parser)
    _add_counting(parser, rare)


def _add_units(parser: argparse.ArgumentParser, rare: bool) -> None:
    add = Adder(parser, 'where the header does not tell', rare=rare)
    add('--length-unit', 'unit of lengths', choices=('m', 'mm'))
    add('--angle-unit', 'unit of the joint angles', choices=('rad', 'deg'))
    add('--slide-unit', 'unit of joints that slide', choices=('m', 'mm'), rare=True)
    add('--rotation-unit', 'unit of measured angles', choices=('rad', 'deg'), rare=True)
    text = 'order of the angles: XYZ, ZYX, ... (intrinsic), or rotvec'
    add('--rotation', 'ORDER', text, rare=True)


def _add_reading(parser: argparse.ArgumentParser) -> None:
    add = Adder(parser, 'how to read the table', rare=True)
    for name in COLUMNS:
        add(f'--{name}-columns', 'A,B,C', f'columns of the {name}', type=_names)
    add('--temperature-column', 'A', 'column of the temperature')
    add('--time-column', 'A', 'column of the stamps')
    text = 'whether measured is target plus or minus difference'
    add('--difference', text, choices=('add', 'subtract'), default='add')
    add('--positions-only', 'do not read orientations')
    text = 'rows to leave out; the first row under the header is 1'
    add('--skip-rows', 'N,N', text, type=_numbers, default=())
    add('--marker', 'NAME', 'what is meant, where an export has several markers')
    add('--delimiter', 'SIGN', 'comma, semicolon or tab')
    add('--decimal', 'sign of decimals', choices=('.', ','))


def _add_counting(parser: argparse.ArgumentParser, rare: bool) -> None:
    add = Adder(parser, 'how the controller counts its joints', rare=rare)
    text = '-1 for every joint that the controller counts the other way than the model'
    add('--joint-signs', '1,-1,...', text, type=_floats)
    text = 'added to every joint [deg, mm for a slide], such as 0,-90,90,0,0,0'
    add('--joint-offsets', 'DEG,DEG,...', text, type=_floats)
    text = "the model's joint 3 is that of the table plus joint 2; 3-2 takes it off"
    add('--coupled', '3+2', text)


def table_of(args: argparse.Namespace, robot: Robot, file: str) -> Table:
    """
    Return what a table holds, with a sentence for everything that was assumed.

    Parameters
    ----------
    args : argparse.Namespace
        With the options of tables, of cameras, and `contacts`.

    Raises
    ------
    DataError
        It cannot be read so; the sentence says what, where and how to mend it.

    """
    from dataclasses import fields

    from weld_twin_msgs_py.files.artefact_file import read_artefact
    from weld_twin_msgs_py.tables import (
        TableOptions,
        read_contacts,
        read_pixels,
        read_table,
        read_two_tables,
    )

    options = TableOptions(**{f.name: getattr(args, f.name) for f in fields(TableOptions)})
    if args.contacts is not None:
        return read_contacts(file, robot, read_artefact(args.contacts), options)
    if args.clamped:
        return _clamped(file, robot, options)
    if args.camera or args.target:
        return read_pixels(file, robot, *cameras_of(args), options)
    if args.measured is None:
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
    held = Measurements(touches.joints.t, np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1)))
    note = f'{count} postures with one bar clamped at both ends; diagnose with --align tool'
    said = (*(one for one in said if 'touch' not in one), note)
    return Table(replace(touches, contacts=None, measured=held, notes=said), said)


def _names(text: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in text.split(','))


def _floats(text: str) -> tuple[float, ...]:
    return tuple(float(part) for part in text.split(','))


def _numbers(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in text.split(','))
