# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A publisher that knows what it has sent, so that whoever listens can ask what it lacks."""

from __future__ import annotations

from struct import unpack_from
from typing import Any

from rclpy.duration import Duration

from .words import Sent

CDR_HEADER = 4
"""Bytes before the first field of a serialised message."""


class Output:
    """
    A publisher that counts.

    stamped: its messages begin with a header.

    Attributes
    ----------
    topic : str
        Under which name it publishes, remapped and in its namespace.

    """

    def __init__(self, publisher: Any, *, stamped: bool) -> None:
        self.publisher = publisher
        self.topic: str = publisher.topic_name
        self._send = publisher.publish
        self._stamped = stamped
        self._count = 0
        self._first: Any = None
        self._last: Any = None

    def publish(self, message: Any) -> None:
        """Publish a message, or the bytes of one."""
        self._send(message)
        self._count += 1
        self._last = message
        if self._first is None:
            self._first = message

    def get_subscription_count(self) -> int:
        """Return how many subscriptions the middleware has matched."""
        return int(self.publisher.get_subscription_count())

    def wait_for_all_acked(self, longest: Duration) -> bool:
        """Wait until all reliable subscribers have everything; return whether they have."""
        return bool(self.publisher.wait_for_all_acked(longest))

    @property
    def sent(self) -> Sent:
        """Return what was published so far."""
        if not self._stamped or self._first is None:
            return Sent(self._count)
        return Sent(self._count, header_stamp(self._first), header_stamp(self._last))


def header_stamp(message: Any) -> int:
    """Return the header stamp of a message, or of the bytes of one [ns]."""
    if isinstance(message, bytes | bytearray | memoryview):
        order = '<' if message[1] else '>'
        sec, nanosec = unpack_from(order + 'iI', message, CDR_HEADER)
    else:
        sec, nanosec = message.header.stamp.sec, message.header.stamp.nanosec
    return int(sec) * 1_000_000_000 + int(nanosec)
