# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Make a bag of what is whole of a damaged one.

BAG is what the recorder was told to write. The original stays as it is; delete it when you have
looked at the new one.
"""

from __future__ import annotations

import argparse

from ...parsing import Adder

EXAMPLE = 'weld-twin bag recover my_recording'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add = Adder(parser)
    add('bag', 'BAG', 'bag, its .unfinished directory, or a file')
    add(
        '--out',
        'BAG2',
        'bag to write (default: the name the recording should have, or BAG_recovered)',
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
