# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Faults done to a running cell: who is to tell of each, what each node did, and absurd values."""

from __future__ import annotations

import signal
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from operator import itemgetter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from rclpy.serialization import serialize_message

from weld_twin_core.arm.chain import forward
from weld_twin_core.errors import TwinError
from weld_twin_msgs_py.bags import BagReader
from weld_twin_msgs_py.files import markdown
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.topics import (
    DEVIATION,
    JOINT_STATES,
    MEASURED_POSE,
    TEMPERATURE,
    TOOL_WRENCH,
    TWIN_POSE,
    Topic,
)
from weld_twin_nodes.cli.given import Given
from weld_twin_nodes.harness import Cell

from ..study import shown, tabled
from .fault_scenes import NODES, RATE, SCENES, Bench, S, play

TAKE_JOINTS = ('forward_kinematics_twin', 'error_injector', 'live_diagnosis')
LEASE = 25.0
"""Seconds after which the middleware has given up a participant that shows no sign of life."""
LONG = 2.5
"""Seconds of a fault: at least two looks of every node at its health."""
FAR = (2.0, 2.0, 2.0)
"""Where no tool of the cell is [m]."""
HOUR = 3600 * S
"""Nanoseconds."""


@dataclass(frozen=True)
class Fault:
    name: str
    run: Callable[[Bench], None]
    """Does it, and leaves the cell in order."""
    tell: Sequence[str] = TAKE_JOINTS
    """Nodes whose health must not be ok meanwhile."""


def _third(spoil: Callable[[Any], None], bench: Bench) -> None:
    def each(k: int) -> None:
        message = bench.joint_state()
        if k % 3 == 0:
            spoil(message)
        bench.send(message, sound=k % 3 != 0)

    bench.run(LONG, each)


def _bytes(make: Callable[[bytes, int], bytes], bench: Bench) -> None:
    """Follow every third joint state with bytes that are none."""

    def each(k: int) -> None:
        message = bench.joint_state()
        bench.send(message)
        if k % 3 == 0:
            bench.send(make(serialize_message(message), k), sound=False)

    bench.run(LONG, each)


def _set(field: str, k: int, value: float, message: Any) -> None:
    getattr(message, field)[k] = value


def _with(field: str, change: Callable[[Any], Any], message: Any) -> None:
    setattr(message, field, change(getattr(message, field)))


def _shifted(ns: int, message: Any) -> None:
    message.header.stamp.sec += ns // S


def _unset(message: Any) -> None:
    message.header.stamp.sec = message.header.stamp.nanosec = 0


def _other_joints(bench: Bench) -> None:
    def each(_: int) -> None:
        message = bench.joint_state()
        message.name = [f'other_{name}' for name in message.name]
        bench.send(message, sound=False)

    bench.run(LONG, each)


def _future(bench: Bench) -> None:
    """One stamp an hour ahead; those behind it are out of order until time has begun anew."""

    def each(k: int) -> None:
        message = bench.joint_state()
        if k % 50 == 10:
            _shifted(HOUR, message)
        bench.send(message)

    bench.run(LONG, each)


def _rate(factor: float, bench: Bench) -> None:
    bench.run(LONG + 1.0, rate=RATE * factor)


def _twice(change: float, bench: Bench) -> None:
    """Let another publisher repeat every joint state, or contradict it between."""
    second = bench.publisher(JOINT_STATES)
    bench.cell.wait(lambda: second.get_subscription_count() >= 4, 'listeners')

    def each(_: int) -> None:
        message = bench.joint_state()
        bench.send(message)
        if change:
            message.header.stamp.nanosec += 1
            message.position[2] += change
            bench.sent[bench.stamp + 1].append(np.array(message.position))
        second.publish(message)

    bench.run(LONG, each)
    bench.cell.node.destroy_publisher(second)


