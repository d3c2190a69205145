# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Turn nominal joint commands into commands that put the real tool on the seam, as a bag."""

from __future__ import annotations

import argparse

from ..options import add_bag_output, add_robot, add_topics, robot_of, say_doubts, topics_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('bag', metavar='BAG', help='bag with the nominal joint commands')
    add_robot(parser)
    parser.add_argument(
        '--model', required=True, metavar='FILE', help='diagnosis.json, or an effects file'
    )
    add_bag_output(parser)
    add_topics(parser)


def run(args: argparse.Namespace) -> int:
    """Write the commands and say what they gain by the model, and where it knows too little."""
    from weld_twin_msgs_py.bags import read_recording

    from ...offline.compensating import compensated, told_trust, write_compensated

    robot = robot_of(args)
    robot.refuse_positioner('a compensated motion')
    recording = read_recording(args.bag, robot, topics_of(args))
    made = compensated(robot, args.model, recording)
    say_doubts(made.model.twin, args.model)
    if made.told:
        print(f'note: {made.told}')
    robot.check_positions(made.result.motion.q)
    write_compensated(args.out, made, recording, storage=args.storage)
    before, after = made.result.rms
    print(
        f'{args.out}: by the model the tool is {before * 1e3:.4f} mm RMS off with the nominal '
        f'commands and {after * 1e3:.4f} mm with these'
    )
    print(
        'this is what the effects in the model do on these commands; the gap of a diagnosis also '
        'holds noise and whatever it left unexplained'
    )
    for sentence in told_trust(made):
        print(sentence)
    if made.result.left_out:
        names = ', '.join(effect.name for effect in made.result.left_out)
        print(f'joint commands cannot mend {names}')
    return 0
