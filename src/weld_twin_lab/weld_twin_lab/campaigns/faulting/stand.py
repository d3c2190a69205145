# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A small cell in real time: an arm that moves, a tracker, and whatever is wrong between the two."""

from __future__ import annotations

import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from scipy.spatial.transform import Rotation

from weld_twin_core.arm import catalog
from weld_twin_core.arm.chain import forward
from weld_twin_core.arrays import Array
from weld_twin_msgs_py.messages.topics import JOINT_STATES, MEASURED_POSE, Topic
from weld_twin_nodes.harness import Cell
from weld_twin_nodes.harness.cell import HealthListener

JOINT_RATE, POSE_RATE = 100.0, 60.0
"""Messages a second of the controller and of the tracker."""
S = 1_000_000_000
"""Nanoseconds."""
REST = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
"""Where the arm is on the average [rad]."""
NOISE = 2e-5
"""Standard deviation of the tracker [m]: that of a good one."""
MEETING = 60.0
"""Seconds the nodes have to meet."""


class Stand:
    """
    Joint states and measured poses on a beat of the machine's clock; a fault changes one of them.

    Attributes
    ----------
    folder : Path
        For files.
    offset : callable
        How far the tracker's clock is ahead [s], of the time since the beginning [s].
    frame : str
        What the tracker calls its frame.
    T_seen : array, shape (4, 4)
        The measuring frame as the tracker sees it.
    other : Node
        A node of somebody else, in a participant of its own.

    """

    def __init__(self, cell: Cell, folder: Path) -> None:
        self.cell, self.folder = cell, folder
        self.robot = catalog.load('ur5')
        self.health = HealthListener(cell.node)
        self.offset: Callable[[float], float] = lambda _: 0.0
        self.frame = 'world'
        self.T_seen: Array = np.eye(4)
        self.beats: list[Callable[[int], None]] = []
        self._rng = np.random.default_rng(5)
        self._begun, self._epoch = time.monotonic(), time.time_ns()
        self._sent = [0, 0]
        self._context = rclpy.Context()
        rclpy.init(context=self._context, domain_id=cell.domain)
        self.other = Node('other', context=self._context)
        self.joints: Any = self.publisher(JOINT_STATES)
        self.poses = self.publisher(MEASURED_POSE)

    def close(self) -> None:
        """End the participant of the others."""
        self.other.destroy_node()
        self._context.try_shutdown()

    def publisher(self, topic: Topic, name: str = '') -> Any:
        """Return a publisher of somebody else."""
        return self.other.create_publisher(
            topic.message_class(), name or topic.name, topic.offered.to_rclpy()
        )

    def transforms(self, *, static: bool) -> Callable[[str, str, Array], None]:
        """Return what publishes where a frame is in another, at the time of the stand."""
        kind = import_module('tf2_msgs.msg').TFMessage
        stamped = import_module('geometry_msgs.msg').TransformStamped
        durability = DurabilityPolicy.TRANSIENT_LOCAL if static else DurabilityPolicy.VOLATILE
        qos = QoSProfile(depth=100, durability=durability)
        publisher = self.other.create_publisher(kind, '/tf_static' if static else '/tf', qos)

        def publish(parent: str, child: str, T: Array) -> None:
            each = stamped(child_frame_id=child)
            each.header.stamp = self.cell.messages.time(self.now)
            each.header.frame_id = parent
            p, q = each.transform.translation, each.transform.rotation
            p.x, p.y, p.z = T[:3, 3].tolist()
            q.x, q.y, q.z, q.w = Rotation.from_matrix(T[:3, :3]).as_quat().tolist()
            publisher.publish(kind(transforms=[each]))

        return publish

    @property
    def now(self) -> int:
        """Return the time of the controller [ns]."""
        return self._epoch + round((time.monotonic() - self._begun) * S)

    def q(self, t: float) -> Array:
        """Return the joints at a time [s]; the tool goes some cm/s, never twice the same way."""
        return REST + 0.15 * np.sin(np.array([0.8, 1.1, 0.5, 0.7, 0.9, 1.3]) * t + np.arange(6))

    def step(self) -> None:
        """Send what is due."""
        t = time.monotonic() - self._begun
        while self._sent[0] / JOINT_RATE < t:
            at = self._sent[0] / JOINT_RATE
            stamp = self._epoch + round(at * S)
            names = self.robot.joint_names
            self.joints.publish(self.cell.messages.joint_state(stamp, names, self.q(at)))
            for beat in self.beats:
                beat(self._sent[0])
            self._sent[0] += 1
        while self._sent[1] / POSE_RATE < t:
            self._measure(self._sent[1] / POSE_RATE)
            self._sent[1] += 1

    def _measure(self, at: float) -> None:
        T = self.T_seen @ forward(self.robot, self.q(at))
        stamp = self._epoch + round((at + self.offset(at)) * S)
        seen = T[:3, 3] + self._rng.normal(scale=NOISE, size=3)
        self.poses.publish(self.cell.messages.pose(stamp, seen, T[:3, :3], self.frame))

    # Waiting ---------------------------------------------------------------------------------

    def reported(self, node: str, words: str, within: float) -> tuple[float | None, str]:
        """
        Return after how long [s] a node's health tells something, and the whole sentence.

        node: its full name.
        within: [s]
        """
        self.health.clear()
        begun, sentence = time.monotonic(), ['']

        def there() -> bool:
            self.step()
            for name, entries in self.health.told.items():
                if name == node or name.startswith(f'{node}: '):
                    sentence[0] = next(
                        (text for level, text in entries if words in text and level != 'ok'), ''
                    )
                    if sentence[0]:
                        return True
            return time.monotonic() - begun > within

        self.cell.wait(there, f'{words!r} to be told', limit=within + MEETING)
        return (time.monotonic() - begun if sentence[0] else None), sentence[0]

    def well(self, node: str, within: float = 30.0) -> bool:
        """Return whether a node says within a time [s] that it is well, and nothing else."""
        begun, seen = time.monotonic(), [False]

        def there() -> bool:
            self.step()
            seen[0] = seen[0] or any(
                entry == ('ok', 'running') for entry in self.health.told.get(node, ())
            )
            return seen[0] or time.monotonic() - begun > within

        self.health.clear()
        self.cell.wait(there, f'{node} to be well', limit=within + MEETING)
        return seen[0]

    def run(self, seconds: float) -> None:
        """Let the cell work."""
        end = time.monotonic() + seconds

        def over() -> bool:
            self.step()
            return time.monotonic() > end

        self.cell.wait(over, 'some time to pass', limit=seconds + MEETING)
