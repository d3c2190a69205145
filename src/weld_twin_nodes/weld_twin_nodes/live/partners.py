# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Who is at the other end of a topic, and why nothing may come from there, or arrive there."""

from __future__ import annotations

from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

from weld_twin_msgs_py.messages.topics import Qos


def unheard_publishers(node: Node, topic: str, kind: str, wanted: Qos) -> list[str]:
    """
    Return a sentence for every publisher of a topic of which nothing arrives.

    Parameters
    ----------
    node : Node
    topic : str
        Its name after remapping, with the namespace.
    kind : str
        Message type that is asked for.
    wanted : Qos
        Quality of service that is asked for.

    """
    out = []
    for info in node.get_publishers_info_by_topic(topic):
        if info.topic_type != kind:
            reason = f'sends {info.topic_type}, this node needs {kind}'
        else:
            reason = _gap(info.qos_profile, wanted.to_rclpy())
        if reason:
            out.append(f'{topic}: {_name(info)} {reason}; nothing of it arrives')
    return out


def unreached_subscribers(node: Node, topic: str, kind: str, offered: Qos) -> list[str]:
    """Return a sentence for every subscriber that receives nothing; as `unheard_publishers`."""
    out = []
    for info in node.get_subscriptions_info_by_topic(topic):
        if info.topic_type != kind:
            reason = f'expects {info.topic_type}, this node sends {kind}'
        else:
            reason = _gap(offered.to_rclpy(), info.qos_profile)
        if reason:
            out.append(f'{topic}: {_name(info)} {reason}; it receives nothing')
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


def _name(info: Any) -> str:
    return f'{info.node_namespace.rstrip("/")}/{info.node_name}'
