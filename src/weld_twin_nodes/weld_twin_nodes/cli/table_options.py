# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Options that say how tables of measurements are read, and what is read by them."""

from __future__ import annotations

import argparse
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

from .options import cameras_of

if TYPE_CHECKING:
    from weld_twin_core.arm.robot import Robot
    from weld_twin_msgs_py.tables import Table, TableOptions

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
    held = Measurements(touches.joints.t, np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1)))
    note = f'{count} postures with one bar clamped at both ends; diagnose with --align tool'
    said = (*(one for one in said if 'touch' not in one), note)
    return Table(replace(touches, contacts=None, measured=held, notes=said), said)
