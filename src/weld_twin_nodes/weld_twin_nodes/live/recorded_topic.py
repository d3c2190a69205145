# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One topic being recorded: its type, its quality of service, what came of it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from weld_twin_core.errors import TwinError
from weld_twin_msgs_py.bags.reader import has_header
from weld_twin_msgs_py.messages.cdr_read import checked
from weld_twin_msgs_py.messages.topics import (
    BEST_EFFORT,
    LATCHED,
    RELIABLE,
    VOLATILE,
    Qos,
    Topic,
)

from . import qos_events
from .cell_node import CellNode
from .message_classes import message_class
from .outputs import Sent, header_stamp
from .partners import full_name

DEEP = 10_000
"""
Messages that may wait for a recorder that stands still: ten seconds at 1 kHz, where a thousand
were seen to run over after two at 500 Hz. The middleware takes memory only for those that wait.
"""


class RecordedTopic:
    """
    A subscription that takes every message as bytes, with the quality of service offered.

    It asks for reliable delivery until a publisher is seen that does not offer it: what comes
    before the first look at the publishers is then not lost either.

    Parameters
    ----------
    name : str
        Resolved: with remappings and namespace.
    kind : str
        Message type.
    row : Topic, optional
        Of the table of topics, where it is one of them.
    write : callable
        Takes the topic and the bytes of a message.

    Attributes
    ----------
    announced : bool
        Whether the bag was told of it; the writer's to set.

    Raises
    ------
    ImportError
        Its type is not installed here.

    """

    def __init__(
        self,
        node: CellNode,
        name: str,
        kind: str,
        row: Topic | None,
        write: Callable[[RecordedTopic, bytes], None],
    ) -> None:
        self.name = name
        self._node, self._write = node, write
        self._take_kind(kind)
        self._state = node.watch(
            name, required=False, steady=row.steady if row is not None else False
        )
        self.announced = False
        self._unknown: set[str] = set()
        self._first: bytes | None = None
        self._last: bytes | None = None
        latched = row is not None and row.requested.durability == LATCHED
        self._chosen = node.overrides.has(name, 'subscription')
        wanted = node.overrides.of(
            name, 'subscription', Qos(RELIABLE, DEEP, LATCHED if latched else VOLATILE)
        )
        self._qos = self.suited(wanted)
        self._subscription: Any = self._subscribe()

    @property
    def taken(self) -> Sent:
        """Return what came and was handed on."""
        count = self._state.received - self._state.refused
        if not self._stamped or self._first is None or self._last is None:
            return Sent(count)
        return Sent(count, header_stamp(self._first), header_stamp(self._last))

    def suited(self, qos: Qos) -> Qos:
        """Return a quality of service that every publisher can serve, unless one was chosen."""
        if self._chosen:
            return qos
        offers = [info.qos_profile for info in self.publishers()]
        reliability, durability = qos.reliability, qos.durability
        forced = self._node.setting('reliable_inputs')
        if not forced and any(offer.reliability.name == 'BEST_EFFORT' for offer in offers):
            reliability = BEST_EFFORT
        if any(offer.durability.name == 'VOLATILE' for offer in offers):
            durability = VOLATILE
        return Qos(reliability, qos.depth, durability)

    def publishers(self) -> list[Any]:
        """Return what the graph tells of the publishers of the same type."""
        infos = self._node.get_publishers_info_by_topic(self.name)
        return [info for info in infos if info.topic_type == self.kind]

    def _take_kind(self, kind: str) -> None:
        """Be ready for a message type."""
        self._class = message_class(kind)
        self.kind = kind
        self._check = checked(kind)
        self._stamped = has_header(kind)

    def _other_kind(self) -> str:
        """Return the type that all publishers have, where that is another one; else nothing."""
        infos = self._node.get_publishers_info_by_topic(self.name)
        kinds = {info.topic_type for info in infos} - self._unknown
        return '' if len(kinds) != 1 else next(iter(kinds - {self.kind}), '')

    def publishing_nodes(self) -> set[str]:
        """Return the full names of the nodes that publish it."""
        return {full_name(info) for info in self.publishers()}

    def adapt(self) -> None:
        """Subscribe anew where a publisher has come that the subscription does not suit."""
        if self._subscription is None:
            self._try_to_subscribe()
            return
        self._state.matched = self._subscription.get_publisher_count()
        other = self._other_kind()
        if other:
            self._change_to(other)
            return
        qos = self.suited(self._qos)
        if qos == self._qos:
            return
        self.take_waiting()
        self._node.destroy_subscription(self._subscription)
        self._node.get_logger().info(
            f'{self.name}: a publisher offers {qos.reliability}, {qos.durability}; it is taken so'
        )
        self._qos = qos
        self._subscription = self._subscribe()

    def _change_to(self, kind: str) -> None:
        """Take another type from the next look on: a process knows one type of a topic at a time."""
        self.take_waiting()
        try:
            self._take_kind(kind)
        except ImportError as error:
            self._unknown.add(kind)
            self._node.mismatch(self.name, f'{self.name} carries what cannot be recorded: {error}')
            return
        self._node.destroy_subscription(self._subscription)
        self._subscription, self.announced = None, False
        self._node.get_logger().info(f'{self.name} is recorded as {kind} from now on')

    def _try_to_subscribe(self) -> None:
        with suppress(
            RuntimeError
        ):  # the executor still holds the one before; again at the next look
            self._qos = self.suited(self._qos)
            self._subscription = self._subscribe()

    def take_waiting(self) -> int:
        """Take what has reached this process and waits for its turn; return how many there were."""
        if self._subscription is None:
            return 0
        handle, count = self._subscription.handle, 0
        with handle:
            while count < DEEP:
                taken = handle.take_message(self._subscription.msg_type, True)
                if taken is None:
                    break
                self._take(taken[0])
                count += 1
        return count

    def close(self) -> None:
        """Take nothing more."""
        if self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
        self._node.unwatch(self.name)

    def _subscribe(self) -> Any:
        return self._node.create_subscription(
            self._class,
            self.name,
            self._take,
            self._qos.to_rclpy(),
            raw=True,
            event_callbacks=qos_events.of_subscription(self.name, self._qos, self._mismatched),
        )

    def _mismatched(self, sentence: str) -> None:
        """Tell of a publisher that `adapt` will not follow."""
        if self.suited(self._qos) == self._qos:
            self._node.mismatch(self.name, sentence)

    def _take(self, data: bytes) -> None:
        self._state.arrived()
        try:
            whole = self._check(data)
        except TwinError as error:
            self._node.refuse(self.name, str(error))
            return
        if self._first is None:
            self._first = whole
        self._last = whole
        if self._stamped:
            self._state.stamped(header_stamp(whole))
        self._write(self, whole)
