# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A topic being recorded, and what the nodes beside a recorder tell: what they sent, and with what."""

from __future__ import annotations

import sys
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
from rcl_interfaces.msg import ParameterEvent
from rcl_interfaces.srv import GetParameters
from rclpy.task import Future
from rosbags.interfaces import Qos as BagQos
from rosbags.interfaces import QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime

from weld_twin_core.arm.robot import Robot
from weld_twin_core.errors import DataError, TwinError
from weld_twin_msgs_py.bags.reader import has_header
from weld_twin_msgs_py.bags.segment import Channel
from weld_twin_msgs_py.messages.cdr import checked
from weld_twin_msgs_py.messages.from_messages import NANOSECONDS
from weld_twin_msgs_py.messages.topics import BY_NAME, LATCHED, RELIABLE, VOLATILE, Qos
from weld_twin_msgs_py.messages.typestore import TYPES, types_with
from weld_twin_msgs_py.robots import load_robot, parse_urdf

from ..offline.given_twin import build_twin
from .cell_node import CellNode
from .health import header_stamp
from .robot_settings import names_topic
from .settings import MODULES
from .source import LEAST, Wanted
from .words import Book, Heard, Sent, Word

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


NEW = 3.0
"""Seconds a node is listened to for the first time; each tells of itself once a second. One that
has not by then is not of this project."""
STEP = 0.5
"""Longest time [s] between two looks that counts as listened: a recorder that stood still, or was
not given a processor, has not listened meanwhile."""


AT_START = 'at the start'
"""Where messages are missing that were sent before the recorder was there."""


class SentBook(Book):
    """The words of nodes beside a recorder, and for how long it has listened to each of them."""

    def __init__(self) -> None:
        super().__init__()
        self._inputs: dict[str, dict[str, dict[str, tuple[Heard, int]]]] = {}
        self._looked: dict[str, float] = {}
        self._listened: dict[str, float] = {}

    def take(self, word: Word) -> None:
        """Take a word, and compare what the node has heard with what was due."""
        super().take(word)
        if word.heard:
            due = {topic: (own, self.due(topic, word.at)) for topic, own in word.heard.items()}
            self._inputs.setdefault(word.node, {})[word.run] = due

    def unheard(self, nodes: Collection[str]) -> list[str]:
        """
        Return a sentence for every input of nodes that has less than was sent.

        What they publish is as incomplete. Nodes that were started again are passed over.
        """
        out = []
        for node in sorted(nodes):
            runs = list(self._inputs.get(node, {}).values())
            for topic, (heard, due) in runs[0].items() if len(runs) == 1 else ():
                if heard.received < due:
                    out.append(
                        f"{node} has received {heard.received:,} of {due:,} messages on '{topic}': "
                        'what it publishes lacks the others'
                    )
        return out

    def silent_nodes(self) -> list[str]:
        """Return the nodes of the project that were met and have not said anything at all."""
        return [node for node in self._listened if _ours(node) and node not in self.nodes()]

    def meet(self, node: str, now: float) -> None:
        """Take note at every look [s] that a node publishes something that is recorded."""
        passed = now - self._looked.get(node, now)
        self._listened[node] = self._listened.get(node, 0.0) + min(passed, STEP)
        self._looked[node] = now

    def silent_since(self, then: float) -> list[str]:
        """Return the nodes met that tell, or may tell, of themselves and have not since [s]."""
        known, recent = self.nodes(), self.nodes(then)
        return [
            node
            for node, listened in self._listened.items()
            if node not in recent and (node in known or listened < NEW or _ours(node))
        ]


def _ours(node: str) -> bool:
    return node.rpartition('/')[2] in MODULES


class Shortfall(NamedTuple):
    """What a recording lacks of a topic."""

    sent: int
    recorded: int
    where: str  # 'at the start', 'at the end', 'at both ends', or 'in between'

    def sentence(self, topic: str) -> str:
        return (
            f"'{topic}' is incomplete: {self.recorded:,} of {self.sent:,} messages sent are in "
            f'the bag, {self.sent - self.recorded:,} are missing {self.where}'
        )

    def to_mapping(self) -> dict[str, Any]:
        missing = self.sent - self.recorded
        return {
            'sent': self.sent,
            'recorded': self.recorded,
            'missing': missing,
            'where': self.where,
        }


