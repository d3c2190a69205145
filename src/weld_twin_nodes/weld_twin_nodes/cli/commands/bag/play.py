# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Play a bag into running nodes, without `ros2 bag play`.

Messages go out as they were recorded, header stamps included. Nodes that take the time from the
recording are started with use_sim_time and need --clock.
"""

from __future__ import annotations

import argparse
import sys

from ...parsing import Adder

EXAMPLE = 'weld-twin bag play bags/elbow_play --clock'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add = Adder(parser)
    add('bag', 'BAG', 'rosbag2 directory, .mcap or .db3')
    add(
        '--rate',
        'X',
        '2 plays twice as fast as recorded (default: {default})',
        type=float,
        default=1.0,
    )
    text = 'publish the time of the recording on /clock, HZ times a second (100 if left out)'
    add('--clock', 'HZ', text, type=float, nargs='?', const=100.0, default=0.0)
    add('--topics', 'TOPIC', 'play only these', nargs='+', default=[])
    text = 'play N times; without N, until stopped'
    add('--loop', 'N', text, type=int, nargs='?', const=0, default=1)
    text = 'start when every topic has so many subscribers (default: {default})'
    add('--subscribers', 'N', text, type=int, default=1, rare=True)
    text = 'start after S seconds in any case (default: {default})'
    add('--wait', 'S', text, type=float, default=5.0, rare=True)


def run(args: argparse.Namespace) -> int:
    """Play the bag."""
    from ....live.bag_player import Playing, play

    how = Playing(args.rate, args.clock, args.topics, args.loop, args.subscribers, args.wait)
    count = play(args.bag, how, lambda line: print(line, file=sys.stderr, flush=True))
    print(f'{count} messages played')
    return 0
