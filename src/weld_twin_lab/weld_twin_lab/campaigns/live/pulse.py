# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Sends joint states on the beat, stamped with the monotonic clock of the moment.

Run as a module it reads lines ``TOPIC RATE COUNT``, answers each with ``done`` when sent, and
ends with its standard input.
"""

from __future__ import annotations

import sys
import time
from struct import pack_into
from typing import Any

import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.serialization import serialize_message

from weld_twin_core.arm import catalog
from weld_twin_msgs_py.messages.cdr_read import HEADER
from weld_twin_msgs_py.messages.to_messages import ros_messages
from weld_twin_msgs_py.messages.topics import JOINT_STATES

ROBOT = 'ur5'


def main() -> int:
    """Send what is asked for."""
    rclpy.init()
    node = Node('pulse')
    robot = catalog.load(ROBOT)
    q = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
    data = bytearray(
        serialize_message(
            ros_messages().joint_state(1, robot.joint_names, q, np.zeros(robot.n), 'base_link')
        )
    )
    publishers: dict[str, Any] = {}
    for line in sys.stdin:
        topic, rate, count = line.split()
        if topic not in publishers:
            publishers[topic] = node.create_publisher(
                JOINT_STATES.message_class(), topic, JOINT_STATES.offered.to_rclpy()
            )
            while publishers[topic].get_subscription_count() == 0:
                time.sleep(0.01)
            time.sleep(1.0)  # discovery is one-sided: the other side may need a little longer
        _send(publishers[topic], data, 1.0 / float(rate), int(count))
        print('done', flush=True)
    rclpy.try_shutdown()
    return 0


def _send(publisher: Any, data: bytearray, period: float, count: int) -> None:
    begin = time.monotonic()
    for k in range(count):
        time.sleep(max(begin + k * period - time.monotonic(), 0.0))
        now = time.monotonic_ns()
        pack_into('<iI', data, HEADER, *divmod(now, 1_000_000_000))
        publisher.publish(bytes(data))


if __name__ == '__main__':
    raise SystemExit(main())