def shortfall(sent: Sent | None, recorded: Sent) -> Shortfall | None:
    """Return what is missing of a topic; None if nothing is, or nobody said."""
    if sent is None or recorded.number >= sent.number:
        return None
    late = early = recorded.number == 0
    if None not in (sent.first, recorded.first):
        late = recorded.first > sent.first  # type: ignore[operator]
        early = recorded.last < sent.last  # type: ignore[operator]
    where = {
        (True, True): 'at both ends',
        (True, False): AT_START,
        (False, True): 'at the end',
        (False, False): 'in between',
    }[late, early]
    if recorded.number == 0:
        where = 'from the first to the last'
    return Shortfall(sent.number, recorded.number, where)


ASKED = {'error_injector': 'effects', 'forward_kinematics_twin': 'twin_effects'}
"""Nodes whose parameters tell how the bag came about, and where their effects are noted."""
QUESTIONS = ['robot', 'base_link', 'tip_link', 'model', 'effects']
ASK_EVERY = 0.2
"""Seconds between two looks for nodes that have not answered yet."""


class AskedNodes:
    """Notes what the nodes of the recorder's own namespace say of themselves."""

    def __init__(self, node: CellNode, note: Callable[[str, Any], None]) -> None:
        self._node, self._note = node, note
        self._unasked = {
            name: node.create_client(GetParameters, f'{name}/get_parameters') for name in ASKED
        }
        self._changes: list[dict[str, Any]] = []
        self._description = ''
        self._waiting: list[tuple[str, list[Any]]] = []
        self._robot_known = False
        self._clients = [*self._unasked.values()]
        self._events = node.create_subscription(
            ParameterEvent, '/parameter_events', self._changed, 10
        )
        self._asking = node.every(ASK_EVERY, self._ask)

    def close(self) -> None:
        """Ask and listen no more."""
        self._unasked.clear()  # a look may be waiting in the executor already
        self._node.destroy_timer(self._asking)
        self._node.destroy_subscription(self._events)
        for client in self._clients:
            self._node.destroy_client(client)

    def describe(self, urdf: str) -> None:
        """Take the robot that robot_state_publisher tells; a node's own word counts more."""
        self._description = urdf
        waiting, self._waiting = self._waiting, []
        for name, values in waiting:
            self._take(name, values)
        if not self._robot_known:
            try:
                self._note('robot', parse_urdf(urdf, 'robot_description').to_mapping())
            except TwinError as error:
                self._node.get_logger().info(f'no robot is noted from robot_description: {error}')

    def _ask(self) -> None:
        for name, client in list(self._unasked.items()):
            if client.service_is_ready():
                del self._unasked[name]
                asked = QUESTIONS + (['seed'] if name == 'error_injector' else [])
                question = GetParameters.Request(names=asked)
                client.call_async(question).add_done_callback(partial(self._answered, name))
        if not self._unasked:
            self._node.destroy_timer(self._asking)

    def _answered(self, name: str, answer: Future) -> None:
        self._take(name, answer.result().values)

    def _take(self, name: str, values: list[Any]) -> None:
        robot_name, base, tip, model, text = [value.string_value for value in values[:5]]
        if names_topic(robot_name) and not self._description:
            self._waiting.append((name, values))
            return
        try:
            robot = self._robot(robot_name, base or None, tip or None)
            effects = build_twin(robot, model, text).effects
        except TwinError as error:
            self._node.refuse(name, str(error))
            return
        self._robot_known = True
        self._note('robot', robot.to_mapping())
        self._note(ASKED[name], [effect.to_mapping() for effect in effects])
        if name == 'error_injector':
            self._note('seed', values[5].integer_value)

    def _robot(self, name: str, base: str | None, tip: str | None) -> Robot:
        if names_topic(name):
            return parse_urdf(self._description, 'robot_description', base, tip)
        return load_robot(name, base, tip)

    def _changed(self, event: ParameterEvent) -> None:
        """Note effects that change while recording, with the time they did."""
        space, _, node = event.node.rpartition('/')
        if node not in ASKED or space != self._node.get_namespace().rstrip('/'):
            return
        for parameter in event.changed_parameters:
            if parameter.name == 'effects':
                now = self._node.get_clock().now().nanoseconds
                text = parameter.value.string_value
                self._changes.append({'node': node, 'log_ns': now, 'effects': text})
                self._note('effects_changes', self._changes)
