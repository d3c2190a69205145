# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Plays a bag into the running nodes, for machines without `ros2 bag`."""

import time
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rosgraph_msgs.msg import Clock

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.bags import BagReader
from weld_twin_msgs_py.bags.reader import has_header
from weld_twin_msgs_py.messages.to_messages import ros_messages
from weld_twin_msgs_py.messages.topics import BY_NAME, DIAGNOSTICS, RELIABLE, Qos, Topic

from .health import Health, Output

CLOCK = '/clock'
SETTLE = 0.2
"""Seconds for the other side to see us, and for a clock that was set back to be noticed."""
LOOK = 0.02
"""Longest sleep [s]: so late an interruption may be noticed."""
ACKNOWLEDGED = 5.0
"""Seconds within which reliable readers confirm what was sent; one that takes longer hangs."""
TELL_EVERY = 1.0
"""Seconds between two lines about progress."""


class Playing(NamedTuple):
    """How to play."""

    rate: float = 1.0  # speed against the recording
    clock: float = 0.0  # how often to tell the recording's time on /clock [1/s]; 0 never
    topics: Collection[str] = ()  # what to play; empty for all
    loop: int = 1  # how often; 0 until stopped
    subscribers: int = 1  # how many each topic is to have before the start
    wait: float = 5.0  # longest time to wait for them [s]


def play(bag: Path | str, how: Playing, tell: Callable[[str], None]) -> int:
    """Play a bag; return how many messages were published."""
    if not 0.0 < how.rate < float('inf'):
        raise DataError(f'the rate must be positive, got {how.rate:g}')
    with BagReader(bag) as reader, _node() as node:
        outputs = _outputs(node, reader, how, tell)
        clock = _Ticker(node, how) if how.clock else None
        teller = _Teller(node, outputs.values())
        _await(node, outputs, how, tell)
        count = rounds = 0
        try:
            while how.loop == 0 or rounds < how.loop:
                count += _once(reader, outputs, how.rate, clock, teller)
                rounds += 1
                for output in outputs.values():
                    output.wait_for_all_acked(Duration(seconds=ACKNOWLEDGED))
                time.sleep(SETTLE)
        finally:
            teller.tell()
        return count


@contextmanager
def _node() -> Iterator[Node]:
    context = rclpy.Context()
    rclpy.init(context=context, signal_handler_options=SignalHandlerOptions.NO)
    node = Node('player', context=context)
    try:
        yield node
    finally:
        node.destroy_node()
        context.try_shutdown()


class _Ticker:
    """Tells the time of the recording on /clock."""

    def __init__(self, node: Node, how: Playing) -> None:
        self._publisher = node.create_publisher(Clock, CLOCK, 10)
        self._messages = ros_messages()
        self._period = 1.0 / how.clock
        self.next = 0.0

    def tick(self, ns: int) -> None:
        """Tell a time [ns]."""
        self._publisher.publish(Clock(clock=self._messages.time(ns)))
        self.next = time.monotonic() + self._period


class _Teller:
    """Tells on /diagnostics what was published, so that a recorder knows what it lacks."""

    def __init__(self, node: Node, outputs: Iterable[Output]) -> None:
        self._health = Health(node.get_fully_qualified_name(), float('inf'))
        self._health.outputs.extend(outputs)
        self._publisher = node.create_publisher(
            DIAGNOSTICS.message_class(), DIAGNOSTICS.name, DIAGNOSTICS.offered.to_rclpy()
        )
        self._messages = ros_messages()
        self._next = 0.0

    def now_and_then(self) -> None:
        """Tell, unless it was reported within the last second."""
        if time.monotonic() >= self._next:
            self._next = time.monotonic() + TELL_EVERY
            self._publish()

    def tell(self) -> None:
        """Tell the last word, and stay until it is heard."""
        self._publish()
        self._publisher.wait_for_all_acked(Duration(seconds=ACKNOWLEDGED))

    def _publish(self) -> None:
        self._publisher.publish(self._messages.statuses(time.time_ns(), self._health.statuses()))


def _outputs(
    node: Node, reader: BagReader, how: Playing, tell: Callable[[str], None]
) -> dict[str, Output]:
    wanted = [name if name.startswith('/') else f'/{name}' for name in how.topics]
    missing = [name for name in wanted if name not in reader.topics]
    if missing:
        raise DataError(f'the bag has no topic {missing[0]!r}; it has {", ".join(reader.topics)}')
    out = {}
    for name, (kind, count) in reader.topics.items():
        if count == 0 or (wanted and name not in wanted) or (how.clock and name == CLOCK):
            continue
        qos = BY_NAME[name].offered if name in BY_NAME else Qos(RELIABLE, 1000)
        try:
            message = Topic(name, kind, qos, qos, '').message_class()
        except ImportError:
            tell(f'{name}: the type {kind} is not installed here; it is left out')
            continue
        publisher = node.create_publisher(message, name, qos.to_rclpy())
        out[name] = Output(publisher, stamped=has_header(kind))
    return out


def _await(
    node: Node, outputs: dict[str, Output], how: Playing, tell: Callable[[str], None]
) -> None:
    """Wait for the subscribers; say whom nobody listens to when the time is over."""
    end = time.monotonic() + how.wait

    def lacking() -> list[str]:
        return [
            name
            for name, output in outputs.items()
            if output.get_subscription_count()
            < max(how.subscribers, node.count_subscribers(output.topic))
        ]

    while time.monotonic() < end and lacking():
        time.sleep(LOOK)
    if lacking():
        tell(
            f'waited {how.wait:g} s for {how.subscribers} subscribers of '
            f'{", ".join(lacking())}; playing without'
        )
    time.sleep(SETTLE)


def _once(
    reader: BagReader,
    outputs: dict[str, Output],
    rate: float,
    ticker: _Ticker | None,
    teller: _Teller,
) -> int:
    begin, first, count = 0.0, None, 0
    for topic, _, log_ns, data in reader.raw(list(outputs)):
        if first is None:
            first = log_ns
            if ticker is not None:
                ticker.tick(first)
                time.sleep(SETTLE)
            begin = time.monotonic()
        due = begin + (log_ns - first) * 1e-9 / rate
        while (now := time.monotonic()) < due:
            if ticker is not None and now >= ticker.next:
                ticker.tick(first + round((now - begin) * rate * 1e9))
            time.sleep(min(due - now, LOOK if ticker is None else max(ticker.next - now, 0.0)))
        outputs[topic].publish(bytes(data))
        teller.now_and_then()
        count += 1
    return count