def _restart(number: int, order: Sequence[str], bench: Bench) -> None:
    """End nodes by a signal, and bring them back in the order given."""
    for name in order:
        process = bench.processes[name]
        process.signal(number)
        process.end(60.0)
        bench.cell.processes.remove(process)
    bench.run(1.0)
    for name in order:
        bench.start(name)
        bench.run(0.5)
    bench.ready()


def _stopped(bench: Bench) -> None:
    """The twin hangs until the others have given it up, and comes back."""
    process = bench.processes['forward_kinematics_twin']
    process.signal(signal.SIGSTOP)
    try:
        bench.rest(LEASE)
    finally:
        process.signal(signal.SIGCONT)
    bench.ready()


def _clock(jump: int, bench: Bench) -> None:
    bench.tick(jump)
    bench.rest(0.3)
    bench.run(LONG)


def _frozen(bench: Bench) -> None:
    bench.ticking = False
    bench.run(LONG)
    bench.ticking = True


def _beside(topic: Topic, make: Callable[[Bench, int], Any], bench: Bench) -> None:
    """Publish on another topic than the joint states, which go on."""
    publisher = bench.publisher(topic)
    bench.cell.wait(lambda: publisher.get_subscription_count() > 0, 'listeners')

    def each(k: int) -> None:
        bench.send(bench.joint_state())
        if k % 3 == 0:
            publisher.publish(make(bench, k))

    bench.run(LONG, each)
    bench.cell.node.destroy_publisher(publisher)


def _pose(
    place: Sequence[float], bench: Bench, _: int, *, frame: str = 'world', ahead: int = 0
) -> Any:
    return bench.make.pose(bench.stamp + ahead + 1, np.array(place), np.eye(3), frame)


def _zero_pose(bench: Bench, _: int) -> Any:
    message = _pose((0.0, 0.0, 0.0), bench, 0)
    message.pose.orientation.w = 0.0
    return message


def _other_type(bench: Bench) -> None:
    """A driver publishes something else under the name of the wrench."""
    publisher = bench.cell.node.create_publisher(
        TEMPERATURE.message_class(), TOOL_WRENCH.name, TOOL_WRENCH.offered.to_rclpy()
    )
    bench.run(LONG)
    bench.cell.node.destroy_publisher(publisher)


def _other_namespace(bench: Bench) -> None:
    """The controller comes up in a namespace that the nodes are not in."""
    publisher = bench.cell.node.create_publisher(
        JOINT_STATES.message_class(), f'/left{JOINT_STATES.name}', JOINT_STATES.offered.to_rclpy()
    )
    bench.run(LONG, lambda _: publisher.publish(bench.joint_state()))
    bench.cell.node.destroy_publisher(publisher)


