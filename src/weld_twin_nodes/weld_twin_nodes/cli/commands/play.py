# SPDX-FileCopyrightText: weld_twin contributors
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
    parser.add_argument('--rate', type=float, default=1.0, help='speed against the recording')
    parser.add_argument(
        '--clock',
        type=float,
        nargs='?',
        const=100.0,
        default=0.0,
        metavar='HZ',
        help='tell the time of the recording on /clock, 100 times a second unless said',
    )
    parser.add_argument('--topics', nargs='+', default=[], metavar='TOPIC', help='only these')
    parser.add_argument(
        '--loop',
        type=int,
        nargs='?',
        const=0,
        default=1,
        metavar='N',
        help='play N times, without a number until stopped',
    )
    parser.add_argument(
        '--subscribers',
        type=int,
        default=1,
        metavar='N',
        help='how many each topic is to have before the start',
    )
    parser.add_argument(
        '--wait', type=float, default=5.0, metavar='S', help='longest time to wait for them [s]'
    )


def run(args: argparse.Namespace) -> int:
    """Play the bag."""
    from ...live.bag_player import Playing, play

    how = Playing(args.rate, args.clock, args.topics, args.loop, args.subscribers, args.wait)
    count = play(args.bag, how, lambda line: print(line, file=sys.stderr, flush=True))
    print(f'{count} messages played')
    return 0
