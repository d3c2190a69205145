# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is in a bag, what of it is usable, its rates and gaps."""

from __future__ import annotations

import argparse

from ..options import add_topics, topics_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument('bag', nargs='?', metavar='BAG', help='rosbag2 directory, .mcap or .db3')
    what.add_argument('--robots', action='store_true', help='list the bundled robots instead')
    add_topics(parser)


def run(args: argparse.Namespace) -> int:
    """Print a table of topics, then what a diagnosis can do with them."""
    if args.robots:
        return _print_robots()
    from rich.console import Console
    from rich.table import Table

    from weld_twin_msgs_py.bags import bag_info

    info = bag_info(args.bag, topics_of(args))
    table = Table(box=None, pad_edge=False)
    for title in ('topic', 'type', 'used as'):
        table.add_column(title, no_wrap=True)
    for title in ('messages', 'rate [Hz]', 'gaps', 'longest [s]'):
        table.add_column(title, justify='right')
    for t in info.topics:
        rate = '' if t.rate_hz is None else f'{t.rate_hz:.4g}'
        longest = f'{t.longest_gap_s:.3g}' if t.gaps else ''
        table.add_row(t.name, t.type, t.use, str(t.count), rate, str(t.gaps), longest)
    console = Console(width=140, highlight=False, markup=False)
    console.print(f'{info.path}: {info.duration_s:.3f} s')
    console.print(table)
    for line in _sentences(info):
        console.print(line)
    return 0


def _sentences(info: object) -> list[str]:
    from weld_twin_msgs_py.bags import BagInfo
    from weld_twin_msgs_py.bags.ends import COMPLETENESS

    assert isinstance(info, BagInfo)
    out = [f'missing: {text}' for text in info.missing]
    out += [f'note: {text}' for text in info.notes]
    for key, value in info.provenance.items():
        if key == COMPLETENESS:
            if not any(row['missing'] for row in value.values()):
                total = sum(row['sent'] for row in value.values())
                out.append(f'complete: all {total:,} messages that were sent are here')
            continue
        shown = value.get('name', '') if isinstance(value, dict) else value
        out.append(f'{key}: {shown}')
    out.append('usable for a diagnosis' if info.usable else 'not usable for a diagnosis')
    return out


def _print_robots() -> int:
    from weld_twin_core.arm import catalog

    for name in catalog.names():
        robot = catalog.load(name)
        print(f'{name:16} {robot.n} joints  {robot.source}')
    return 0
