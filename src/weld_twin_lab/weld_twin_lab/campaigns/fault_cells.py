# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A cell whose controller can be made to misbehave."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock
from scipy.spatial.transform import Rotation

from weld_twin_core.arm import catalog
from weld_twin_core.arm.chain import forward
from weld_twin_core.arrays import Array
from weld_twin_msgs_py.messages.topics import (
    DEVIATION,
    JOINT_STATES,
    MEASURED_POSE,
    TWIN_POSE,
    Topic,
)
from weld_twin_nodes.harness import Cell, NodeProcess
from weld_twin_nodes.harness.cell import HealthListener

RATE = 100.0
"""Joint states a second."""
S = 1_000_000_000
"""Nanoseconds."""
HISTORY = 1000
"""Messages a controller keeps; an empty one is in the way of reliable readers until it has left."""
LISTENERS = 4
"""Twin, injector, live diagnosis and recorder take joint states."""
SURE = {'use_sim_time': True, 'reliable_inputs': True}
NODES: dict[str, dict[str, Any]] = {
    'recorder': {},
    'live_diagnosis': {'least': 600.0},
    'deviation_markers': {},
    'deviation_analyzer': {'metrics_every': 50},
    'forward_kinematics_twin': {},
    'error_injector': {},
}
"""The nodes of the cell; without effects, so that every deviation must be zero."""


class Bench:
    """The cell, its clock, and the joint states sent so far."""

    def __init__(self, cell: Cell, bag: Path) -> None:
        self.cell = cell
        self.robot = catalog.load('ur5')
        self.make = cell.messages
        self.sent: dict[int, list[Array]] = defaultdict(list)
        self.stamp = 1000 * S
        self.phase = 0.0
        self.ticking = True
        self.health = HealthListener(cell.node)
        self.processes: dict[str, NodeProcess] = {}
        for name in NODES:
            self.start(name, **({'out': str(bag)} if name == 'recorder' else {}))
        self.taps = {t.name: cell.collect(t.name) for t in (TWIN_POSE, MEASURED_POSE, DEVIATION)}
        self._clock = cell.node.create_publisher(Clock, '/clock', 10)
        self._joints = self.publisher(JOINT_STATES)

    def start(self, name: str, **parameters: Any) -> None:
        self.processes[name] = self.cell.start(name, **SURE, **NODES[name], **parameters)

    def publisher(self, topic: Topic) -> Any:
        """Return one more publisher of a topic, with the short history of a controller."""
        qos = replace(topic.offered, depth=HISTORY)
        return self.cell.node.create_publisher(topic.message_class(), topic.name, qos.to_rclpy())

    def ready(self) -> None:
        """Wait until all nodes listen and know who listens to them."""
        count = self.cell.node.count_subscribers
        self.cell.wait(lambda: count(JOINT_STATES.name) >= LISTENERS, 'listeners', 120.0)
        self.cell.meet()

    # The controller --------------------------------------------------------------------------

    def tick(self, step: int) -> None:
        """Let the time of the cell go on [ns]."""
        self.stamp += step
        if self.ticking:
            self._clock.publish(Clock(clock=self.make.time(self.stamp)))

    def joint_state(self) -> Any:
        """Return the next sound joint state; the arm goes on, not so its record."""
        self.phase += 0.3 / RATE
        q = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3]) + 0.2 * np.sin(self.phase + np.arange(6))
        return self.make.joint_state(self.stamp, self.robot.joint_names, q, np.zeros(6))

    def send(self, message: Any, *, sound: bool = True) -> None:
        """Publish a joint state or bytes; ``sound`` ones may show up in the output."""
        if sound:
            ns = message.header.stamp.sec * S + message.header.stamp.nanosec
            self.sent[ns].append(np.array(message.position))
        self._joints.publish(message)

    def run(
        self, seconds: float, each: Callable[[int], None] | None = None, rate: float = RATE
    ) -> None:
        """Send joint states on the beat; ``each`` does it instead, told the number."""
        begin, count = time.monotonic(), round(seconds * rate)
        sent = 0

        def due() -> bool:
            nonlocal sent
            while sent < count and time.monotonic() - begin >= sent / rate:
                self.tick(round(S / rate))
                if each is None:
                    self.send(self.joint_state())
                else:
                    each(sent)
                sent += 1
            return sent == count

        self.cell.wait(due, 'the joint states to be sent', limit=seconds + 60.0)

    def rest(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        self.cell.wait(lambda: time.monotonic() >= end, 'a rest', seconds + 60.0)


JOINT_RATE, POSE_RATE = 100.0, 60.0
"""Messages a second of the controller and of the tracker."""
REST = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
"""Where the arm is on the average [rad]."""
NOISE = 2e-5
"""Standard deviation of the tracker [m]: that of a good one."""
MEETING = 60.0
"""Seconds the nodes have to meet."""


class Stand:
    """Joint states and measured poses on a beat of the machine's clock; a fault changes one of them."""

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
        self.other.destroy_node()
        self._context.try_shutdown()

    def publisher(self, topic: Topic, name: str = '') -> Any:
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
        """Return after how long [s] a node's health tells something, and the whole sentence."""
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
        end = time.monotonic() + seconds

        def over() -> bool:
            self.step()
            return time.monotonic() > end

        self.cell.wait(over, 'some time to pass', limit=seconds + MEETING)
