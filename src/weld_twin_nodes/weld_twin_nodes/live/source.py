# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A subscription that follows its publishers: in the type they have, and in what they offer."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from weld_twin_msgs_py.messages.topics import BEST_EFFORT, BY_NAME, VOLATILE, Qos, message_class

from .telling_node import TellingNode

UNKNOWN = '_NODE_NAME_UNKNOWN_'
"""What rmw calls a node whose participant has announced its topics and not its nodes yet."""


def unheard_publishers(
    infos: Sequence[Any], topic: str, kind: str, wanted: Qos, understood: Collection[str] = ()
) -> list[str]:
    """
    Return a sentence for every publisher of a topic of which nothing arrives.

    understood: types that could be taken instead, if nobody published the one that is.
    """
    out = []
    for info in _named(infos):
        if info.topic_type != kind and info.topic_type in understood:
            reason = f'sends {info.topic_type} where another sends {kind}, which is taken'
        elif info.topic_type != kind:
            reason = f'sends {info.topic_type}, this node needs {" or ".join(understood) or kind}'
        else:
            reason = _gap(info.qos_profile, wanted.to_rclpy())
        if reason:
            out.append(f'{topic}: {full_name(info)} {reason}; nothing of it arrives')
    return out


def elsewhere(node: Node, topic: str, own: str, kinds: Sequence[str]) -> str:
    """
    Return where the input may be that nobody publishes, in a sentence; empty where nowhere.

    topic: the input's name after remapping; ``own``: that in the table of topics.
    """
    longer = tuple(name for name in BY_NAME if name != own and name.endswith(own))
    for name, there in node.get_topic_names_and_types():
        if name.endswith(longer):
            continue  # it has another meaning, such as where the joints really are
        if name != topic and name.endswith(own) and set(there) & set(kinds):
            publishers = node.get_publishers_info_by_topic(name)
            if publishers:
                space = name.removesuffix(own) or '/'
                return (
                    f'{topic} has no publisher, but {full_name(publishers[0])} publishes {name}: '
                    f'start this node in the namespace {space}, or remap the topic'
                )
    return ''


class Senders:
    """Who publishes an input: reports when it is somebody else, as when a controller is switched."""

    def __init__(self) -> None:
        self._before: frozenset[str] = frozenset()

    def changed(self, topic: str, infos: Sequence[Any]) -> str:
        """Return in a sentence that others publish it than before, empty where they do not."""
        now = frozenset(map(full_name, _named(infos)))
        if not now or len(now) < len({info.node_name for info in infos}):
            return ''  # the graph does not have their names yet
        before = self._before
        self._before = before & now or now  # who joins is none of them until all have gone
        if not before or before & now:
            return ''
        return (
            f'{topic} comes from {" and ".join(sorted(now))} now, '
            f'it came from {" and ".join(sorted(before))}'
        )


def unreached_subscribers(node: Node, topic: str, kind: str, offered: Qos) -> list[str]:
    """Return a sentence for every subscriber that receives nothing; as `unheard_publishers`."""
    out = []
    for info in _named(node.get_subscriptions_info_by_topic(topic)):
        if info.topic_type != kind:
            reason = f'expects {info.topic_type}, this node sends {kind}'
        else:
            reason = _gap(offered.to_rclpy(), info.qos_profile)
        if reason:
            out.append(f'{topic}: {full_name(info)} {reason}; it receives nothing')
    return out


def _gap(offered: QoSProfile, asked: QoSProfile) -> str:
    """Return why two qualities of service do not match, empty where they do or are not known."""
    said = []
    if (
        offered.reliability == ReliabilityPolicy.BEST_EFFORT
        and asked.reliability == ReliabilityPolicy.RELIABLE
    ):
        said.append('reliability: best_effort is offered, reliable asked for')
    if (
        offered.durability == DurabilityPolicy.VOLATILE
        and asked.durability == DurabilityPolicy.TRANSIENT_LOCAL
    ):
        said.append('durability: volatile is offered, transient_local asked for')
    return f'does not match in quality of service ({"; ".join(said)})' if said else ''


def _named(infos: Sequence[Any]) -> list[Any]:
    """Return those whose names the graph has; the others' follow in a moment."""
    return [info for info in infos if UNKNOWN not in info.node_name]


def full_names(infos: Sequence[Any]) -> set[str]:
    """Return the names of the nodes of endpoints, with their namespaces."""
    return set(map(full_name, infos))


def full_name(info: Any) -> str:
    """Return the name of an endpoint's node with its namespace."""
    return f'{info.node_namespace.rstrip("/")}/{info.node_name}'


def named(node: str) -> str:
    """Return the full name of a node as it is reported; the graph may lack it at first."""
    return 'a publisher whose name is not known yet' if UNKNOWN in node else node


AGAIN = 0.05
"""
Seconds until a subscription of another type is tried (again). Fast DDS knows one type of a topic
in a process, and forgets it when the executor has let go of the subscription before: a turn later.
"""
SELDOM = 5.0
"""Longest time from one try to the next [s], each twice the one before: each failure is a dozen lines
of the middleware on the terminal."""
LEAST = {'reliability': BEST_EFFORT, 'durability': VOLATILE}
"""What every publisher offers."""
MOST = 10_000
"""Messages taken at once of what waits: as many as the deepest queue holds."""


@dataclass(frozen=True)
class Wanted:
    """What is asked for of a topic."""

    given: str  # its name, before remapping and without the namespace
    kinds: tuple[str, ...]  # message types that are understood, the usual one first
    qos: Qos
    any_kind: bool = False  # whether any other type is taken too
    own: str = ''
    """Its name in the table of topics, which another namespace would go before."""
    required: bool = False  # whether the node can do nothing without it
    yields: tuple[str, ...] = ()
    """Policies of which less is asked for where a publisher offers less."""


