# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Look into a bag, make a damaged one whole, play it."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table

from weld_twin_core.errors import DataError

from ..given import Given

if TYPE_CHECKING:
    from weld_twin_msgs_py.bags import BagInfo


def info(given: Given) -> int:
    """Print what is in a bag, or which robots there are."""
    if given.robots:
        from weld_twin_core.arm import catalog
        from weld_twin_msgs_py.robots import own_files

        for name in catalog.names():
            robot = catalog.load(name)
            print(f'{name:16} {robot.n} joints  {robot.source}')
        for file in own_files():
            print(f'{file.stem:16} your own  {file}')
        return 0
    if not given.bag:
        raise DataError('give a BAG, or --robots')
    from weld_twin_msgs_py.bags import bag_info

    result = bag_info(given.bag, given.read_topics())
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
    from weld_twin_msgs_py.bags.needed import COMPLETENESS

    out = [f'missing: {text}' for text in result.missing]
    out += [f'refused: {result.refused}'] if result.refused else []
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


def recover(given: Given) -> int:
    """Make a bag of what is whole of a damaged one, and say what was damaged."""
    from weld_twin_msgs_py.bags import recover

    done = recover(given.bag, given.out or None)
    for sentence in done.damage:
        print(f'note: {sentence}')
    for topic, count in sorted(done.messages.items()):
        print(f'{count:10}  {topic}')
    print(f"recovered to '{done.path}'; the original stays at '{done.source}'")
    return 0


def play(given: Given) -> int:
    """Play a bag into running nodes."""
    from ...live.bag_player import Playing, play

    times = 1 if given.loop is None else given.loop
    start = given.subscribers, given.wait
    how = Playing(given.rate, given.clock or 0.0, given.topics, times, *start)
    count = play(given.bag, how, lambda line: print(line, file=sys.stderr, flush=True))
    print(f'{count} messages played')
    return 0
