# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Faults done to a running cell, and what each node did.

A node passes a fault if it lives, published nothing but what a sound joint state of the same
stamp gives, told of the fault on /diagnostics where it is one of its inputs', and is ok again
afterwards.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from weld_twin_msgs_py.files import markdown

from ..study import options

OPTIONS = options('--only TEXT  faults whose names contain this', out='')


def run(args: argparse.Namespace, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return what each node did under each fault."""
    import tempfile

    from .faulting.fault_list import JOINT_FAULTS, OTHER_FAULTS
    from .faulting.scenes import SCENES

    everything = (*JOINT_FAULTS, *OTHER_FAULTS, *SCENES)
    mine = [each for each in everything if args.only in each.name]
    with tempfile.TemporaryDirectory() as folder:
        made = _on_bench([each for each in mine if each not in SCENES], Path(folder), tell)
        made['scenes'] = _scenes([each for each in mine if each in SCENES], Path(folder), tell)
    made['bags'] = {args.only: made.pop('bag')}
    rows = [*made['faults'], *made['scenes'], *made['bags'].values()]
    refused = all(row['refused'] for row in made['parameters'])
    return {'passed': refused and all(row['passed'] for row in rows), **made}


def _on_bench(faults: Sequence[Any], folder: Path, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return what each node of one cell did under each fault, and whether its bag is whole."""
    from weld_twin_nodes.harness import Cell

    from .faulting.bench import Bench
    from .faulting.outcomes import abuse

    rows: list[dict[str, Any]] = []
    if not faults:
        return {'faults': rows, 'parameters': [], 'bag': {'passed': True, 'messages': 0}}
    with Cell(folder / 'cell') as cell:
        bench = Bench(cell, folder / 'bag')
        bench.ready()
        for fault in faults:
            rows.append(_tried(bench, fault))
            tell(_line(rows[-1]))
        parameters = abuse(bench)
    return {'faults': rows, 'parameters': parameters, 'bag': _recorded(folder / 'bag')}


def _scenes(
    scenes: Sequence[Any], folder: Path, tell: Callable[[str], None]
) -> list[dict[str, Any]]:
    """Return what was told in each scene."""
    from .faulting.scenes import play

    rows = []
    for k, scene in enumerate(scenes):
        rows.append(play(scene, folder / f'scene{k}'))
        tell(f'{"ok  " if rows[-1]["passed"] else "FAIL"} {scene.name}: {_sentences(rows[-1])}')
    return rows


def _sentences(row: dict[str, Any]) -> str:
    if 'reason' in row:
        return str(row['reason'])
    return '; '.join(
        f'{each["what"]} after {each["seconds"]:.1f} s: {each["said"]}'
        for each in row['told']
        if each['seconds'] is not None
    )


def _tried(bench: Any, fault: Any) -> dict[str, Any]:
    """Return what happened, a cell that does not come back included."""
    from .faulting.outcomes import trial

    try:
        return trial(bench, fault)
    except TimeoutError as error:
        reason = str(error)[:2000]
        return {'fault': fault.name, 'passed': False, 'nodes': {}, 'reason': reason}


def _line(row: dict[str, Any]) -> str:
    nodes = ' '.join(
        f'{name}:{node["told"]}{"" if node["passed"] else "(!)"}'
        for name, node in row['nodes'].items()
    )
    return f'{"ok  " if row["passed"] else "FAIL"} {row["fault"]}: {nodes}'


def _recorded(bag: Any) -> dict[str, Any]:
    """Tell whether the bag of the whole campaign opens and every message in it can be read."""
    from weld_twin_core.errors import TwinError
    from weld_twin_msgs_py.bags import BagReader

    count = 0
    try:
        with BagReader(bag) as reader:
            for _ in reader.messages(list(reader.topics)):
                count += 1
    except TwinError as error:
        return {'passed': False, 'messages': count, 'reason': str(error)}
    return {'passed': True, 'messages': count, 'reason': ''}


COLUMNS = {
    'forward_kinematics_twin': 'twin',
    'error_injector': 'injector',
    'deviation_analyzer': 'analyzer',
    'deviation_markers': 'markers',
    'live_diagnosis': 'diagnosis',
    'recorder': 'recorder',
}


def table(result: dict[str, Any]) -> str:
    """Return what each node told under each fault, and what else there is to say."""
    rows = [
        (
            row['fault'],
            *(row['nodes'].get(name, {}).get('told', '') for name in COLUMNS),
            sum(node['wrong'] for node in row['nodes'].values()),
            'yes' if row['passed'] else 'no',
        )
        for row in result['faults']
    ]
    scenes = [
        (
            row['fault'],
            each['what'],
            each['node'].lstrip('/'),
            '' if each['seconds'] is None else f'{each["seconds"]:.1f}',
            each['said'],
            'yes' if row['passed'] else 'no',
        )
        for row in result['scenes']
        for each in row['told']
        if each['within_s']
    ]
    messages = sum(bag['messages'] for bag in result['bags'].values())
    refused = sum(row['refused'] for row in result['parameters'])
    return (
        markdown.table(('fault', *COLUMNS.values(), 'wrong', 'passed'), *rows)
        + '\n'
        + markdown.table(('fault', 'done', 'node', 'after [s]', 'what it said', 'passed'), *scenes)
        + f'\n{refused} of {len(result["parameters"])} absurd parameter values were refused in a '
        f'sentence. The bags of the whole campaign have {messages:,} messages; all of them can be '
        'read.\n'
    )
