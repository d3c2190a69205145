# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Somebody on the network: sends joint states as a driver does, and listens for the twin's poses.

Run as a module with ``SECONDS MARK``; ``--ros-args`` as for any node. The stamps of what it says end in
its mark [ns]. It prints how many poses it heard.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.utilities import remove_ros_args

from weld_twin_core.arm import catalog
from weld_twin_msgs_py.messages.to_messages import ros_messages
from weld_twin_msgs_py.messages.topics import JOINT_STATES, TWIN_POSE, Topic

NAME = 'party'
"""What it is called."""
PERIOD = 0.02
"""Seconds between two joint states."""
MEETING = 5.0
"""Seconds it waits for somebody to listen, and until they have everything; then it goes on alone."""
MARKS = 1000
"""Nanoseconds that a stamp's mark is counted in."""
REST = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
"""About where the arm is [rad]."""
SWING = 0.3
"""How far each joint swings [rad]; slowly, once in as many seconds as a circle has radians."""


def main() -> int:
    seconds, mark = remove_ros_args(sys.argv)[1:]
    rclpy.init()
    # Nothing but what it is there for: its policy is short, and only that is refused.
    node = Node(
        NAME,
        start_parameter_services=False,
        parameter_overrides=[Parameter('start_type_description_service', value=False)],
    )
    poses: list[object] = []
    publisher = _granted(node.create_publisher, JOINT_STATES, JOINT_STATES.offered.to_rclpy())
    asked = TWIN_POSE.requested.to_rclpy()
    _granted(node.create_subscription, TWIN_POSE, poses.append, asked, raw=True)
    _meet(node, publisher)
    make, names = ros_messages(), catalog.load('ur5').joint_names
    begun, turn = time.monotonic(), 0
    while time.monotonic() < begun + float(seconds):
        stamp = time.time_ns() // MARKS * MARKS + int(mark)
        posture = REST + SWING * np.sin(turn * PERIOD)
        if publisher is not None:
            publisher.publish(make.joint_state(stamp, names, posture))
        turn += 1
        while (wait := begun + turn * PERIOD - time.monotonic()) > 0:
            rclpy.spin_once(node, timeout_sec=wait)
    if publisher is not None:
        publisher.wait_for_all_acked(Duration(seconds=MEETING))
    print(len(poses), flush=True)
    node.destroy_node()
    rclpy.try_shutdown()
    return 0


def _granted(make: Callable[..., Any], topic: Topic, *given: Any, **options: Any) -> Any:
    """Return a publisher or subscription; None where the middleware refuses it."""
    try:
        return make(topic.message_class(), topic.name, *given, **options)
    except RuntimeError as error:  # rclpy's own error of it has no public name
        print(error, file=sys.stderr)
        return None


def _meet(node: Node, publisher: Any) -> None:
    """Wait until somebody listens, or long enough."""
    begun = time.monotonic()
    while time.monotonic() - begun < MEETING:
        if publisher is not None and publisher.get_subscription_count():
            return
        rclpy.spin_once(node, timeout_sec=PERIOD)


if __name__ == '__main__':
    raise SystemExit(main())
