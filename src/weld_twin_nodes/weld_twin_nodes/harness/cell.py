# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A cell under test: its nodes, what is fed into it, what comes out, and waiting for it."""

from __future__ import annotations

import json
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np
import rclpy
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import GetParameters
from rclpy.client import Client
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from std_srvs.srv import Trigger

from weld_twin_core.errors import TwinError
from weld_twin_core.recording import JointMotion
from weld_twin_msgs_py.bags import BagReader
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.to_messages import ros_messages
from weld_twin_msgs_py.messages.topics import BY_NAME, DIAGNOSTICS, JOINT_STATES, Topic

from ..live.trajectory_generator import Pump
from ..offline.seam_motion import stamps
from .process import NodeProcess, own_domain, stop_all


class Tap:
    """Messages of one topic."""

    def __init__(self, topic: str) -> None:
        self.topic = topic
        self.messages: list[Any] = []

    def __len__(self) -> int:
        return len(self.messages)

    @property
    def last(self) -> Any:
        """Return the newest message."""
        return self.messages[-1]

    @property
    def stamps(self) -> np.ndarray:
        """Return the header stamps, int64 [ns]."""
        return np.array(
            [from_messages.stamp_ns(message) for message in self.messages], dtype=np.int64
        )


LEVELS = ('ok', 'warn', 'error', 'stale')


class HealthListener:
    """
    The statuses on /diagnostics, by name.

    Attributes
    ----------
    told : dict
        Level and message of every status since the last `clear`, by its name.
    values : dict
        The last key-value pairs, by name of the status.

    """

    def __init__(self, node: Node) -> None:
        self.told: dict[str, list[tuple[str, str]]] = defaultdict(list)
        self.values: dict[str, dict[str, str]] = {}
        node.create_subscription(
            DIAGNOSTICS.message_class(),
            DIAGNOSTICS.name,
            self._take,
            DIAGNOSTICS.requested.to_rclpy(),
        )

    def clear(self) -> None:
        """Forget what was reported, not the values."""
        self.told.clear()

    def of(self, node: str) -> list[tuple[str, str]]:
        """Return level and message of all statuses of a node, by its name with the namespace."""
        node = '/' + node.lstrip('/')
        return [
            entry
            for name, entries in self.told.items()
            if name == node or name.startswith(node + ': ')
            for entry in entries
        ]

    def _take(self, message: Any) -> None:
        for status in message.status:
            self.told[status.name].append((LEVELS[ord(status.level)], status.message))
        self.values |= from_messages.diagnostics(message)


DEEP = 20_000
"""Samples a tap may be behind: what collects must not lose what the nodes keep up with."""
LIMIT = 40.0
"""Seconds to wait for anything: on a crowded machine discovery alone has been seen to take ten."""
AGAIN = 2.0
"""Seconds after which a question is asked again."""
BURST = 50
"""Messages sent at once, and most that are under way without an answer."""
FIRST_STAMP = 1_000_000_000
"""Stamp of the first sample fed [ns]."""

N = TypeVar('N', bound=Node)


class CellTimeout(TimeoutError):
    """A condition did not come true in time; the message has the logs of the processes."""


