# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Faults done to a running cell: what each node did, and what it answered to absurd values."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from weld_twin_core.arm.chain import forward
from weld_twin_core.errors import TwinError
from weld_twin_msgs_py.bags import BagReader
from weld_twin_msgs_py.files import markdown
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.topics import DEVIATION, MEASURED_POSE, TWIN_POSE
from weld_twin_nodes.cli.given import Given
from weld_twin_nodes.harness import Cell

from .fault_list import JOINT_FAULTS, OTHER_FAULTS, Fault
from .fault_scenes import NODES, SCENES, Bench, play

PUBLISHED = {
    'forward_kinematics_twin': TWIN_POSE.name,
    'error_injector': MEASURED_POSE.name,
    'deviation_analyzer': DEVIATION.name,
}
EXACT = 1e-9
"""Largest difference [m] of a published number from the right one."""
BEFORE, AFTER = 3.5, 1.0
"""Seconds of sound joint states before and after a fault."""
BACK = 30.0
"""Seconds a node has to be ok again."""
BOMB = 'a: &a [x,x,x,x,x,x,x,x,x]\n' + ''.join(
    f'{b}: &{b} [*{a},*{a},*{a},*{a},*{a},*{a},*{a},*{a},*{a}]\n'
    for a, b in zip('abcdefgh', 'bcdefghi', strict=True)
)
ABUSES: tuple[tuple[str, str, Any], ...] = (
    ('forward_kinematics_twin', 'robot', 'ur10'),
    ('forward_kinematics_twin', 'effects', '[{effect: '),
    ('forward_kinematics_twin', 'effects', '[{effect: rust}]'),
    ('forward_kinematics_twin', 'effects', '!!python/object/apply:os.system ["true"]'),
    ('forward_kinematics_twin', 'effects', BOMB),
    ('forward_kinematics_twin', 'effects', '[' * 5000),
    ('forward_kinematics_twin', 'effects', 'x' * 1_000_000),
    ('forward_kinematics_twin', 'effects', '[{effect: time_delay, delay: .nan}]'),
    ('forward_kinematics_twin', 'effects', 7),
    ('error_injector', 'effects', '[{effect: measurement_noise, sigma: -1}]'),
    ('error_injector', 'effects', '[{effect: joint_offset, joint: knee, offset: 1}]'),
    ('error_injector', 'seed', 3),
    ('deviation_analyzer', 'buffer', -1),
    ('deviation_analyzer', 'metrics_every', 10**12),
    ('live_diagnosis', 'window', 'a minute'),
    ('recorder', 'out', '/etc/passwd'),
    ('deviation_markers', 'tolerance', 0.0),
    ('deviation_markers', 'use_sim_time', 'perhaps'),
)


def trial(bench: Bench, fault: Fault) -> dict[str, Any]:
    bench.run(BEFORE)
    _settle(bench)
    marks = {name: len(process.log) for name, process in bench.processes.items()}
    for tap in bench.taps.values():
        tap.messages.clear()
    bench.health.clear()
    fault.run(bench)
    bench.run(1.2)
    reported = {name: bench.health.of(name) for name in NODES}
    bench.health.clear()
    bench.run(AFTER)
    _settle(bench)
    well = _well_again(bench)
    rows = {
        name: _row(bench, name, marks[name], reported[name], fault, well[name]) for name in NODES
    }
    resumed = _outputs(bench, 'deviation_analyzer') > 0
    return {
        'fault': fault.name,
        'resumed': resumed,
        'nodes': rows,
        'passed': resumed and all(row['passed'] for row in rows.values()),
    }


def _row(
    bench: Bench, name: str, mark: int, reported: list[tuple[str, str]], fault: Fault, well: bool
) -> dict[str, Any]:
    """Return what became of one node; its log before the mark is of earlier faults."""
    process = bench.processes[name]
    log = process.log[mark:] if len(process.log) >= mark else process.log
    row = {
        'alive': process.code is None,
        'traceback': 'Traceback' in log,
        'outputs': _outputs(bench, name),
        'wrong': _wrong(bench, name),
        **_summary(reported),
        'must_tell': name in fault.tell,
        'ok_again': well,
    }
    row['passed'] = bool(
        row['alive']
        and not row['traceback']
        and row['wrong'] == 0
        and row['ok_again']
        and (row['told'] not in ('ok', 'silent') or not row['must_tell'])
    )
    return row


