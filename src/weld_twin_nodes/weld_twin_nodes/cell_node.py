# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What every node of the cell shares: settings, guarded inputs, and waiting for its listeners."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, ClassVar

from rclpy.node import Node

from weld_twin_core.errors import TwinError
from weld_twin_msgs_py.messages import ros_messages
from weld_twin_msgs_py.topics import Topic

from .settings import Setting

WARN_EVERY = 5.0
"""Seconds between two warnings about the same topic."""
READY_EVERY = 0.02
"""Seconds between two looks at whether the listeners are there."""

SHARED = (
    Setting('wait_for_subscribers', 0,
            'take no input before each output has this many subscribers [1]', 0, 100),
    Setting('reliable_inputs', False,
            'request reliable delivery; only for inputs whose publishers offer it'),
)  # fmt: skip


class CellNode(Node):
    """A node whose bad input costs a sentence and a sample, never a crash or a wrong output."""

    settings: ClassVar[tuple[Setting, ...]] = ()

    def __init__(self, name: str, **kwargs: Any) -> None:
        super().__init__(name, **kwargs)
        self.messages = ros_messages()
        self.refused = 0
        self.finished = False
        self._warned: dict[str, float] = {}
        self._outputs: list[Any] = []
        self._waiting: list[Callable[[], None]] = []
        for item in (*SHARED, *self.settings):
            self.declare_parameter(item.name, item.default, item.descriptor())

    def setting(self, name: str) -> Any:
        """Return the value of a parameter."""
        return self.get_parameter(name).value

    def offer(self, topic: Topic) -> Any:
        """Return a publisher of a topic of the table."""
        publisher = self.create_publisher(
            topic.message_class(), topic.name, topic.offered.to_rclpy()
        )
        self._outputs.append(publisher)
        return publisher

    def listen(self, topic: Topic, callback: Callable[[Any], None], *, raw: bool = False) -> None:
        """Subscribe to a topic of the table once the outputs have their subscribers."""
        def guarded(message: Any) -> None:
            try:
                callback(message)
            except TwinError as error:
                self.refuse(topic.name, str(error))

        def subscribe() -> None:
            wanted = topic.requested
            if self.setting('reliable_inputs'):
                wanted = replace(wanted, reliability=topic.offered.reliability)
            self.create_subscription(
                topic.message_class(), topic.name, guarded, wanted.to_rclpy(), raw=raw
            )

        self.when_ready(subscribe)

    def refuse(self, source: str, reason: str) -> None:
        """Count a sample that cannot be used, and say why, now and then."""
        self.refused += 1
        now = time.monotonic()
        if now - self._warned.get(source, -WARN_EVERY) >= WARN_EVERY:
            self._warned[source] = now
            self.get_logger().warning(f'{source}: {reason} ({self.refused} refused so far)')

    def when_ready(self, action: Callable[[], None]) -> None:
        """Run an action once every output has as many subscribers as it waits for."""
        if self.setting('wait_for_subscribers') == 0:
            action()
            return
        if not self._waiting:
            self._ready_timer = self.create_timer(READY_EVERY, self._look)
        self._waiting.append(action)

    def _look(self) -> None:
        wanted = self.setting('wait_for_subscribers')
        if any(output.get_subscription_count() < wanted for output in self._outputs):
            return
        self._ready_timer.cancel()
        waiting, self._waiting = self._waiting, []
        for action in waiting:
            action()
