# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is in a bag, what of it is usable, its rates and gaps."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any

from ...options import add_topics, topics_of
from ...parsing import Adder

EXAMPLE = 'weld-twin bag info bags/elbow_play'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    add = Adder(parser)
    add('bag', 'BAG', 'rosbag2 directory, .mcap or .db3', nargs='?')
    add('--robots', 'list the bundled robots and your own instead')
    add_topics(parser)


def run(args: argparse.Namespace) -> int:
    """Print a table of topics, then what a diagnosis can do with them."""
    from weld_twin_core.errors import DataError

    if args.robots:
        return _print_robots()
    if args.bag is None:
        raise DataError('give a BAG, or --robots')
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
        out += [f'{key}: {text}' for text in _in_words(value)]
    out.append('usable for a diagnosis' if info.usable else 'not usable for a diagnosis')
    return out


def _in_words(value: Any) -> list[str]:
    """Return what is kept of a bag's origin as lines for people."""
    if isinstance(value, dict):
        return [str(value.get('name', ''))]
    if not isinstance(value, list):
        return [str(value)]
    if all(isinstance(each, dict) and 'effect' in each for each in value):
        return [', '.join(_effect(each) for each in value) or 'none']
    return [str(each) for each in value]


def _effect(entry: Mapping[str, Any]) -> str:
    """Return an entry of an effects file in words, with its units where the effect is known."""
    from weld_twin_core.effects import REGISTRY

    from ....wording.words import cause

    kind = REGISTRY.get(entry['effect'])
    units = {} if kind is None else {p.name: p.unit.strip('-') for p in kind.parameters}
    values = [
        f'{name} {value} {units.get(name, "")}'.rstrip()
        for name, value in entry.items()
        if name not in ('effect', 'joint')
    ]
    return f'{cause(entry["effect"], entry.get("joint"))} ({", ".join(values)})'


def _print_robots() -> int:
    from weld_twin_core.arm import catalog
    from weld_twin_msgs_py.robots import own_files

    for name in catalog.names():
        robot = catalog.load(name)
        print(f'{name:16} {robot.n} joints  {robot.source}')
    for file in own_files():
        print(f'{file.stem:16} your own  {file}')
    return 0
