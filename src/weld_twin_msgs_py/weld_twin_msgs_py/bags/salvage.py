# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What salvaging a storage file gives: messages, and words on what could not be had."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rosbags.interfaces import Qos
from rosbags.rosbag2.metadata import parse_qos
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from ..messages.typestore import TYPES
from .segment import Channel

Found = tuple[Channel, int, bytes]
"""Channel, time of recording [ns] and serialised message."""


class Damage:
    """What was wrong with the files."""

    def __init__(self) -> None:
        self.sentences: list[str] = []

    def tell(self, path: Path, what: str) -> None:
        """Note something, once for each file."""
        sentence = f"'{path.name}' {what}"
        if sentence not in self.sentences:
            self.sentences.append(sentence)


def channel_of(topic: str, kind: str, definition: str, qos: Any) -> Channel:
    """Return the channel of a topic; of a definition nobody understands only the name is kept."""
    if kind in TYPES.types:
        return Channel(topic, kind, qos=_qos(qos))
    try:
        store = get_typestore(Stores.ROS2_JAZZY)
        store.register(get_types_from_msg(definition, kind))
        return Channel(topic, kind, definition, store.hash_rihs01(kind), _qos(qos))
    except Exception:  # a grammar and a type system, each with its own errors
        return Channel(topic, kind)


def _qos(text: Any) -> tuple[Qos, ...]:
    try:
        return tuple(parse_qos(text))
    except Exception:  # it is YAML from a broken file
        return ()
