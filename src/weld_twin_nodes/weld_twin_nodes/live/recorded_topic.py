# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One topic being recorded: its type, its quality of service, what came of it."""

from __future__ import annotations

from collections.abc import Callable

from weld_twin_core.errors import TwinError
from weld_twin_msgs_py.bags.reader import has_header
from weld_twin_msgs_py.messages.cdr_read import checked
from weld_twin_msgs_py.messages.topics import BY_NAME, LATCHED, RELIABLE, VOLATILE, Qos

from .cell_node import CellNode
from .outputs import header_stamp
from .partners import full_names
from .source import LEAST, Wanted
from .words import Sent

DEEP = 10_000
"""
Messages that may wait for a recorder that stands still: ten seconds at 1 kHz, where a thousand
were seen to run over after two at 500 Hz. The middleware takes memory only for those that wait.
"""


class RecordedTopic:
    """
    Takes every message as bytes, with the quality of service offered.

    It asks for reliable delivery until a publisher is seen that does not offer it: what comes
    before the first look at the publishers is then not lost either.

    given: name without a slash where it is in the namespace of the node.
    write: takes the topic, the type and the bytes of a message.

    Attributes
    ----------
    announced : str
        Type that the bag was told of; the writer's to set.

    """

    def __init__(
        self, node: CellNode, given: str, write: Callable[[RecordedTopic, str, bytes], None]
    ) -> None:
        row = BY_NAME.get('/' + given.lstrip('/'))
        self.name = name = node.resolve_topic_name(given)
        self._node, self._write = node, write
        self._state = node.watch(name, required=False, steady=row is not None and row.steady)
        self.announced = ''
        self._check: dict[str, Callable[[bytes], bytes]] = {}
        self._stamped = False
        self._first: bytes | None = None
        self._last: bytes | None = None
        latched = row is not None and row.requested.durability == LATCHED
        qos = Qos(RELIABLE, DEEP, LATCHED if latched else VOLATILE)
        yields = tuple(LEAST)
        if node.overrides.has(name, 'subscription'):
            qos, yields = node.overrides.of(name, 'subscription', qos), ()
        elif node.setting('reliable_inputs'):
            yields = ('durability',)
        kinds = () if row is None else (row.type,)
        self.source = node.follow(
            Wanted(given, kinds, qos, any_kind=True, yields=yields), self._take
        )

    @property
    def taken(self) -> Sent:
        """Return what came and was handed on."""
        count = self._state.received - self._state.refused
        if not self._stamped or self._first is None or self._last is None:
            return Sent(count)
        return Sent(count, header_stamp(self._first), header_stamp(self._last))

    def publishing_nodes(self) -> set[str]:
        """Return the full names of the nodes that publish it."""
        return full_names(self.source.publishers())

    def _take(self, kind: str, data: bytes) -> None:
        self._state.arrived()
        if kind not in self._check:
            self._check[kind] = checked(kind)
            self._stamped = has_header(kind)
        try:
            whole = self._check[kind](data)
        except TwinError as error:
            self._node.refuse(self.name, str(error))
            return
        if self._first is None:
            self._first = whole
        self._last = whole
        if self._stamped:
            self._state.stamped(header_stamp(whole))
        self._write(self, kind, whole)
