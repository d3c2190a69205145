# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The least a node can do: send on what it receives. The yardstick of the twin's latency.

Run as a module with the topics remapped; ``raw`` sends the serialised bytes on unread, ``bare`` answers
to joint states with one pose, made once, that takes over the stamp: what rclpy itself costs a twin.
"""

from __future__ import annotations

from typing import Any

import rclpy
from rclpy.node import Node
from rclpy.task import Future

from weld_twin_msgs_py.messages.topics import JOINT_STATES, TWIN_POSE
from weld_twin_nodes.live.run_node import LOOP, executor


class Relay(Node):
    """Copies joint states, or poses, to the topic of the twin, with the same quality of service."""

    def __init__(self) -> None:
        super().__init__('relay')
        poses = self.declare_parameter('poses', False).value
        bare = self.declare_parameter('bare', False).value
        kind = (TWIN_POSE if poses else JOINT_STATES).message_class()
        answer = TWIN_POSE.message_class() if bare else kind
        self._answer = answer()
        raw = self.declare_parameter('raw', False).value
        self._out = self.create_publisher(answer, TWIN_POSE.name, TWIN_POSE.offered.to_rclpy())
        self.create_subscription(
            kind,
            JOINT_STATES.name,
            self._answer_to if bare else self._send_on,
            JOINT_STATES.requested.to_rclpy(),
            raw=raw,
        )

    def _send_on(self, message: Any) -> None:
        self._out.publish(message)

    def _answer_to(self, message: Any) -> None:
        self._answer.header.stamp = message.header.stamp
        self._out.publish(self._answer)


def main() -> int:
    """Relay until stopped."""
    rclpy.init()
    runner = executor()
    try:
        runner.add_node(Relay())
        while rclpy.ok():
            runner.spin_until_future_complete(Future(), timeout_sec=LOOP)
    except KeyboardInterrupt:
        pass
    finally:
        rclpy.try_shutdown()
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
