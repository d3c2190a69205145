# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Make a bag of a table of what was measured, seen or touched.

Delimiter, units and columns are read from the table where they are plain, and every guess is
printed; an option settles what is not. Lists of columns are separated by commas. For pixels of
cameras give --camera and --target; weld-twin detect makes a table of images.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING

from weld_twin_core.errors import ModelError

from ..file_options import TABLE, table_of
from ..options import BAG_OUTPUT, CAMERAS, ROBOT, robot_of

if TYPE_CHECKING:
    from weld_twin_core.arm.robot import Robot
    from weld_twin_core.arrays import Array
    from weld_twin_core.recording import Recording

EXAMPLE = 'weld-twin import examples/files/measurements.csv --robot ur5 --out my_cell'
OPTIONS = (
    'FILE.csv                 table of text',
    ROBOT,
    BAG_OUTPUT,
    """
--contacts ARTEFACT.yaml  FILE.csv has joint angles and what was touched; this file describes it
rare:
--table CSV              also write every deviation from the twin
--picture PNG            also draw the deviations
""",
    CAMERAS,
    TABLE,
)


def run(args: argparse.Namespace) -> int:
    """Write the bag, say how the table was read and how far the nominal twin is off."""
    from weld_twin_core.metrics.deviation import deviation_metrics
    from weld_twin_core.twin.twin import Twin
    from weld_twin_msgs_py.bags import write_recording

    robot = robot_of(args)
    if args.contacts and (args.table or args.picture):
        raise ModelError('--table and --picture need measured positions; contacts have none')
    recording, said = table_of(args, robot, args.file)
    if recording.contacts is not None:
        return _touched(args, robot, recording, said)
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
    result = deviation_metrics(measured.position, expected.position)
    print(
        f'{args.out}: {result.samples} {kind}; from the nominal twin, base and tool frame not '
        f'fitted: RMS {result.rms_m * 1e3:.3f} mm, max {result.max_m * 1e3:.3f} mm'
    )
    return 0


def _touched(
    args: argparse.Namespace, robot: Robot, recording: Recording, said: Sequence[str]
) -> int:
    """Write the bag of a table of contacts, and say how far the nominal twin spreads."""
    from weld_twin_core.contacts import spreads
    from weld_twin_core.twin.twin import Twin
    from weld_twin_msgs_py.bags import write_recording

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
    from ...offline.prediction import draw, write_table

    if args.table:
        write_table(args.table, recording, off)
    if args.picture:
        draw(args.picture, recording, off)
