# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a node of the project tells of itself once a second, in the values of its health.

Whom it reaches and what it sent only a node itself knows: others have graphs of their own.
"""

import json
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

from rclpy.node import Node
from rclpy.serialization import deserialize_message

from weld_twin_core.errors import DataError, TwinError
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.cdr import READERS, decoder
from weld_twin_msgs_py.messages.topics import DIAGNOSTICS, JOINT_STATES, message_class

SENT, REACHED, HEARD, RUN, NODE = 'sent', 'reached', 'heard', 'run', 'node'
"""Keys of the health: what it sent by topic, how many subscriptions it reaches by topic, how many
publishers it hears by topic and how many messages came, a number of its own for every start, and
its name with the namespace."""
ALIVE = 2.0
"""Seconds after its last word from which a node may stand still."""
UNDER_WAY = 0.5
"""Seconds after which what was sent counts as due at every listener; a message takes milliseconds."""
Statuses = dict[str, dict[str, str]]
"""Names of statuses on `/diagnostics`, and what each tells by its keys."""


class Sent(NamedTuple):
    """What was published on a topic."""

    number: int
    first: int | None = None
    last: int | None = None
    """Header stamps of the first and the last message, where the type has a header [ns]."""


class Heard(NamedTuple):
    """What one input of a node has of its topic."""

    publishers: int  # whose messages reach it, by the middleware of its own process
    received: int  # messages


class Word(NamedTuple):
    """What a node said at a time."""

    node: str
    run: str  # number of its start
    at: float  # when it was heard [s]
    inputs: frozenset[str]  # topics that it listens to
    sent: Mapping[str, Sent]
    reached: Mapping[str, int]
    heard: Mapping[str, Heard]
    """By topic: what it sent, how many subscriptions it reaches, what it has heard."""


def word(statuses: Statuses, at: float) -> Word | None:
    """Return what the health of a node says; None for the health of somebody else."""
    values = next((each for each in statuses.values() if NODE in each), None)
    if values is None:
        return None
    node = values[NODE]
    names = (name.partition(': ') for name in statuses)
    return Word(
        node,
        values.get(RUN, ''),
        at,
        frozenset(topic for owner, _, topic in names if topic and owner == node),
        _by_topic(values.get(SENT), lambda row: Sent(int(row[0]), row[1], row[2])),
        _by_topic(values.get(REACHED), int),
        _by_topic(values.get(HEARD), lambda row: Heard(int(row[0]), int(row[1]))),
    )


def _by_topic(text: str | None, read: Callable[[Any], Any]) -> dict[str, Any]:
    """Return values by topic; empty where the text is none of ours."""
    try:
        return {str(topic): read(row) for topic, row in json.loads(text or '').items()}
    except (ValueError, TypeError, AttributeError, IndexError):
        return {}


class Book:
    """The words of nodes; each start of a node counts by itself."""

    def __init__(self) -> None:
        self._words: dict[tuple[str, str], deque[Word]] = {}

    def take(self, each: Word) -> None:
        self._words.setdefault((each.node, each.run), deque(maxlen=2)).append(each)

    def last(self) -> Iterator[Word]:
        """Yield the last word of every start of every node."""
        return (words[-1] for words in self._words.values())

    def latest(self) -> list[Word]:
        """Return the last word of every node, whichever of its starts said it."""
        return [*{each.node: each for each in sorted(self.last(), key=lambda w: w.at)}.values()]

    def nodes(self, since: float = 0.0) -> set[str]:
        """Return the nodes that have reported since a time [s]."""
        return {each.node for each in self.last() if each.at >= since}

    def tellers(self, topic: str) -> set[str]:
        """Return the nodes that said they sent messages on a topic."""
        return {each.node for each in self.last() if topic in each.sent}

    def twice(self, node: str, now: float) -> bool:
        """Return whether a node runs twice: another start of it spoke between two words of one."""
        runs = [words for (name, _), words in self._words.items() if name == node]
        return any(
            len(own) > 1 and own[-2].at < other[-1].at < own[-1].at > now - 2.0 * ALIVE
            for own in runs
            for other in runs
        )

    def sent(self, topic: str) -> Sent | None:
        """Return what was sent on a topic by all who said so, None if nobody did."""
        rows = [each.sent[topic] for each in self.last() if topic in each.sent]
        if not rows:
            return None
        firsts = [row.first for row in rows if row.first is not None]
        lasts = [row.last for row in rows if row.last is not None]
        count = sum(row.number for row in rows)
        return Sent(count, min(firsts, default=None), max(lasts, default=None))

    def due(self, topic: str, at: float) -> int:
        """Return how many messages on a topic every listener should have at a time [s]."""
        early = ([w for w in words if w.at <= at - UNDER_WAY] for words in self._words.values())
        last = (words[-1].sent.get(topic) for words in early if words)
        return sum(sent.number for sent in last if sent is not None)


def reader(kind: str) -> Callable[[bytes], Any]:
    """
    Return what turns serialised messages of a type into objects.

    Types of other than standard packages differ by release, and are read by their package.
    """
    if kind in READERS or kind == JOINT_STATES.type:
        return decoder(kind)
    of = message_class(kind)

    def read(data: bytes) -> Any:
        try:
            return deserialize_message(bytes(data), of)
        except Exception as error:  # rclpy raises bare RuntimeError and what numpy raises
            raise DataError(
                f'{len(data)} bytes that are no {kind} ({error}); something else publishes there'
            ) from None

    return read


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
        """Return the nodes that have reported just now, also where none is served."""
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
            heard = word(from_messages.diagnostics(self._read(data)), time.monotonic())
        except TwinError:  # somebody else's, and none of the inputs
            return
        if heard is not None:
            for hearer in [*self._hearers]:
                hearer(heard)
