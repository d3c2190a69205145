# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Sends joint states or poses on the beat, stamped with the monotonic clock of the moment.

Run as a module it reads lines ``TOPIC RATE COUNT POSES``, answers each with ``done`` when sent, and
ends with its standard input. Poses begin where an arm stands at `HOME`, and go to and fro.
"""

from __future__ import annotations

import sys
import time
from math import cos, pi
from struct import pack_into
from typing import Any

import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.serialization import serialize_message

from weld_twin_core.arm import catalog
from weld_twin_core.arm.chain import forward
from weld_twin_msgs_py.messages.cdr_read import HEADER
from weld_twin_msgs_py.messages.cdr_write import PoseEncoder
from weld_twin_msgs_py.messages.to_messages import ros_messages
from weld_twin_msgs_py.messages.topics import JOINT_STATES, TWIN_POSE

ROBOT = 'ur5'
HOME = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
"""Joints of the arm [rad]."""
DOUBLE = 8
"""Bytes of a number; a pose ends with seven."""
WAY, BEAT = 0.02, 2.0
"""Half the way that poses go [m], and how long they take there and back [s]: up to 63 mm/s."""


def main() -> int:
    """Send what is asked for."""
    rclpy.init()
    node = Node('pulse')
    robot, make = catalog.load(ROBOT), ros_messages()
    state = make.joint_state(1, robot.joint_names, HOME, np.zeros(robot.n), 'base_link')
    T = forward(robot, HOME)
    messages = {
        '0': (JOINT_STATES, bytearray(serialize_message(state))),
        '1': (TWIN_POSE, bytearray(PoseEncoder('base')(1, T[:3, 3], T[:3, :3]))),
    }
    publishers: dict[str, Any] = {}
    for line in sys.stdin:
        topic, rate, count, poses = line.split()
        row, data = messages[poses]
        if topic not in publishers:
            publishers[topic] = node.create_publisher(
                row.message_class(), topic, row.offered.to_rclpy()
            )
            while publishers[topic].get_subscription_count() == 0:
                time.sleep(0.01)
            time.sleep(1.0)  # discovery is one-sided: the other side may need a little longer
        _send(
            publishers[topic],
            data,
            1.0 / float(rate),
            int(count),
            T[0, 3] if poses == '1' else None,
        )
        print('done', flush=True)
    rclpy.try_shutdown()
    return 0


def _send(publisher: Any, data: bytearray, period: float, count: int, x: float | None) -> None:
    begin = time.monotonic()
    place = len(data) - 7 * DOUBLE
    for k in range(count):
        if x is not None:
            turn = 2.0 * pi * k * period / BEAT
            pack_into('<d', data, place, x + WAY * (1.0 - cos(turn)))
        time.sleep(max(begin + k * period - time.monotonic(), 0.0))
        now = time.monotonic_ns()
        pack_into('<iI', data, HEADER, *divmod(now, 1_000_000_000))
        publisher.publish(bytes(data))


if __name__ == '__main__':
    raise SystemExit(main())