JOINT_FAULTS = (
    Fault('NaN position', partial(_third, partial(_set, 'position', 2, float('nan')))),
    Fault('infinite position', partial(_third, partial(_set, 'position', 0, float('inf')))),
    Fault('infinite velocity', partial(_third, partial(_set, 'velocity', 1, float('-inf')))),
    Fault(
        'fewer positions than names', partial(_third, partial(_with, 'position', lambda q: q[:4]))
    ),
    Fault(
        'a renamed joint',
        partial(_third, partial(_with, 'name', lambda n: [*n[:5], 'wrist_4_joint'])),
    ),
    Fault("another robot's joints", _other_joints),
    Fault('degrees', partial(_third, partial(_with, 'position', np.degrees))),
    Fault('stamp zero', partial(_third, _unset)),
    Fault('stamps that go back', partial(_third, partial(_shifted, -2 * S))),
    Fault('a stamp an hour ahead', _future),
    Fault('random bytes', partial(_bytes, lambda data, k: np.random.default_rng(k).bytes(200))),
    Fault('a message cut short', partial(_bytes, lambda data, k: data[: 4 + k % 100])),
    Fault('no bytes', partial(_bytes, lambda data, k: b'')),
    Fault(
        'a length of four thousand million',
        partial(_bytes, lambda data, k: data[:16] + b'\xff' * 8 + data[24:]),
    ),
    Fault('ten times the rate', partial(_rate, 10.0)),
    Fault('a tenth of the rate', partial(_rate, 0.1)),
    Fault('silence and return', lambda bench: bench.rest(LONG + 1.0)),
    Fault('a second publisher of the same', partial(_twice, 0.0)),
    Fault('a second publisher that differs', partial(_twice, 0.05)),
)
"""What a joint state can be spoilt by."""
OTHER_FAULTS = (
    Fault(
        'NaN in a measured pose',
        partial(_beside, MEASURED_POSE, partial(_pose, (0.1, np.nan, 0.0))),
        ('deviation_analyzer', 'deviation_markers', 'live_diagnosis'),
    ),
    Fault(
        'a measured pose without orientation',
        partial(_beside, MEASURED_POSE, _zero_pose),
        ('deviation_analyzer', 'deviation_markers', 'live_diagnosis'),
    ),
    Fault(
        'random bytes as measured pose',
        partial(_beside, MEASURED_POSE, lambda b, k: np.random.default_rng(k).bytes(99)),
        ('deviation_analyzer', 'deviation_markers', 'live_diagnosis', 'recorder'),
    ),
    Fault(
        'measurements in another frame',
        partial(_beside, MEASURED_POSE, partial(_pose, FAR, frame='tracker')),
        ('deviation_analyzer', 'live_diagnosis'),
    ),
    Fault(
        'measurements a minute ahead of the others',
        partial(_beside, MEASURED_POSE, partial(_pose, FAR, ahead=60 * S)),
        ('deviation_analyzer', 'live_diagnosis'),
    ),
    Fault('a publisher of another type', _other_type),
    Fault('joint states in another namespace', _other_namespace),
    Fault('the clock goes back by a minute', partial(_clock, -60 * S)),
    Fault('the clock goes on by an hour', partial(_clock, HOUR), ()),
    Fault('the clock stands still', _frozen, ()),
    Fault(
        'twin killed and started again',
        partial(_restart, signal.SIGKILL, ['forward_kinematics_twin']),
        ('deviation_analyzer',),
    ),
    Fault(
        'injector and analyzer killed, started in the other order',
        partial(_restart, signal.SIGKILL, ['error_injector', 'deviation_analyzer']),
        ('deviation_markers',),
    ),
    Fault(
        'twin, analyzer, markers ended, started in turn',
        partial(
            _restart,
            signal.SIGTERM,
            ['deviation_markers', 'forward_kinematics_twin', 'deviation_analyzer'],
        ),
        (),
    ),
    Fault('discovery lost and found (twin hangs for 25 s)', _stopped, TAKE_JOINTS[1:]),
    Fault(
        'an infinite wrench',
        partial(_beside, TOOL_WRENCH, lambda b, k: b.make.wrench(b.stamp, np.full(6, np.inf))),
    ),
    Fault(
        'temperature in kelvin',
        partial(_beside, TEMPERATURE, lambda b, k: b.make.temperature(b.stamp, 294.0)),
    ),
)
"""What else can come, be missing or be stopped."""


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
        inputs = {name: _inputs(bench, name) for name in NODES}
        seen = {name: bool(entries) and all(entries) for name, entries in inputs.items()}
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
    # The campaign's own poses are stamped one nanosecond beside the beat.
    return sum(not _right(bench, m) for m in messages if m.header.stamp.nanosec % 10 != 1)


def _right(bench: Bench, message: Any) -> bool:
    published = np.column_stack([*from_messages.pose(message)][::-1])
    sent = bench.sent.get(from_messages.stamp_ns(message), ())
    return any(np.abs(forward(bench.robot, q)[:3] - published).max() < EXACT for q in sent)


