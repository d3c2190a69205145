# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A cell whose controller can be made to misbehave."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rosgraph_msgs.msg import Clock

from weld_twin_core.arm import catalog
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
    """
    The cell, its clock, and the joint states sent so far.

    Attributes
    ----------
    sent : dict
        Joint positions of all sound joint states by their stamp [ns].
    stamp : int [ns]
        Time of the cell; goes on with every joint state.

    """

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
        """Start a node of the cell."""
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
        """Send nothing, listen only."""
        end = time.monotonic() + seconds
        self.cell.wait(lambda: time.monotonic() >= end, 'a rest', seconds + 60.0)
