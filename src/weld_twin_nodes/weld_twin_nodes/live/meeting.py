# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""When a node that speaks first may begin: the nodes beside it are there and reach each other."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from typing import Any

from .all_nodes import MODULES
from .cell_node import CellNode
from .words import Book

QUIET = 1.0
"""
Seconds without a change on the graph after which nobody else is taken to be coming. Nodes that
are started together appear within some tenths of a second of each other.
"""
LOOK_EVERY = 0.05
"""Seconds between two looks at who is there."""
Count = Callable[[str], int]


def apart(book: Book, there: Collection[str]) -> list[str]:
    """
    Return whose word or whose listeners are still to come, among the nodes there are.

    The graph a node sees is its own: that two others have not found each other yet, only they know,
    and one of the two may know it before the other.
    """
    told = [word for word in book.latest() if word.node in there]
    known = [node for node in there if node.rpartition('/')[2] in MODULES]
    out = [f'{node} to tell of itself' for node in known if node not in book.nodes()]
    for word in told:
        for topic, count in word.reached.items():
            wanted = [other.node for other in told if topic in other.inputs]
            if count < len(wanted):
                out.append(f'{word.node} to reach {" and ".join(wanted)} on {topic}')
    for word in told:
        for topic, heard in word.heard.items():
            wanted = [other.node for other in told if topic in other.reached]
            if heard.publishers < len(wanted):
                out.append(f'{word.node} to hear {" and ".join(wanted)} on {topic}')
    return out


def beyond(book: Book, there: Collection[str], publishers: Count, subscribers: Count) -> list[str]:
    """
    Return whom the nodes that are there have met and the own graph does not show yet.

    publishers, subscribers: from the name of a topic to how many the own graph has.
    """
    out = []
    for word in book.latest():
        if word.node in there:
            out += [
                f'somebody to be seen who sends {topic} to {word.node}'
                for topic, heard in word.heard.items()
                if publishers(topic) < heard.publishers
            ]
            out += [
                f'somebody to be seen who takes {topic} from {word.node}'
                for topic, count in word.reached.items()
                if subscribers(topic) < count
            ]
    return out


class Meeting:
    """
    Runs an action once, when the listeners of a node are there.

    With ``wait_for_subscribers`` it waits for that many. Without, for a graph that has at least
    one listener and no longer changes, on which the nodes of the project reach each other. Either
    wait has an end, at which it says what is missing.

    within: longest wait [s].
    """

    def __init__(self, node: CellNode, within: float, action: Callable[[], None]) -> None:
        self._node, self._within, self._action = node, within, action
        self._begun = self._changed = time.monotonic()
        self._seen: Any = None
        self._book = Book()
        node.neighbours.hear(self._book.take)
        self._timer = node.every(LOOK_EVERY, self._look)

    def _look(self) -> None:
        now = time.monotonic()
        missing = self._missing(now)
        if missing and now - self._begun <= self._within:
            self._node.wait_for(missing)
            return
        if missing:
            self._node.tell_once(f'waited {self._within:g} s for {missing}; beginning without')
        self._node.wait_for('')
        self._timer.cancel()
        self._node.neighbours.hear_no_more(self._book.take)
        self._action()

    def _missing(self, now: float) -> str:
        """Return what is still to come, empty when nothing is."""
        node = self._node
        if node.setting('wait_for_subscribers'):
            unmet = node.lacking() or [f'{topic} to be matched' for topic in node.unmatched()]
            return ', '.join(unmet)
        seen = (sorted(node.get_node_names_and_namespaces()), node.listeners(), node.unmatched())
        if seen != self._seen:
            self._seen, self._changed = seen, now
        if not any(node.listeners().values()):
            return f'somebody to listen to {" or ".join(node.listeners())}'
        there = {f'{space.rstrip("/")}/{name}' for name, space in seen[0]}
        unmet = apart(self._book, there)
        unmet += beyond(self._book, there, node.count_publishers, node.count_subscribers)
        if unmet:
            return ', '.join(unmet)
        if node.unmatched() or now - self._changed < QUIET:
            return 'the listeners to be complete'
        return ''