def _settle(bench: Bench) -> None:
    """Send sound joint states until one of now has come through all nodes."""
    last, tap = bench.stamp, bench.taps[DEVIATION.name].messages
    end = time.monotonic() + 60.0
    while not tap or from_messages.stamp_ns(tap[-1]) < last:
        if time.monotonic() > end:
            return
        bench.run(0.2)


def _well_again(bench: Bench) -> dict[str, bool]:
    """Tell of each node whether its health comes back to ok while all is well."""
    seen: dict[str, bool] = {}
    for _ in range(int(BACK)):
        bench.health.clear()
        bench.run(2.0)
        _settle(bench)
        seen = {
            name: bool(entries) and all(entries)
            for name in NODES
            for entries in [_inputs(bench, name)]
        }
        if all(seen.values()):
            break
    return seen


def _inputs(bench: Bench, node: str) -> list[bool]:
    """Tell of each input that the sound cell feeds whether it was told ok."""
    unfed = ('/tool_wrench', '/temperature', '/measured/tool_point')
    return [
        any(level == 'ok' for level, _ in entries)
        for name, entries in bench.health.told.items()
        if name.split(': ')[0] == f'/{node}' and not name.endswith(unfed)
    ]


def _outputs(bench: Bench, node: str) -> int:
    return len(bench.taps[PUBLISHED[node]].messages) if node in PUBLISHED else 0


def _wrong(bench: Bench, node: str) -> int:
    """Return how many messages of a node are not what a sound joint state of the stamp gives."""
    if node not in PUBLISHED:
        return 0
    messages = bench.taps[PUBLISHED[node]].messages
    if node == 'deviation_analyzer':
        return sum(float(np.linalg.norm(from_messages.vector3(m))) > EXACT for m in messages)
    return sum(not _right(bench, m) for m in messages if not _foreign(m))


def _foreign(message: Any) -> bool:
    """Tell whether the campaign itself published a pose, one nanosecond beside the beat."""
    return bool(message.header.stamp.nanosec % 10 == 1)


def _right(bench: Bench, message: Any) -> bool:
    position, rotation = from_messages.pose(message)
    for q in bench.sent.get(from_messages.stamp_ns(message), ()):
        pose = forward(bench.robot, q)
        if (
            np.abs(pose[:3, 3] - position).max() < EXACT
            and np.abs(pose[:3, :3] - rotation).max() < EXACT
        ):
            return True
    return False


def _summary(reported: list[tuple[str, str]]) -> dict[str, Any]:
    """Return the worst level and the commonest sentence of it."""
    order = ('ok', 'warn', 'stale', 'error')
    worst = max((level for level, _ in reported), key=order.index, default='silent')
    said = Counter(text for level, text in reported if level == worst and level != 'ok')
    return {'told': worst, 'said': said.most_common(1)[0][0] if said else ''}


def abuse(bench: Bench) -> list[dict[str, Any]]:
    """Set each value on the running nodes; return what each answered."""
    rows = []
    for node, name, value in ABUSES:
        answer = bench.cell.set_parameter(node, name, value)
        text = repr(value)
        rows.append(
            {
                'node': node,
                'parameter': name,
                'value': text if len(text) < 60 else f'{text[:40]}... ({len(text)} characters)',
                'refused': not answer.successful,
                'reason': answer.reason[:200],
            }
        )
        bench.run(0.2)
    return rows


def run(args: Given, tell: Callable[[str], None]) -> dict[str, Any]:
    everything = (*JOINT_FAULTS, *OTHER_FAULTS, *SCENES)
    mine = [each for each in everything if args.only in each.name]
    with TemporaryDirectory() as folder:
        made = _on_bench([each for each in mine if each not in SCENES], Path(folder), tell)
        made['scenes'] = _scenes([each for each in mine if each in SCENES], Path(folder), tell)
    made['bags'] = {args.only: made.pop('bag')}
    rows = [*made['faults'], *made['scenes'], *made['bags'].values()]
    refused = all(row['refused'] for row in made['parameters'])
    return {'passed': refused and all(row['passed'] for row in rows), **made}


def _on_bench(faults: Sequence[Any], folder: Path, tell: Callable[[str], None]) -> dict[str, Any]:
    """Return what each node of one cell did under each fault, and whether its bag is whole."""
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
