# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a bag notes of a topic beside its messages: definition, hash, quality of service."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.bags.segment import Channel
from weld_twin_msgs_py.messages.typestore import TYPES

from .message_definition import definition

NANOSECONDS = 1_000_000_000
UNTOLD = 'RIHS01_' + 64 * '0'
"""Hash of a type that nobody could be asked for any more."""


def offered_channel(topic: str, kind: str, publishers: Sequence[Any]) -> Channel:
    """Return a topic as its publishers offer it."""
    digest = next((str(info.topic_type_hash) for info in publishers), '')
    text = ''
    if kind not in TYPES.types:
        try:
            text = definition(kind)
            digest = digest or type_hash(kind, text)
        except DataError:  # the messages are worth keeping without
            text = '# the definition of this type was not installed where it was recorded\n'
            digest = digest or UNTOLD
    qos = tuple(_profile(info.qos_profile) for info in publishers)
    return Channel(topic, kind, text, digest, qos)


def type_hash(kind: str, text: str) -> str:
    """Return the hash of a type by its definition."""
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(text, kind))
    return store.hash_rihs01(kind)


def _profile(offered: Any) -> Qos:
    """Return a profile of rclpy as bags hold it; the graph does not tell history and depth."""
    return Qos(
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
