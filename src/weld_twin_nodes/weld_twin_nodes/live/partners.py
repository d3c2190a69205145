# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Who is at the other end of a topic, and why nothing may come from there, or arrive there."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from weld_twin_msgs_py.messages.topics import BY_NAME, Qos

UNKNOWN = '_NODE_NAME_UNKNOWN_'
"""What rmw calls a node whose participant has told of its topics and not of its nodes yet."""


def unheard_publishers(
    infos: Sequence[Any], topic: str, kind: str, wanted: Qos, understood: Collection[str] = ()
) -> list[str]:
    """
    Return a sentence for every publisher of a topic of which nothing arrives.

    infos: the publishers.
    topic: its name after remapping, with the namespace.
    kind: message type that is asked for.
    wanted: quality of service that is asked for.
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

    topic: the input's name after remapping, with the namespace.
    own: its name in the table of topics, which another namespace would go before.
    kinds: types that are understood.
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
    """Who publishes an input: told when it is somebody else, as when a controller is switched."""

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
    """Return the full name of a node as it is told; the graph may lack it at first."""
    return 'a publisher whose name is not known yet' if UNKNOWN in node else node
