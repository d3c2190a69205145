# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A subscription that takes the type its publishers have, out of those that are understood."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.serialization import deserialize_message

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.assembly.foreign_types import CONTROLLER, FedBack, plain_messages
from weld_twin_msgs_py.messages.cdr_read import READERS, decoder
from weld_twin_msgs_py.messages.topics import JOINT_STATES, Qos, Topic

from . import qos_events
from .message_classes import message_class
from .partners import Senders, elsewhere, unheard_publishers

Turn = Callable[[str, Any], Iterable[Any]]
"""A type and a message of it, to the messages that it stands for."""
AGAIN = 0.05
"""
Seconds until a subscription of another type is tried (again). Fast DDS knows one type of a topic
in a process, and forgets it when the executor has let go of the subscription before: a turn later.
"""
SELDOM = 5.0
"""Longest time from one try to the next [s], each twice the one before: each failure is a dozen lines
of the middleware on the terminal."""


class TypedInput:
    """
    One input of a node, by a subscription that is made anew when its publishers have another type.

    Parameters
    ----------
    kinds : sequence of str
        Message types that are understood, the usual one first.
    take : callable
        Takes the type and the bytes of a message.
    required : bool
        Whether the node can do nothing without it.
    remark, lack, unmatched : callable
        Take a sentence: on the type that is taken, on one that is not installed, and on a partner
        whose quality of service does not match.

    Attributes
    ----------
    kind : str
        The type that is taken now.
    name : str
        The resolved name of the topic.

    """

    def __init__(
        self,
        node: Node,
        topic: Topic,
        kinds: Sequence[str],
        wanted: Qos,
        take: Callable[[str, bytes], None],
        *,
        required: bool,
        remark: Callable[[str], None],
        lack: Callable[[str], None],
        unmatched: Callable[[str], None],
    ) -> None:
        self._node, self._topic, self._kinds = node, topic, tuple(kinds)
        self.name = node.resolve_topic_name(topic.relative)
        self._wanted, self._take = wanted, take
        self._required, self._senders = required, Senders()
        self._remark, self._lack, self._unmatched = remark, lack, unmatched
        self.kind = self._kinds[0]
        self._missing: set[str] = set()
        self._subscription: Any = None
        self._trying: Any = None
        self._delay, self._pause = '', AGAIN
        self._subscribe()

    def adapt(self) -> None:
        """Follow the publishers where none is left of the type that is taken."""
        if self._trying is None and self._wished() != self.kind:
            self.close()
            self._try_again()

    def _wished(self) -> str:
        """Return the type that the publishers have, the one that is taken if one of them has it."""
        there = {info.topic_type for info in self._node.get_publishers_info_by_topic(self.name)}
        for kind in (self.kind, *self._kinds):
            if kind in there and kind not in self._missing and self._readable(kind):
                return kind
        return self.kind

    def _readable(self, kind: str) -> bool:
        """Return whether a type is installed here; tell where it is not."""
        try:
            message_class(kind)
        except ImportError as error:
            self._missing.add(kind)
            self._lack(f'{self.name} carries what cannot be read: {error}')
            return False
        return True

    def unheard(self) -> list[str]:
        """Return a sentence for every publisher of which nothing arrives, or where one may be."""
        if self._subscription is None:
            return [self._delay] if self._delay else []
        if self._required and not self._node.count_publishers(self.name):
            lost = elsewhere(self._node, self.name, self._topic.name, self._kinds)
            return [lost] if lost else []
        return unheard_publishers(self._node, self.name, self.kind, self._wanted, self._kinds)

    def switched(self) -> str:
        """Return in a sentence that somebody else publishes it now, empty where that is not so."""
        return self._senders.changed(self._node, self.name)

    def matched(self) -> int:
        """Return how many publishers the subscription has met."""
        return 0 if self._subscription is None else int(self._subscription.get_publisher_count())

    def close(self) -> None:
        """Take nothing more."""
        if self._trying is not None:
            self._node.destroy_timer(self._trying)
        if self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
        self._trying = self._subscription = None

    def _try_again(self) -> None:
        """Subscribe in a later turn of the executor."""
        if self._trying is not None:
            self._node.destroy_timer(self._trying)
            self._pause = min(2.0 * self._pause, SELDOM)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._trying = self._node.create_timer(self._pause, self._subscribe, clock=steady)

    def _subscribe(self) -> None:
        """Take the type that the publishers have; try again later where it cannot be done yet."""
        kind = self._wished()
        try:
            self._subscription = self._node.create_subscription(
                message_class(kind),
                self._topic.relative,
                partial(self._take, kind),
                self._wanted.to_rclpy(),
                raw=True,
                event_callbacks=qos_events.of_subscription(
                    self.name, self._wanted, self._unmatched
                ),
            )
        except RuntimeError as error:  # rclpy's own error of it has no public name
            if self._trying is not None:  # the first try in a process may be too early
                said = ' '.join(str(error).partition(', at /')[0].split())
                self._delay = f'{self.name} cannot be taken as {kind} yet ({said}); tried again'
            self._try_again()
            return
        if self._trying is not None:
            self._node.destroy_timer(self._trying)
        self._trying, self._delay, self._pause = None, '', AGAIN
        if kind != self._kinds[0]:
            self._remark(f'{self.name} is taken as {kind}')
        self.kind = kind


def measured_turn(part: str, fed_back: FedBack | None) -> Turn:
    """
    Return what turns messages that stand for a measured pose into poses.

    Parameters
    ----------
    part : str
        The frame that was measured, where a message holds several.
    fed_back : FedBack, optional
        Turns what a controller feeds back; None where the robot is not known.

    """

    def turn(kind: str, message: Any) -> Iterable[Any]:
        if kind == CONTROLLER and fed_back is not None:
            return fed_back(message)
        return plain_messages(kind, message, part)

    return turn


def reader(kind: str) -> Callable[[bytes], Any]:
    """
    Return what turns serialised messages of a type into objects.

    Types of standard packages are read here. Others, whose definitions differ from release to
    release, are read by the package that is installed.
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
