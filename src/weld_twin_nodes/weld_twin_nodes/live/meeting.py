# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""When a node that speaks first may begin: its listeners are there and know it."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from .cell_node import CellNode

QUIET = 1.0
"""
Seconds without a change on the graph after which nobody else is taken to be coming. Nodes that
are started together appear within some tenths of a second of each other.
"""
LOOK_EVERY = 0.02


class Meeting:
    """
    Runs an action once, when the listeners of a node are there.

    With ``wait_for_subscribers`` it waits for that many, without for a graph that has at least
    one listener and no longer changes. Either wait has an end, at which it says what is missing.

    Parameters
    ----------
    node : CellNode
    within : float [s]
        Longest wait.
    action : callable

    """

    def __init__(self, node: CellNode, within: float, action: Callable[[], None]) -> None:
        self._node, self._within, self._action = node, within, action
        self._begun = self._changed = time.monotonic()
        self._seen: Any = None
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
        if node.unmatched() or now - self._changed < QUIET:
            return 'the listeners to be complete'
        return ''
