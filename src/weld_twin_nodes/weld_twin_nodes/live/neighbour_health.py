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

from .outputs import NODE, REACHED, RUN
from .typed_input import reader

Statuses = dict[str, dict[str, str]]
"""Names of statuses on `/diagnostics`, and what each tells by its keys."""
Hearer = Callable[[Statuses], None]
ALIVE = 2.0
"""Seconds after its last word from which a node may stand still: each tells of itself once a second."""


class NeighbourHealth:
    """One subscription of a node, for all of its parts that ask what the others tell."""

    def __init__(self, node: Node) -> None:
        self._read = reader(DIAGNOSTICS.type)
        self._told_at: dict[str, float] = {}
        self._runs: dict[str, dict[str, float]] = {}
        self._twice: dict[str, float] = {}
        self._hearers: list[Hearer] = []
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
        now = time.monotonic()
        return {node for node, reported in self._told_at.items() if now - reported < ALIVE}

    def twice(self, node: str) -> bool:
        """Return whether two nodes of one name tell of themselves."""
        return time.monotonic() - self._twice.get(node, -2.0 * ALIVE) < 2.0 * ALIVE

    def _take_run(self, node: str, run: str, now: float) -> None:
        """Take note of a start of a node: it runs twice where another spoke between two of its words."""
        reported = {
            each: at for each, at in self._runs.get(node, {}).items() if now - at < 2.0 * ALIVE
        }
        if any(at > reported.get(run, now) for at in reported.values()):
            self._twice[node] = now
        self._runs[node] = {**reported, run: now}

    def _take(self, data: bytes) -> None:
        """Hand on what nodes of the project tell; statuses of others are not even read."""
        if REACHED.encode() not in data:
            return
        try:
            statuses = from_messages.diagnostics(self._read(data))
        except TwinError:  # somebody else's, and none of the inputs
            return
        now = time.monotonic()
        for row in statuses.values():
            if NODE in row:
                self._told_at[row[NODE]] = now
                self._take_run(row[NODE], row.get(RUN, ''), now)
        for hearer in [*self._hearers]:
            hearer(statuses)