def _summary(reported: list[tuple[str, str]]) -> dict[str, Any]:
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
        text = text if len(text) < 60 else f'{text[:40]}... ({len(text)} characters)'
        row = {'node': node, 'parameter': name, 'value': text, 'reason': answer.reason[:200]}
        rows.append(row | {'refused': not answer.successful})
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
    rows: list[dict[str, Any]] = []
    if not faults:
        return {'faults': rows, 'parameters': [], 'bag': {'passed': True, 'messages': 0}}
    with Cell(folder / 'cell') as cell:
        bench = Bench(cell, folder / 'bag')
        bench.ready()
        for fault in faults:
            try:
                rows.append(trial(bench, fault))
            except TimeoutError as error:  # the cell does not come back
                row = {'fault': fault.name, 'passed': False, 'nodes': {}}
                rows.append(row | {'reason': str(error)[:2000]})
            tell(_line(rows[-1]))
        parameters = abuse(bench)
    return {'faults': rows, 'parameters': parameters, 'bag': _recorded(folder / 'bag')}


def _scenes(
    scenes: Sequence[Any], folder: Path, tell: Callable[[str], None]
) -> list[dict[str, Any]]:
    rows = []
    for k, scene in enumerate(scenes):
        row = play(scene, folder / f'scene{k}')
        told = [
            f'{each["what"]} after {each["seconds"]:.1f} s: {each["said"]}'
            for each in row['told']
            if each['seconds'] is not None
        ]
        said = row.get('reason', '; '.join(told))
        tell(f'{"ok  " if row["passed"] else "FAIL"} {scene.name}: {said}')
        rows.append(row)
    return rows


def _line(row: dict[str, Any]) -> str:
    nodes = ' '.join(
        f'{name}:{node["told"]}{"" if node["passed"] else "(!)"}'
        for name, node in row['nodes'].items()
    )
    return f'{"ok  " if row["passed"] else "FAIL"} {row["fault"]}: {nodes}'


def _recorded(bag: Any) -> dict[str, Any]:
    """Tell whether the bag of the whole campaign opens and every message in it can be read."""
    count, reason = 0, ''
    try:
        with BagReader(bag) as reader:
            for _ in reader.messages(list(reader.topics)):
                count += 1
    except TwinError as error:
        reason = str(error)
    return {'passed': not reason, 'messages': count, 'reason': reason}


COLUMNS = {
    'forward_kinematics_twin': 'twin',
    'error_injector': 'injector',
    'deviation_analyzer': 'analyzer',
    'deviation_markers': 'markers',
    'live_diagnosis': 'diagnosis',
    'recorder': 'recorder',
}


def table(result: dict[str, Any]) -> str:
    passed = {True: 'yes', False: 'no'}
    rows = [
        (
            row['fault'],
            *(row['nodes'].get(name, {}).get('told', '') for name in COLUMNS),
            sum(node['wrong'] for node in row['nodes'].values()),
            passed[row['passed']],
        )
        for row in result['faults']
    ]
    columns: dict[str, Callable[[Any], object]] = {
        'fault': itemgetter('fault'),
        'done': itemgetter('what'),
        'node': lambda row: row['node'].lstrip('/'),
        'after [s]': shown('seconds', by='{:.1f}'),
        'what it said': itemgetter('said'),
        'passed': lambda row: passed[row['passed']],
    }
    scenes = [row | each for row in result['scenes'] for each in row['told'] if each['within_s']]
    messages = sum(bag['messages'] for bag in result['bags'].values())
    refused = sum(row['refused'] for row in result['parameters'])
    return (
        markdown.table(('fault', *COLUMNS.values(), 'wrong', 'passed'), *rows)
        + '\n'
        + tabled(columns, scenes)
        + f'\n{refused} of {len(result["parameters"])} absurd parameter values were refused in a '
        f'sentence. The bags of the whole campaign have {messages:,} messages; all of them can be '
        'read.\n'
    )