class Cell:
    """
    A context manager that ends every node it started.

    folder: where logs and parameter files go; left out, a temporary directory.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._folder = folder
        self._stack = ExitStack()
        self.messages = ros_messages()
        self.processes: list[NodeProcess] = []
        self._started = 0
        self._nodes: list[Node] = []
        self._services: dict[str, Client] = {}

    def __enter__(self) -> Cell:
        """Take a domain and start listening."""
        try:
            self._open()
        except BaseException:
            self._stack.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        """End every node and give the domain back."""
        self._stack.close()

    def _open(self) -> None:
        if self._folder is None:
            self._folder = Path(self._stack.enter_context(tempfile.TemporaryDirectory()))
        self.domain = self._stack.enter_context(own_domain())
        self._context = rclpy.Context()
        rclpy.init(context=self._context, domain_id=self.domain)
        self._stack.callback(self._context.try_shutdown)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._stack.callback(self._executor.shutdown)
        self._stack.callback(self._remove_all)
        self.node = self.add(Node, 'harness')
        self._stack.callback(stop_all, self.processes)

    # Nodes -----------------------------------------------------------------------------------

    def start(self, node: str | Sequence[str], **parameters: Any) -> NodeProcess:
        """
        Start a node in a process of its own.

        node: a node of this package, or a whole command.
        parameters: its ROS parameters.
        """
        assert self._folder is not None
        folder = self._folder / f'{self._started:02d}'
        self._started += 1
        folder.mkdir(parents=True)
        self.processes.append(NodeProcess(node, parameters, folder))
        return self.processes[-1]

    def add(
        self,
        make: Callable[..., N],
        *args: Any,
        cli_args: list[str] | None = None,
        **parameters: Any,
    ) -> N:
        """
        Put a node into this process; it is served while the cell waits.

        make: takes ``context``, ``parameter_overrides`` and ``cli_args`` as `rclpy.node.Node`
        does.
        args: its other arguments.
        cli_args: such as remappings.
        parameters: its ROS parameters.
        """
        overrides = [Parameter(name, value=value) for name, value in parameters.items()]
        node = make(*args, context=self._context, parameter_overrides=overrides, cli_args=cli_args)
        self._executor.add_node(node)
        self._nodes.append(node)
        return node

    def remove(self, node: Node) -> None:
        """Take a node out of this process."""
        self._nodes.remove(node)
        self._executor.remove_node(node)
        node.destroy_node()

    def set_parameter(self, node: str, name: str, value: Any) -> SetParametersResult:
        """Set a parameter of a running node, as `ros2 param set` does."""
        client = AsyncParameterClient(self.node, node)
        self.wait(client.services_are_ready, f'the parameters of {node}')
        wanted = [Parameter(name, value=value)]
        answer = self.ask(partial(client.set_parameters, wanted), f'{node} to take {name}')
        return cast('SetParametersResult', answer.results[0])

    def ask(self, question: Callable[[], Any], what: str) -> Any:
        """
        Return the answer to a question that may be put more than once.

        question: puts it to a service, and returns the future of the answer.
        what: what is waited for, in words.
        """
        asked = _Asked(question)
        self.wait(asked.answered, what)
        return asked.answer()

    def trigger(self, service: str) -> Trigger.Response:
        """Call a Trigger service."""
        if service not in self._services:
            self._services[service] = self.node.create_client(Trigger, service)
        client = self._services[service]
        self.wait(client.service_is_ready, service)
        answer = self.ask(partial(client.call_async, Trigger.Request()), f'{service} to answer')
        return cast('Trigger.Response', answer)

    # Streams ---------------------------------------------------------------------------------

    def collect(self, topic: str, kind: Any = None) -> Tap:
        """
        Listen to a topic from now on.

        kind: not needed for topics of this project's table.
        """
        tap = Tap(topic)
        row = BY_NAME.get(topic)
        if kind is None:
            if row is None:
                raise TwinError(f'{topic!r} is not in the table of topics; say its message class')
            kind = row.message_class()
        self.node.create_subscription(
            kind,
            topic,
            tap.messages.append,
            DEEP if row is None else replace(row.offered, depth=DEEP).to_rclpy(),
        )
        return tap

    def publisher(self, topic: Topic = JOINT_STATES) -> Any:
        """Return a publisher that somebody listens to already."""
        out = self.node.create_publisher(
            topic.message_class(), topic.name, topic.offered.to_rclpy()
        )
        self.wait(lambda: out.get_subscription_count() > 0, f'a subscriber of {topic.name}')
        self.meet()
        return out

    def feed(
        self,
        motion: JointMotion,
        joint_names: Sequence[str],
        *,
        start_ns: int = FIRST_STAMP,
        listeners: int = 1,
        follow: Tap | None = None,
        window: int = BURST,
    ) -> None:
        """
        Publish a motion as joint states, as fast as the cell keeps up.

        start_ns: [ns]
        listeners: how many subscribers to wait for.
        follow: the last result of a joint state; at most ``window`` are under way without one.
        """
        publisher = self.publisher()
        self.wait(lambda: publisher.get_subscription_count() >= listeners, 'all subscribers')
        marks = stamps(motion.t, start_ns)
        pump = Pump(marks, playback=0.0, window=window, answered=follow is not None)

        def send() -> bool:
            if follow:
                pump.answer(from_messages.stamp_ns(follow.last))
            for k in pump.due(time.monotonic_ns(), BURST):
                state = int(marks[k]), joint_names, motion.q[k], motion.velocity[k]
                publisher.publish(self.messages.joint_state(*state))
            return pump.done

        self.wait(send, 'the motion to be taken', limit=LIMIT + 0.01 * motion.t.size)

    def play(self, bag: Path | str, topics: Sequence[str], *, speed: float = 1.0) -> None:
        """
        Publish topics of a bag as they were recorded, so many times as fast.

        Each topic needs a subscriber; the type comes from this project's table.
        """
        with BagReader(bag) as reader:
            messages = list(reader.raw(topics))
        publish = {topic: self.publisher(BY_NAME[topic]).publish for topic in topics}
        marks = np.array([log_ns for _, _, log_ns, _ in messages])
        pump = Pump(marks, playback=speed, window=BURST, answered=False)

        def send() -> bool:
            for k in pump.due(time.monotonic_ns(), BURST):
                publish[messages[k][0]](bytes(messages[k][3]))
            return pump.done

        whole = (int(marks[-1]) - int(marks[0])) * 1e-9 / speed if messages else 0.0
        self.wait(send, f"'{bag}' to be played", limit=LIMIT + whole)

    def wait_recorded(self, counts: Mapping[str, int], recorder: str = '/recorder') -> None:
        """
        Wait until the recorder holds at least so many messages of each topic.

        Raises CellTimeout: it has taken in nothing more for `LIMIT` seconds; the message says what
        is missing.
        """
        recorded: dict[str, int] = {}

        def lacking() -> str:
            short = [
                f'{recorded.get(topic, 0)} of {count} on {topic}'
                for topic, count in counts.items()
                if recorded.get(topic, 0) < count
            ]
            return f'the recorder, which holds {", ".join(short)}'

        def all_there() -> bool:
            recorded.update(json.loads(self.trigger(f'{recorder}/counts').message))
            return all(recorded.get(topic, 0) >= count for topic, count in counts.items())

        self.wait(all_there, lacking, progress=lambda: str(recorded))

    # Waiting ---------------------------------------------------------------------------------

    def wait(
        self,
        condition: Callable[[], bool],
        what: str | Callable[[], str],
        limit: float = LIMIT,
        progress: Callable[[], object] | None = None,
    ) -> None:
        """
        Serve the nodes of this process until a condition is true.

        what: what is waited for, in words.
        limit: longest wait [s]; with ``progress`` longest time in which that stays the same.
        progress: how far it is.

        Raises CellTimeout: it is not true in time, or a process has died of an error meanwhile.
        """
        end, so_far = time.monotonic() + limit, None
        while not condition():
            event = what if isinstance(what, str) else what()
            if any(process.code for process in self.processes):
                raise CellTimeout(f'a node died before {event}' + ''.join(self._logs()))
            if progress is not None and (now := progress()) != so_far:
                end, so_far = time.monotonic() + limit, now
            if time.monotonic() > end:
                raise CellTimeout(f'waited {limit:g} s for {event}' + ''.join(self._logs()))
            self._executor.spin_once(timeout_sec=0.02)

    def meet(self) -> None:
        """
        Wait until the started nodes know what listens and publishes here.

        Discovery is one-sided: a node this process sees may not see the taps of this process yet,
        and what it publishes until then is lost to them. Endpoints are announced in order, so a
        node that answers a client made after the taps knows the taps.
        """
        for process in self.processes:
            if process.code is not None or not process.known:
                continue
            client = self.node.create_client(GetParameters, f'/{process.name}/get_parameters')
            self.wait(client.service_is_ready, f'the parameters of {process.name}')
            question = partial(client.call_async, GetParameters.Request())
            self.ask(question, f'{process.name} to answer')
            self.node.destroy_client(client)

    def _logs(self) -> Iterator[str]:
        for process in self.processes:
            state = 'running' if process.code is None else f'ended with {process.code}'
            yield f'\n--- {process.name}, {state}\n{process.log[-2000:]}'

    def _remove_all(self) -> None:
        for node in list(self._nodes):
            self.remove(node)


class _Asked:
    """
    A question put to a service again and again.

    A server may not know yet who asks, and its answer is lost; one that was killed seems ready.
    """

    def __init__(self, question: Callable[[], Any]) -> None:
        self._question = question
        self._answers: list[Any] = []
        self._due = time.monotonic()

    def answered(self) -> bool:
        """Return whether there is an answer; ask anew where it stays out."""
        if time.monotonic() >= self._due:
            self._answers.append(self._question())
            self._due = time.monotonic() + AGAIN
        return any(answer.done() for answer in self._answers)

    def answer(self) -> Any:
        """Return the answer."""
        return next(answer for answer in self._answers if answer.done()).result()
