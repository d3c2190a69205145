# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Add the identified effects to the twin: its tool pose at every joint state, as a bag.

Poses are in the frame of the measurements: what the instrument would read at each stamp.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..options import add_bag_output, add_robot, add_topics, robot_of, say_doubts, topics_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('bag', metavar='BAG', help='recording with joint states')
    add_robot(parser)
    parser.add_argument(
        '--model', required=True, metavar='FILE', help='diagnosis.json, or an effects file'
    )
    parser.add_argument(
        '--setup',
        type=int,
        metavar='N',
        help='recording of the diagnosis whose set-up is meant, if the set-up moved between them',
    )
    parser.add_argument(
        '--temperature',
        type=float,
        metavar='DEGC',
        help='of the arm, where the bag has none or another is meant',
    )
    parser.add_argument(
        '--table',
        metavar='FILE.csv',
        help='also write the poses as a table, with standard deviations',
    )
    add_bag_output(parser)
    add_topics(parser)


def run(args: argparse.Namespace) -> int:
    """Write the bag; say how far measured and twin are apart where something was measured."""
    from weld_twin_core.errors import DataError
    from weld_twin_msgs_py.bags import read_recording

    from ...offline.prediction import on_one_clock, predictor, told_sureness, write_prediction
    from ...offline.prediction_table import write_prediction_table

    if args.table and Path(args.table).exists():
        raise DataError(f"'{args.table}' exists already and is not overwritten")
    robot = robot_of(args)
    # Two clocks may be what the diagnosis mended.
    recording = read_recording(args.bag, robot, topics_of(args), one_clock=False)
    if args.temperature is not None:
        recording = recording.at_temperature(args.temperature)
    model = predictor(robot, args.model, args.bag, recording, args.setup)
    recording = on_one_clock(recording if model.source is None else model.source)
    if model.told:
        print(f'note: {model.told}')
    say_doubts(model.twin, args.model)
    made = {'model': str(args.model)}
    got = write_prediction(args.out, model, recording, storage=args.storage, provenance=made)
    if args.table:
        write_prediction_table(args.table, model, recording)
    line = f'{args.out}: {recording.joints.t.size} poses with {len(model.twin.effects)} effects'
    if got.rms_m is not None:
        line += f'; measured minus twin RMS {got.rms_m * 1e3:.4f} mm'
    print(line)
    for sentence in told_sureness(model, got):
        print(sentence)
    return 0
