# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The faults: what is done to the cell, and who is to tell of it."""

from __future__ import annotations

import signal
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from rclpy.serialization import serialize_message

from weld_twin_msgs_py.messages.topics import (
    JOINT_STATES,
    MEASURED_POSE,
    TEMPERATURE,
    TOOL_WRENCH,
    Topic,
)

from .fault_scenes import RATE, Bench, S

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
    """One fault."""

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


def _noise(_: bytes, k: int) -> bytes:
    return np.random.default_rng(k).bytes(200)


def _promise(data: bytes, _: int) -> bytes:
    return data[:16] + b'\xff' * 8 + data[24:]


def _foreign(bench: Bench) -> None:
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
    Fault("another robot's joints", _foreign),
    Fault('degrees', partial(_third, partial(_with, 'position', np.degrees))),
    Fault('stamp zero', partial(_third, _unset)),
    Fault('stamps that go back', partial(_third, partial(_shifted, -2 * S))),
    Fault('a stamp an hour ahead', _future),
    Fault('random bytes', partial(_bytes, _noise)),
    Fault('a message cut short', partial(_bytes, lambda data, k: data[: 4 + k % 100])),
    Fault('no bytes', partial(_bytes, lambda data, k: b'')),
    Fault('a length of four thousand million', partial(_bytes, _promise)),
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
