# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Look into a bag, make a damaged one whole, play it.

'weld-twin bag BAG' alone tells what is in it.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from weld_twin_core.errors import DataError

from ..options import TOPICS, topics_of
from . import job, jobs

if TYPE_CHECKING:
    from weld_twin_msgs_py.bags import BagInfo

USUAL = 'info'
"""The job that is meant where none is named."""
EXAMPLE = 'weld-twin bag bags/elbow_play'
INFO = """
[BAG]                    rosbag2 directory, .mcap or .db3
--robots                 list the bundled robots and your own instead
"""
PLAY = """
BAG                      rosbag2 directory, .mcap or .db3
--rate X                 2 plays twice as fast as recorded [default: 1]
--clock [HZ=100]         publish the time of the recording on /clock, HZ times a second (100 if left
                         out)
--topics TOPIC ...       play only these
--loop [N=0]             play N times; without N, until stopped
rare:
--subscribers N          start when every topic has so many subscribers [default: 1]
--wait S                 start after S seconds in any case [default: 5]
"""
RECOVER = """
BAG                      bag, its .unfinished directory, or a file
--out BAG2               bag to write (default: the name the recording should have, or BAG_recovered)
"""


@job('weld-twin bag info bags/elbow_play', INFO, TOPICS)
def info(args: argparse.Namespace) -> int:
    """What is in a bag, what of it is usable, its rates and gaps."""
    if args.robots:
        return _print_robots()
    if not args.bag:
        raise DataError('give a BAG, or --robots')
    from rich.console import Console
    from rich.table import Table

    from weld_twin_msgs_py.bags import bag_info

    result = bag_info(args.bag, topics_of(args))
    table = Table(box=None, pad_edge=False)
    for title in ('topic', 'type', 'used as'):
        table.add_column(title, no_wrap=True)
    for title in ('messages', 'rate [Hz]', 'gaps', 'longest [s]'):
        table.add_column(title, justify='right')
    for t in result.topics:
        rate = '' if t.rate_hz is None else f'{t.rate_hz:.4g}'
        longest = f'{t.longest_gap_s:.3g}' if t.gaps else ''
        table.add_row(t.name, t.type, t.use, str(t.count), rate, str(t.gaps), longest)
    console = Console(width=140, highlight=False, markup=False)
    console.print(f'{result.path}: {result.duration_s:.3f} s')
    console.print(table)
    for line in _sentences(result):
        console.print(line)
    return 0


def _sentences(result: BagInfo) -> list[str]:
    from weld_twin_msgs_py.bags.ends import COMPLETENESS

    out = [f'missing: {text}' for text in result.missing]
    out += [f'note: {text}' for text in result.notes]
    for key, value in result.provenance.items():
        if key != COMPLETENESS:
            out += [f'{key}: {text}' for text in _in_words(value)]
        elif not any(row['missing'] for row in value.values()):
            total = sum(row['sent'] for row in value.values())
            out.append(f'complete: all {total:,} messages that were sent are here')
    return [*out, f'{"" if result.usable else "not "}usable for a diagnosis']


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

    from ...wording.words import cause

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


@job('weld-twin bag recover my_recording', RECOVER)
def recover(args: argparse.Namespace) -> int:
    """Make a bag of what is whole of a damaged one.

    BAG is what the recorder was told to write. The original stays as it is; delete it when you have
    looked at the new one.
    """
    from weld_twin_msgs_py.bags import recover

    done = recover(args.bag, args.out or None)
    for sentence in done.damage:
        print(f'note: {sentence}')
    for topic, count in sorted(done.messages.items()):
        print(f'{count:10}  {topic}')
    print(f"recovered to '{done.path}'; the original stays at '{done.source}'")
    return 0


@job('weld-twin bag play bags/elbow_play --clock', PLAY)
def play(args: argparse.Namespace) -> int:
    """Play a bag into running nodes, without `ros2 bag play`.

    Messages go out as they were recorded, header stamps included. Nodes that take the time from the
    recording are started with use_sim_time and need --clock.
    """
    from ...live.bag_player import Playing, play

    times = 1 if args.loop is None else args.loop
    how = Playing(args.rate, args.clock or 0.0, args.topics, times, args.subscribers, args.wait)
    count = play(args.bag, how, lambda line: print(line, file=sys.stderr, flush=True))
    print(f'{count} messages played')
    return 0


JOBS = jobs(info, recover, play)
