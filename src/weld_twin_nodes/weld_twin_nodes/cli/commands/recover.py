# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Make a bag of what is whole of one whose recording was cut short, or that is damaged.

BAG is what the recorder was told to write. The original stays as it is; delete it when you have
looked at the new one.
"""

from __future__ import annotations

import argparse


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument('bag', metavar='BAG', help='bag, its .unfinished directory, or a file')
    parser.add_argument(
        '--out',
        metavar='BAG2',
        help='bag to write; it must not exist yet (default: the name that the recording should '
        'have, or BAG_recovered)',
    )


def run(args: argparse.Namespace) -> int:
    """Recover, and say what was lost and what was not."""
    from weld_twin_msgs_py.bags import recover

    done = recover(args.bag, args.out)
    for sentence in done.damage:
        print(f'note: {sentence}')
    for topic, count in sorted(done.messages.items()):
        print(f'{count:10}  {topic}')
    print(f"recovered to '{done.path}'; the original stays at '{done.source}'")
    return 0
