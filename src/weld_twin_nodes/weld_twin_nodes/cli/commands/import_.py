# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables of joint angles and measured positions, poses, pixels or contacts into a bag.

Delimiter, units and columns are read from the table where they are plain, and every guess is
printed; an option settles what is not. Lists of columns are separated by commas.
"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from ..options import add_bag_output, add_cameras, add_robot, cameras_of, robot_of

if TYPE_CHECKING:
    from weld_twin_core.arm.robot import Robot
    from weld_twin_core.arrays import Array
    from weld_twin_core.recording import Recording
    from weld_twin_msgs_py.tables import Table, TableOptions

LISTS = ('joint', 'position', 'target', 'difference', 'rotation', 'sigma')
"""Options that take several columns."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options; each is an attribute of `weld_twin_msgs_py.tables.TableOptions`."""
    parser.add_argument('file', metavar='FILE.csv')
    add_robot(parser)
    add_bag_output(parser)
    parser.add_argument(
        '--contacts',
        metavar='ARTEFACT.yaml',
        help='the table holds joint angles and what was touched; this file describes it',
    )
    add_cameras(parser)
    parser.add_argument(
        '--measured',
        metavar='FILE',
        help='FILE.csv has the joints alone; this one has what the instrument measured',
    )
    parser.add_argument(
        '--clock-offset',
        type=float,
        default=0.0,
        metavar='S',
        help='added to the stamps of --measured',
    )
    parser.add_argument('--table', metavar='CSV', help='also write every deviation from the twin')
    parser.add_argument('--picture', metavar='PNG', help='also draw the deviations')
    _add_reading(parser)


def _add_reading(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group('how to read the table')
    for name in LISTS:
        group.add_argument(f'--{name}-columns', metavar='A,B,C', type=_names)
    group.add_argument('--temperature-column', metavar='A')
    group.add_argument('--time-column', metavar='A')
    group.add_argument('--length-unit', choices=('m', 'mm'))
    group.add_argument('--angle-unit', choices=('rad', 'deg'), help='unit of the joint angles')
    group.add_argument('--slide-unit', choices=('m', 'mm'), help='unit of joints that slide')
    group.add_argument('--rotation-unit', choices=('rad', 'deg'), help='unit of measured angles')
    group.add_argument(
        '--rotation',
        metavar='ORDER',
        help='order of the angles: XYZ, ZYX, ... (intrinsic), or rotvec',
    )
    group.add_argument(
        '--difference',
        choices=('add', 'subtract'),
        default='add',
        help='whether measured is target plus or minus difference',
    )
    group.add_argument('--positions-only', action='store_true', help='do not read orientations')
    group.add_argument(
        '--skip-rows',
        metavar='N,N',
        type=_numbers,
        default=(),
        help='rows to leave out; the first row under the header is 1',
    )
    group.add_argument(
        '--marker', metavar='NAME', help='what is meant, where an export has several markers'
    )
    group.add_argument('--delimiter', help='comma, semicolon or tab')
    group.add_argument('--decimal', choices=('.', ','))
    _add_counting(parser)


def _add_counting(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group('how the controller counts its joints')
    group.add_argument(
        '--joint-signs',
        metavar='1,-1,...',
        type=_floats,
        help='of every joint, where the controller counts it the other way than the model',
    )
    group.add_argument(
        '--joint-offsets',
        metavar='DEG,DEG,...',
        type=_floats,
        help='added to every joint [deg, mm for a slide], such as 0,-90,90,0,0,0',
    )
    group.add_argument(
        '--coupled',
        metavar='3+2',
        help="the model's joint 3 is that of the table plus joint 2; 3-2 takes it off",
    )


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
    recording, said = _read(args, robot, options)
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
