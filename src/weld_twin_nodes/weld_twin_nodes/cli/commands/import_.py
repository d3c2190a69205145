# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Make a bag of a table of what was measured, seen or touched.

Delimiter, units and columns are read from the table where they are plain, and every guess is
printed; an option settles what is not. Lists of columns are separated by commas. For pixels of
cameras give --camera and --target; weld-twin detect makes a table of images.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import TYPE_CHECKING

from ..options import add_bag_output, add_cameras, add_robot, cameras_of, robot_of
from ..parsing import Adder

if TYPE_CHECKING:
    from weld_twin_core.arm.robot import Robot
    from weld_twin_core.arrays import Array
    from weld_twin_core.recording import Recording
    from weld_twin_msgs_py.tables import Table, TableOptions

EXAMPLE = 'weld-twin import examples/files/measurements.csv --robot ur5 --out my_cell'
COLUMNS = ('joint', 'position', 'target', 'difference', 'rotation', 'sigma')
"""Options that take several columns."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options; each is an attribute of `weld_twin_msgs_py.tables.TableOptions`."""
    add = Adder(parser)
    add('file', 'FILE.csv', 'table of text')
    add_robot(parser)
    add_bag_output(parser)
    text = 'FILE.csv has joint angles and what was touched; this file describes it'
    add('--contacts', 'ARTEFACT.yaml', text)
    text = 'both ends of the chain hold one bar, and FILE.csv has joint angles alone'
    add('--clamped', text, rare=True)
    text = 'FILE.csv has the joints alone; this one has what the instrument measured'
    add('--measured', 'FILE', text)
    text = 'added to the stamps of --measured'
    add('--clock-offset', 'S', text, type=float, default=0.0, rare=True)
    add('--table', 'CSV', 'also write every deviation from the twin', rare=True)
    add('--picture', 'PNG', 'also draw the deviations', rare=True)
    add_cameras(parser)
    _add_units(parser)
    _add_reading(parser)
    _add_counting(parser)


def _add_units(parser: argparse.ArgumentParser) -> None:
    add = Adder(parser, 'where the header does not tell')
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


def _add_counting(parser: argparse.ArgumentParser) -> None:
    add = Adder(parser, 'how the controller counts its joints')
    text = '-1 for every joint that the controller counts the other way than the model'
    add('--joint-signs', '1,-1,...', text, type=_floats)
    text = 'added to every joint [deg, mm for a slide], such as 0,-90,90,0,0,0'
    add('--joint-offsets', 'DEG,DEG,...', text, type=_floats)
    text = "the model's joint 3 is that of the table plus joint 2; 3-2 takes it off"
    add('--coupled', '3+2', text)


def run(args: argparse.Namespace) -> int:
    """Write the bag, say how the table was read and how far the nominal twin is off."""
    from dataclasses import fields

    from weld_twin_core.metrics.deviation import deviation_metrics
    from weld_twin_core.twin.twin import Twin
    from weld_twin_msgs_py.bags import write_recording
    from weld_twin_msgs_py.tables import TableOptions

    robot = robot_of(args)
    options = TableOptions(**{f.name: getattr(args, f.name) for f in fields(TableOptions)})
    if args.contacts is not None:
        return _touched(args, robot, options)
    recording, said = (_clamped if args.clamped else _read)(args, robot, options)
    measured = recording.measured
    assert measured is not None
    nominal = Twin(robot)
    expected = nominal.poses(recording, measured.t)
    off = measured.position - expected.position
    write_recording(
        args.out,
        recording,
        robot,
        twin=nominal.poses(recording),
        deviation=off,
        storage=args.storage,
        provenance={'source': args.file, 'assumptions': list(said)},
    )
    for sentence in said:
        print(sentence)
    if args.table or args.picture:
        _write_deviations(args, recording, off)
    kind = 'stations' if recording.joints.static else 'measurements along a motion'
    found = deviation_metrics(measured.position, expected.position)
    print(
        f'{args.out}: {found.samples} {kind}; from the nominal twin, base and tool frame not '
        f'fitted: RMS {found.rms_m * 1e3:.3f} mm, max {found.max_m * 1e3:.3f} mm'
    )
    return 0


def _read(args: argparse.Namespace, robot: Robot, options: TableOptions) -> Table:
    """Return the recording of one file, or of a log and what was measured beside it."""
    from weld_twin_msgs_py.tables import read_pixels, read_table, read_two_tables

    if args.camera or args.target:
        return read_pixels(args.file, robot, *cameras_of(args), options)
    if args.measured is None:
        return read_table(args.file, robot, options)
    return read_two_tables(args.file, args.measured, robot, options, args.clock_offset)


def _clamped(args: argparse.Namespace, robot: Robot, options: TableOptions) -> Table:
    """
    Return postures in which the tool was one thing with where the chain begins.

    The pose between them is the same in all, and is that of the tool, which is fitted: measured is
    none at all.
    """
    import numpy as np

    from weld_twin_core.contacts import Artefact, Contact
    from weld_twin_core.recording import Measurements
    from weld_twin_msgs_py.tables import Table, read_contacts

    touches, said = read_contacts(args.file, robot, Artefact((Contact('bar'),)), options)
    count = touches.joints.t.size
    held = Measurements(touches.joints.t, np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1)))
    note = f'{count} postures with one bar clamped at both ends; diagnose with --align tool'
    said = (*(one for one in said if 'touch' not in one), note)
    return Table(replace(touches, contacts=None, measured=held, notes=said), said)


def _touched(args: argparse.Namespace, robot: Robot, options: TableOptions) -> int:
    """Write the bag of a table of contacts, and say how far the nominal twin spreads."""
    from weld_twin_core.contacts import spreads
    from weld_twin_core.errors import ModelError
    from weld_twin_core.twin.twin import Twin
    from weld_twin_msgs_py.bags import write_recording
    from weld_twin_msgs_py.files.artefact_file import read_artefact
    from weld_twin_msgs_py.tables import read_contacts

    if args.table or args.picture:
        raise ModelError('--table and --picture need measured positions; contacts have none')
    artefact = read_artefact(args.contacts)
    recording, said = read_contacts(args.file, robot, artefact, options)
    provenance = {'source': args.file, 'assumptions': list(said)}
    write_recording(args.out, recording, robot, storage=args.storage, provenance=provenance)
    for sentence in said:
        print(sentence)
    assert recording.contacts is not None
    points = Twin(robot).poses(recording, recording.joints.t).position
    for label, each in spreads(recording.contacts, points).items():
        print(f'{label}: nominal twin {each.mean() * 1e3:.3f} mm off on average')
    print(f'{args.out}: {recording.contacts.size} postures; weld-twin diagnose takes the bag')
    return 0


def _write_deviations(args: argparse.Namespace, recording: Recording, off: Array) -> None:
    from ...offline import station_table

    if args.table:
        station_table.write_table(args.table, recording, off)
    if args.picture:
        station_table.draw(args.picture, recording, off)


def _names(text: str) -> tuple[str, ...]:
    return tuple(part.strip() for part in text.split(','))


def _floats(text: str) -> tuple[float, ...]:
    return tuple(float(part) for part in text.split(','))


def _numbers(text: str) -> tuple[int, ...]:
    return tuple(int(part) for part in text.split(','))
