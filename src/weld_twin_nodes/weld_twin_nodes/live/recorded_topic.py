# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One topic being recorded: its type, its definition, its quality of service, what came of it."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
from rosbags.interfaces import Qos as BagQos
from rosbags.interfaces import QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime

from weld_twin_core.errors import DataError, TwinError
from weld_twin_msgs_py.bags.reader import has_header
from weld_twin_msgs_py.bags.segment import Channel
from weld_twin_msgs_py.messages.cdr_read import checked
from weld_twin_msgs_py.messages.from_messages import NANOSECONDS
from weld_twin_msgs_py.messages.topics import BY_NAME, LATCHED, RELIABLE, VOLATILE, Qos
from weld_twin_msgs_py.messages.typestore import TYPES, types_with

from .cell_node import CellNode
from .health import header_stamp
from .source import LEAST, Wanted
from .words import Sent

RULE = '=' * 80
"""The line between the parts of a definition, as rosbag2 writes it."""
_SIZES = (8, 16, 32, 64)
"""Bits of the whole numbers there are."""
BUILT_IN = (
    *('bool', 'byte', 'char', 'float32', 'float64', 'string', 'wstring'),
    *(f'int{size}' for size in _SIZES),
    *(f'uint{size}' for size in _SIZES),
)


def definition(kind: str) -> str:
    """Return the definition of a message type and of all it is made of, as bags hold it."""
    parts: dict[str, str] = {}
    _gather(kind, parts, _installed)
    first, *others = parts.items()
    return first[1] + ''.join(f'{RULE}\nMSG: {_short(name)}\n{text}' for name, text in others)


def _gather(kind: str, parts: dict[str, str], read: Callable[[str], str]) -> None:
    """Add a type and what its fields need."""
    if kind in parts:
        return
    text = parts[kind] = read(kind).rstrip() + '\n'
    package = kind.split('/')[0]
    for line in text.splitlines():
        words = line.split('#')[0].split()
        base = words[0].split('[')[0].split('<')[0] if len(words) > 1 else ''
        if not base or base in BUILT_IN:
            continue
        *owner, name = base.split('/')
        _gather(f'{owner[0] if owner else package}/msg/{name}', parts, read)


def _installed(kind: str) -> str:
    package, _, name = kind.split('/')
    for share in _shares(package):
        file = Path(share, 'msg', f'{name}.msg')
        if file.is_file():
            return file.read_text(encoding='utf-8')
    raise DataError(
        f'the definition of {kind} is not installed here; install the package {package}'
    )


def _shares(package: str) -> Iterator[str]:
    """Yield where a package may keep its files; wheels keep them without telling the index."""
    with suppress(PackageNotFoundError, LookupError, OSError):
        yield get_package_share_directory(package)
    yield f'{sys.prefix}/share/{package}'


def _short(kind: str) -> str:
    return kind.replace('/msg/', '/')


UNTOLD = 'RIHS01_' + 64 * '0'
"""Hash of a type that nobody could be asked for any more."""


def offered_channel(topic: str, kind: str, publishers: Sequence[Any]) -> Channel:
    """Return a topic as its publishers offer it."""
    digest = next((str(info.topic_type_hash) for info in publishers), '')
    text = ''
    if kind not in TYPES.types:
        try:
            text = definition(kind)
            digest = digest or types_with(kind, text).hash_rihs01(kind)
        except DataError:  # the messages are worth keeping without
            text = '# the definition of this type was not installed where it was recorded\n'
            digest = digest or UNTOLD
    qos = tuple(_profile(info.qos_profile) for info in publishers)
    return Channel(topic, kind, text, digest, qos)


def _profile(offered: Any) -> BagQos:
    """Return a profile of rclpy as bags hold it; the graph does not tell history and depth."""
    return BagQos(
        history=QosHistory[offered.history.name],
        depth=offered.depth,
        reliability=QosReliability[offered.reliability.name],
        durability=QosDurability[offered.durability.name],
        deadline=_time(offered.deadline),
        lifespan=_time(offered.lifespan),
        liveliness=QosLiveliness[offered.liveliness.name],
        liveliness_lease_duration=_time(offered.liveliness_lease_duration),
        avoid_ros_namespace_conventions=offered.avoid_ros_namespace_conventions,
    )


def _time(duration: Any) -> QosTime:
    return QosTime(*divmod(duration.nanoseconds, NANOSECONDS))


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

    write: takes the topic, the type and the bytes of a message.
    `announced`: type that the bag knows; the writer's to set.
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
