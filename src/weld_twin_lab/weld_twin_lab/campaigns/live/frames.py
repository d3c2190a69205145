# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Frames of a cell as a robot_state_publisher tells them: one that is fixed, and an arm that moves.

Run as a module it publishes until its standard input ends.
"""

from __future__ import annotations

import sys
import threading
import time
from importlib import import_module
from itertools import pairwise
from typing import Any

import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from weld_twin_msgs_py.messages.to_messages import ros_messages

RATE = 100.0
"""Messages on `/tf` a second, as a robot_state_publisher sends at most."""
LINKS = 7
"""Frames of an arm in each."""


def main() -> int:
    """Publish until nobody wants it any more."""
    rclpy.init()
    node = Node('frames')
    kind = import_module('tf2_msgs.msg').TFMessage
    stamped = import_module('geometry_msgs.msg').TransformStamped
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    fixed = node.create_publisher(kind, '/tf_static', latched)
    moving = node.create_publisher(kind, '/tf', QoSProfile(depth=100))
    make = ros_messages()

    def transform(parent: str, child: str) -> Any:
        out = stamped(child_frame_id=child)
        out.header.frame_id, out.header.stamp = parent, make.time(time.time_ns())
        out.transform.rotation.w = 1.0
        return out

    fixed.publish(kind(transforms=[transform('world', 'base_link')]))
    over = threading.Event()
    threading.Thread(target=_wait_for, args=(over,), daemon=True).start()
    names = ['base_link', *(f'link_{k}' for k in range(LINKS))]
    while not over.wait(1.0 / RATE):
        moving.publish(kind(transforms=[transform(*pair) for pair in pairwise(names)]))
    rclpy.try_shutdown()
    return 0


def _wait_for(over: threading.Event) -> None:
    sys.stdin.read()
    over.set()


if __name__ == '__main__':
    raise SystemExit(main())
