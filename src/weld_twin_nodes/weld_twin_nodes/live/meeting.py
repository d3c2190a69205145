# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""When a node that speaks first may begin: the nodes beside it are there and reach each other."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from typing import Any

from .all_nodes import MODULES
from .cell_node import CellNode
from .neighbour_health import Statuses
from .outputs import NODE, Heard, read_heard, read_reached

QUIET = 1.0
"""
Seconds without a change on the graph after which nobody else is taken to be coming. Nodes that
are started together appear within some tenths of a second of each other.
"""
LOOK_EVERY = 0.05
"""Seconds between two looks at who is there."""
Count = Callable[[str], int]


class Neighbours:
    """
    What the nodes of the project tell of the subscriptions they reach and the publishers they hear.

    The graph a node sees is its own: that two others have not found each other yet, only they know,
    and one of the two may know it before the other.
    """

    def __init__(self) -> None:
        self._inputs: dict[str, set[str]] = {}
        self._reached: dict[str, dict[str, int]] = {}
        self._heard: dict[str, dict[str, Heard]] = {}

    def take(self, statuses: Statuses) -> None:
        """Take a node's health."""
        for values in statuses.values():
            node = values.get(NODE, '')
            if node:
                names = [name.partition(': ') for name in statuses]
                self._inputs[node] = {
                    topic for owner, _, topic in names if topic and owner == node
                }
                self._reached[node] = read_reached(values)
                self._heard[node] = read_heard(values)

    def apart(self, there: Collection[str]) -> list[str]:
        """Return whose word or whose listeners are still to come, among the nodes there are."""
        known = [node for node in there if node.rpartition('/')[2] in MODULES]
        out = [f'{node} to tell of itself' for node in known if node not in self._inputs]
        for node, reached in self._reached.items():
            for topic, count in reached.items() if node in there else ():
                wanted = [o for o, takes in self._inputs.items() if topic in takes and o in there]
                if count < len(wanted):
                    out.append(f'{node} to reach {" and ".join(wanted)} on {topic}')
        return out + self._deaf(there)

    def beyond(self, there: Collection[str], publishers: Count, subscribers: Count) -> list[str]:
        """
        Return whom the nodes that are there have met and the own graph does not show yet.

        Parameters
        ----------
        publishers, subscribers : callable
            From the name of a topic to how many the own graph has.

        """
        out = []
        for node in there:
            for topic, heard in self._heard.get(node, {}).items():
                if publishers(topic) < heard.publishers:
                    out.append(f'somebody to be seen who sends {topic} to {node}')
            for topic, count in self._reached.get(node, {}).items():
                if subscribers(topic) < count:
                    out.append(f'somebody to be seen who takes {topic} from {node}')
        return out

    def _deaf(self, there: Collection[str]) -> list[str]:
        """Return whom a node does not hear yet though it publishes what the node listens to."""
        out = []
        for node, inputs in self._heard.items():
            for topic, heard in inputs.items() if node in there else ():
                wanted = [o for o, gives in self._reached.items() if topic in gives and o in there]
                if heard.publishers < len(wanted):
                    out.append(f'{node} to hear {" and ".join(wanted)} on {topic}')
        return out


class Meeting:
    """
    Runs an action once, when the listeners of a node are there.

    With ``wait_for_subscribers`` it waits for that many. Without, for a graph that has at least
    one listener and no longer changes, on which the nodes of the project reach each other. Either
    wait has an end, at which it says what is missing.

    Parameters
    ----------
    within : float [s]
        Longest wait.

    """

    def __init__(self, node: CellNode, within: float, action: Callable[[], None]) -> None:
        self._node, self._within, self._action = node, within, action
        self._begun = self._changed = time.monotonic()
        self._seen: Any = None
        self._neighbours = Neighbours()
        node.neighbours.hear(self._neighbours.take)
        self._timer = node.every(LOOK_EVERY, self._look)
        self._told = False

    def _look(self) -> None:
        now = time.monotonic()
        missing = self._missing(now)
        late = now - self._begun > self._within
        if missing and not late:
            if not self._told:
                self._told = True
                self._node.get_logger().info(f'waiting for {missing}')
            self._node.health.lasting['waiting'] = f'waiting for {missing}'
            return
        if missing:
            sentence = f'waited {self._within:g} s for {missing}; beginning without'
            self._node.get_logger().warning(sentence)
            self._node.health.say(sentence)
        self._node.health.lasting.pop('waiting', None)
        self._timer.cancel()
        self._node.neighbours.hear_no_more(self._neighbours.take)
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
        apart = self._neighbours.apart(there)
        apart += self._neighbours.beyond(there, node.count_publishers, node.count_subscribers)
        if apart:
            return ', '.join(apart)
        if node.unmatched() or now - self._changed < QUIET:
            return 'the listeners to be complete'
        return ''
