# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Serialised messages of any type that is understood, as the messages that a node takes."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from rclpy.serialization import deserialize_message

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.assembly.foreign_types import CONTROLLER, FedBack, plain_messages
from weld_twin_msgs_py.messages.cdr_read import READERS, decoder
from weld_twin_msgs_py.messages.topics import JOINT_STATES, message_class

Turn = Callable[[str, Any], Iterable[Any]]
"""A type and a message of it, to the messages that it stands for."""


def measured_turn(part: str, fed_back: FedBack | None) -> Turn:
    """
    Return what turns messages that stand for a measured pose into poses.

    part: the frame that was measured, where a message holds several.
    fed_back: turns what a controller feeds back; None where the robot is not known.
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
