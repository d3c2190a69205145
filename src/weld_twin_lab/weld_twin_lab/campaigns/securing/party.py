# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Somebody on the network: a driver that sends joint states, or a listener for the twin's poses.

Run as a module with ``say SECONDS MARK`` or ``hear SECONDS 0``; ``--ros-args`` as for any node. The
stamps of what it says end in its mark [ns]. It prints how many messages it sent or heard.
"""

from __future__ import annotations

import sys
import time

import numpy as np
import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.utilities import remove_ros_args

from weld_twin_core.arm import catalog
from weld_twin_msgs_py.messages.to_messages import ros_messages
from weld_twin_msgs_py.messages.topics import JOINT_STATES, TWIN_POSE

PERIOD = 0.02
"""Seconds between two joint states."""
MEETING = 5.0
"""Seconds it waits for somebody to listen, and until they have everything; then it goes on alone."""
MARKS = 1000
"""Nanoseconds that a stamp's mark is counted in."""
REST = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
"""Where the arm is [rad]."""


def main() -> int:
    """Say or hear for a time."""
    way, seconds, mark = remove_ros_args(sys.argv)[1:]
    rclpy.init()
    node = Node('party')
    count, end = [0], time.monotonic() + float(seconds)

    def hear(_: object) -> None:
        count[0] += 1

    if way == 'hear':
        kind, quality = TWIN_POSE.message_class(), TWIN_POSE.requested.to_rclpy()
        node.create_subscription(kind, TWIN_POSE.name, hear, quality, raw=True)
        while time.monotonic() < end:
            rclpy.spin_once(node, timeout_sec=PERIOD)
    else:
        publisher = node.create_publisher(
            JOINT_STATES.message_class(), JOINT_STATES.name, JOINT_STATES.offered.to_rclpy()
        )
        make, names = ros_messages(), catalog.load('ur5').joint_names
        begun = time.monotonic()
        while not publisher.get_subscription_count() and time.monotonic() - begun < MEETING:
            time.sleep(PERIOD)
        end = time.monotonic() + float(seconds)
        while time.monotonic() < end:
            stamp = time.time_ns() // MARKS * MARKS + int(mark)
            publisher.publish(make.joint_state(stamp, names, REST))
            count[0] += 1
            time.sleep(PERIOD)
        publisher.wait_for_all_acked(Duration(seconds=MEETING))
    print(count[0], flush=True)
    node.destroy_node()
    rclpy.try_shutdown()
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
