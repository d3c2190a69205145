# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A publisher that knows what it has sent, so that a recorder can ask what it lacks."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from struct import unpack_from
from typing import Any, NamedTuple

from rclpy.duration import Duration

SENT, REACHED, HEARD, RUN, NODE = 'sent', 'reached', 'heard', 'run', 'node'
"""Keys of a node's health: what it sent by topic, how many subscriptions it reaches by topic, how
many publishers it hears by topic and how many messages came, a number of its own for every start,
and its name with the namespace."""
CDR_HEADER = 4
"""Bytes before the first field of a serialised message."""


class Sent(NamedTuple):
    """
    What was published on a topic.

    Attributes
    ----------
    first, last : int, optional [ns]
        Header stamps of the first and the last message, where the type has a header.

    """

    number: int
    first: int | None = None
    last: int | None = None


class Heard(NamedTuple):
    """
    What one input of a node has of its topic.

    Attributes
    ----------
    publishers : int
        Whose messages reach it, by the middleware of its own process.
    received : int
        Messages.

    """

    publishers: int
    received: int


class Output:
    """
    A publisher that counts.

    Parameters
    ----------
    publisher : rclpy Publisher
    stamped : bool
        Its messages begin with a header.

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


def told(outputs: Iterable[Output]) -> str:
    """Return what outputs have sent, as the text that a node's health carries."""
    return json.dumps({output.topic: list(output.sent) for output in outputs})


def reached(outputs: Iterable[Output]) -> str:
    """Return how many subscriptions outputs reach, as the text that a node's health carries."""
    return json.dumps({output.topic: output.get_subscription_count() for output in outputs})


def read_reached(values: Mapping[str, str]) -> dict[str, int]:
    """Return how many subscriptions a node reaches, by topic; empty for anybody else's health."""
    try:
        return {str(topic): int(count) for topic, count in json.loads(values[REACHED]).items()}
    except (KeyError, ValueError, TypeError, AttributeError):
        return {}


def read_heard(values: Mapping[str, str]) -> dict[str, Heard]:
    """Return what a node hears, by topic; empty for anybody else's health."""
    try:
        rows = json.loads(values[HEARD])
        return {str(topic): Heard(int(row[0]), int(row[1])) for topic, row in rows.items()}
    except (KeyError, ValueError, TypeError, AttributeError, IndexError):
        return {}


def read_told(values: Mapping[str, str]) -> dict[str, Sent]:
    """Return what a node's health says it has sent, by topic; empty for anybody else's."""
    try:
        rows = json.loads(values[SENT])
        return {str(topic): Sent(int(row[0]), row[1], row[2]) for topic, row in rows.items()}
    except (KeyError, ValueError, TypeError, AttributeError, IndexError):
        return {}
