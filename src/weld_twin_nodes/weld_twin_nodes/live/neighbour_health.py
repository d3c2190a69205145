# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the nodes of the project beside a node tell of their health, and which of them are alive."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rclpy.node import Node

from weld_twin_core.errors import TwinError
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.topics import DIAGNOSTICS

from .reading import reader
from .words import ALIVE, REACHED, Book, Word, word

Hearer = Callable[[Word], None]


class NeighbourHealth:
    """One subscription of a node, for all of its parts that ask what the others tell."""

    def __init__(self, node: Node) -> None:
        self._read = reader(DIAGNOSTICS.type)
        self._book = Book()
        self._hearers: list[Hearer] = [self._book.take]
        self._subscription: Any = node.create_subscription(
            DIAGNOSTICS.message_class(),
            DIAGNOSTICS.name,
            self._take,
            DIAGNOSTICS.requested.to_rclpy(),
            raw=True,
        )

    def hear(self, hearer: Hearer) -> None:
        """Hand on what they tell from now on."""
        self._hearers.append(hearer)

    def hear_no_more(self, hearer: Hearer) -> None:
        """End what `hear` began."""
        self._hearers.remove(hearer)

    def alive(self) -> set[str]:
        """Return the nodes that have told of themselves just now, also where none is served."""
        handle = self._subscription.handle
        with handle:
            while (taken := handle.take_message(self._subscription.msg_type, True)) is not None:
                self._take(taken[0])
        return self._book.nodes(time.monotonic() - ALIVE)

    def twice(self, node: str) -> bool:
        """Return whether two nodes of one name tell of themselves."""
        return self._book.twice(node, time.monotonic())

    def _take(self, data: bytes) -> None:
        """Hand on what nodes of the project tell; statuses of others are not even read."""
        if REACHED.encode() not in data:
            return
        try:
            told = word(from_messages.diagnostics(self._read(data)), time.monotonic())
        except TwinError:  # somebody else's, and none of the inputs
            return
        if told is not None:
            for hearer in [*self._hearers]:
                hearer(told)
