# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Keeps what the nodes tell of their health."""

from __future__ import annotations

from collections import defaultdict
from typing import Any

from rclpy.node import Node

from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.topics import DIAGNOSTICS

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
        """Forget what was told, not the values."""
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
