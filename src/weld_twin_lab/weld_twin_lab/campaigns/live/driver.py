# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A controller and a tracker of one robot, by somebody else: joint states and poses on their beats.

Run as a module with ``NAMESPACE ROBOT JOINT_RATE POSE_RATE SECONDS LISTENERS`` it waits until both
topics have so many listeners, sends, waits until all have everything, and prints how many
messages it sent.
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any

import numpy as np
import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.serialization import serialize_message

from weld_twin_core.arm import catalog
from weld_twin_core.arm.chain import forward
from weld_twin_msgs_py.messages.cdr_write import PoseEncoder
from weld_twin_msgs_py.messages.to_messages import ros_messages
from weld_twin_msgs_py.messages.topics import JOINT_STATES, MEASURED_POSE

REST = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
"""Where the arm is on the average [rad]."""
MEETING = 60.0
"""Seconds the listeners have to come."""
LAST_WORDS = 10.0
"""Seconds that all may take to have everything."""
S = 1_000_000_000
"""Nanoseconds."""


def main() -> int:
    """Send what is asked for."""
    space, name, *numbers = sys.argv[1:]
    joint_rate, pose_rate, seconds, listeners = map(float, numbers)
    rclpy.init()
    node = Node('driver', namespace=space)
    robot, make = catalog.load(name), ros_messages()
    publishers = [
        node.create_publisher(row.message_class(), row.relative, row.offered.to_rclpy())
        for row in (JOINT_STATES, MEASURED_POSE)
    ]
    end = time.monotonic() + MEETING
    while any(each.get_subscription_count() < listeners for each in publishers):
        if time.monotonic() > end:
            print(json.dumps({'waited': [p.get_subscription_count() for p in publishers]}))
            return 1
        time.sleep(0.02)
    time.sleep(1.0)  # discovery is one-sided: the other side may need a little longer
    encode, epoch = PoseEncoder('world'), time.time_ns()

    def joints(t: float) -> bytes:
        q, qd = _motion(t)
        stamp = epoch + round(t * S)
        return bytes(serialize_message(make.joint_state(stamp, robot.joint_names, q, qd)))

    def pose(t: float) -> bytes:
        T = forward(robot, _motion(t)[0])
        return encode(epoch + round(t * S), T[:3, 3], T[:3, :3])

    sent = _send(publishers, (joints, pose), (joint_rate, pose_rate), seconds)
    acked = [p.wait_for_all_acked(Duration(seconds=LAST_WORDS)) for p in publishers]
    print(json.dumps({'joint_states': sent[0], 'poses': sent[1], 'acknowledged': all(acked)}))
    rclpy.try_shutdown()
    return 0


def _motion(t: float) -> tuple[np.ndarray, np.ndarray]:
    """Return joints and their velocities at a time [s]."""
    phase, pace = np.arange(6), np.array([0.8, 1.1, 0.5, 0.7, 0.9, 1.3])
    return REST + 0.15 * np.sin(pace * t + phase), 0.15 * pace * np.cos(pace * t + phase)


def _send(publishers: Any, make: Any, rates: Any, seconds: float) -> list[int]:
    """Send both streams, each message when it is due; return how many of each."""
    counts = [round(rate * seconds) for rate in rates]
    due = sorted(
        (k / rate, which) for which, rate in enumerate(rates) for k in range(counts[which])
    )
    begin = time.monotonic()
    for at, which in due:
        time.sleep(max(begin + at - time.monotonic(), 0.0))
        publishers[which].publish(make[which](at))
    return counts


if __name__ == '__main__':
    raise SystemExit(main())