class Source:
    """
    One input of a node, by a subscription that is made anew when its publishers are others.

    take: takes the type and the bytes of a message. `kind`: the type that is taken now, or empty.
    """

    def __init__(
        self,
        node: TellingNode,
        wanted: Wanted,
        take: Callable[[str, bytes], None],
    ) -> None:
        self._node, self._wanted, self._take = node, wanted, take
        self.name = node.resolve_topic_name(wanted.given)
        self.kind: str = (*wanted.kinds, '')[0]
        self._qos = wanted.qos
        self.infos: list[Any] = []
        self._senders = Senders()
        self._missing: set[str] = set()
        self._subscription: Any = None
        self._trying: Any = None
        self._delay, self._pause = '', AGAIN
        self._subscribe()

    def publishers(self) -> list[Any]:
        """Return the publishers that there are now of the type that is taken."""
        self.infos = self._node.get_publishers_info_by_topic(self.name)
        return self._own()

    def _own(self) -> list[Any]:
        return [info for info in self.infos if info.topic_type == self.kind]

    def adapt(self) -> None:
        """Follow the publishers where none is left of what is taken."""
        kind = self._wished()
        if self._trying is not None or not kind:
            return
        if kind != self.kind or self._subscription is None:
            self.close()
            self._try_in_a_moment()
        elif self._suited() != self._qos:
            self.close()
            self._subscribe()
            asked = f'{self._qos.reliability}, {self._qos.durability}'
            self._node.remark(f'{self.name}: a publisher offers {asked}; it is taken so')

    def _wished(self) -> str:
        """Return the type that the publishers have, the one that is taken if one of them has it."""
        self.infos = self._node.get_publishers_info_by_topic(self.name)
        there: set[str] = {info.topic_type for info in self.infos}
        others = tuple(sorted(there)) if self._wanted.any_kind else ()
        for kind in (self.kind, *self._wanted.kinds, *others):
            if kind in there and self._readable(kind):
                return kind
        return self.kind if self._readable(self.kind) else ''

    def _readable(self, kind: str) -> bool:
        """Return whether a type is installed here; tell where it is not."""
        if not kind or kind in self._missing:
            return False
        try:
            message_class(kind)
        except ImportError as error:
            self._missing.add(kind)
            self._node.keep(kind, f'{self.name} carries what cannot be read: {error}')
            return False
        return True

    def _suited(self) -> Qos:
        """Return a quality of service that every publisher can serve, where less may do."""
        offers = [info.qos_profile for info in self._own()]
        less: dict[str, Any] = {
            policy: LEAST[policy]
            for policy in self._wanted.yields
            if any(getattr(offer, policy).name.lower() == LEAST[policy] for offer in offers)
        }
        return replace(self._qos, **less)

    def unheard(self) -> list[str]:
        """Return a sentence for every publisher of which nothing arrives, or where one may be."""
        wanted = self._wanted
        if self._subscription is None:
            return [self._delay] if self._delay else []
        if wanted.required and not self.infos:
            lost = elsewhere(self._node, self.name, wanted.own, wanted.kinds)
            return [lost] if lost else []
        others = {info.topic_type for info in self.infos} if wanted.any_kind else ()
        understood = *wanted.kinds, *others
        return unheard_publishers(self.infos, self.name, self.kind, self._qos, understood)

    def switched(self) -> str:
        """Return in a sentence that somebody else publishes it now, empty where that is not so."""
        return self._senders.changed(self.name, self.infos)

    def matched(self) -> int:
        """Return how many publishers the subscription has met."""
        return 0 if self._subscription is None else int(self._subscription.get_publisher_count())

    def take_waiting(self) -> None:
        """Take what has reached this process and waits for its turn."""
        if self._subscription is None:
            return
        handle = self._subscription.handle
        with handle:
            for _ in range(MOST):
                taken = handle.take_message(self._subscription.msg_type, True)
                if taken is None:
                    break
                self._take(self.kind, taken[0])

    def close(self) -> None:
        """Take what waits, and nothing more."""
        self._stop_trying()
        if self._subscription is not None:
            self.take_waiting()
            self._node.destroy_subscription(self._subscription)
        self._subscription = None

    def _stop_trying(self) -> None:
        if self._trying is not None:
            self._node.destroy_timer(self._trying)
        self._trying = None

    def _try_in_a_moment(self) -> None:
        """Subscribe in a later turn of the executor."""
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._trying = self._node.create_timer(self._pause, self._subscribe, clock=steady)

    def _subscribe(self) -> None:
        """Take the type that the publishers have; try again later where it cannot be done yet."""
        again, kind, before = self._trying is not None, self._wished(), self.kind
        self._stop_trying()
        if not kind:
            return
        self.kind = kind
        self._qos = self._suited()
        try:
            self._subscription = self._node.create_subscription(
                message_class(kind),
                self._wanted.given,
                partial(self._take, kind),
                self._qos.to_rclpy(),
                raw=True,
                event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
            )
        except RuntimeError as error:  # rclpy's own error of it has no public name
            self.kind = before
            if again:  # the first try in a process may be too early
                said = ' '.join(str(error).partition(', at /')[0].split())
                self._delay = f'{self.name} cannot be taken as {kind} yet ({said}); tried again'
                self._pause = min(2.0 * self._pause, SELDOM)
            self._try_in_a_moment()
            return
        self._delay, self._pause = '', AGAIN
        if kind not in self._wanted.kinds[:1]:
            self._node.remark(f'{self.name} is taken as {kind}')
