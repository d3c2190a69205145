# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Turn nominal joint commands into commands that put the real tool on the seam, as a bag."""

from __future__ import annotations

import argparse

from ..options import add_bag_output, add_robot, add_topics, robot_of, topics_of


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
    """Write the commands and say what they gain by the model."""
    from dataclasses import replace

    from weld_twin_core.twin.compensation import compensate
    from weld_twin_msgs_py.bags import read_recording, write_recording

    from ...offline.told_twin import build_twin

    twin = build_twin(robot_of(args), args.model)
    recording = read_recording(args.bag, twin.robot, topics_of(args))
    result = compensate(twin.robot, twin.effects, recording)
    twin.robot.check_positions(result.motion.q)
    commands = replace(recording, joints=result.motion, measured=None)
    made = {'compensated_with': [effect.to_mapping() for effect in twin.effects]}
    write_recording(args.out, commands, twin.robot, storage=args.storage, provenance=made)
    before, after = result.rms
    print(
        f'{args.out}: by the model the tool is {before * 1e3:.4f} mm RMS off with the nominal '
        f'commands and {after * 1e3:.4f} mm with these'
    )
    if result.left_out:
        names = ', '.join(effect.name for effect in result.left_out)
        print(f'no joint command mends {names}')
    return 0
