# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the middleware tells of a publisher or subscription that cannot do its work."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.qos import QoSPolicyKind

from weld_twin_msgs_py.messages.topics import Qos

Tell = Callable[[str], None]


def of_subscription(topic: str, wanted: Qos, mismatch: Tell) -> SubscriptionEventCallbacks:
    """
    Return callbacks that tell in a sentence why nothing arrives.

    Lost messages are not asked for: taking that event while messages stream in has locked the
    middleware up for good, reader and writer both.
    """
    asks = f'{wanted.reliability}, {wanted.durability}'
    return SubscriptionEventCallbacks(
        incompatible_qos=lambda event: mismatch(
            f'{topic}: a publisher offers another {_policy(event)} than is asked for ({asks}); '
            'nothing of it arrives'
        ),
        incompatible_type=lambda event: mismatch(
            f'{topic}: a publisher sends another message type; nothing of it arrives'
        ),
    )


def of_publisher(topic: str, offered: Qos, mismatch: Tell) -> PublisherEventCallbacks:
    """Return callbacks that tell in a sentence why a subscriber receives nothing."""
    offers = f'{offered.reliability}, {offered.durability}'
    return PublisherEventCallbacks(
        incompatible_qos=lambda event: mismatch(
            f'{topic}: a subscriber asks for another {_policy(event)} than is offered ({offers}); '
            'it receives nothing'
        ),
        incompatible_type=lambda event: mismatch(
            f'{topic}: a subscriber expects another message type; it receives nothing'
        ),
    )


def _policy(event: Any) -> str:
    return QoSPolicyKind(event.last_policy_kind).name.lower()
