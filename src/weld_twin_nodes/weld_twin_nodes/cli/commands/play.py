# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Play a bag into running nodes, for machines without `ros2 bag play`.

Messages go out as they were recorded, header stamps included. Nodes that take the time from the
recording are started with use_sim_time and need --clock.
"""

from __future__ import annotations

import argparse
import sys


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('bag', metavar='BAG', help='rosbag2 directory, .mcap or .db3')
    parser.add_argument(
        '--rate', type=float, default=1.0, help='2 plays twice as fast as recorded (default: 1)'
    )
    parser.add_argument(
        '--clock',
        type=float,
        nargs='?',
        const=100.0,
        default=0.0,
        metavar='HZ',
        help='publish the time of the recording on /clock, HZ times a second (100 if left out)',
    )
    parser.add_argument('--topics', nargs='+', default=[], metavar='TOPIC', help='play only these')
    parser.add_argument(
        '--loop',
        type=int,
        nargs='?',
        const=0,
        default=1,
        metavar='N',
        help='play N times; without N, until stopped',
    )
    parser.add_argument(
        '--subscribers',
        type=int,
        default=1,
        metavar='N',
        help='start when every topic has so many subscribers (default: 1)',
    )
    parser.add_argument(
        '--wait',
        type=float,
        default=5.0,
        metavar='S',
        help='start after S seconds in any case (default: 5)',
    )


def run(args: argparse.Namespace) -> int:
    """Play the bag."""
    from ...live.bag_player import Playing, play

    how = Playing(args.rate, args.clock, args.topics, args.loop, args.subscribers, args.wait)
    count = play(args.bag, how, lambda line: print(line, file=sys.stderr, flush=True))
    print(f'{count} messages played')
    return 0
