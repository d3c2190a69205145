# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What the race of latencies runs beside the nodes: ``python -m ...partners NAME``, each until it is ended.

frames
    Frames of a cell as a robot_state_publisher tells them: one that is fixed, and an arm that moves.
    It ends with its standard input.
pulse
    Joint states or poses on the beat, stamped with the monotonic clock of the moment. It reads lines
    ``TOPIC RATE COUNT POSES``, answers each with ``done`` when sent, and ends with its standard input.
    Poses begin where an arm stands at `REST`, and go to and fro.
relay
    The least a node can do: it sends on what it receives; the yardstick of the twin's latency. Topics
    are remapped; ``raw`` sends the serialised bytes on unread, ``bare`` answers to joint states with
    one pose, made once, that takes over the stamp: what rclpy itself costs a twin.
"""

from __future__ import annotations

import sys
import threading
import time
from importlib import import_module
from itertools import pairwise
from math import cos, pi
from struct import pack_into
from typing import Any

import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import serialize_message
from rclpy.task import Future

from weld_twin_core.arm import catalog
from weld_twin_core.arm.chain import forward
from weld_twin_msgs_py.messages.cdr import HEADER, PoseEncoder
from weld_twin_msgs_py.messages.to_messages import ros_messages
from weld_twin_msgs_py.messages.topics import JOINT_STATES, TWIN_POSE
from weld_twin_nodes.live.run_node import LOOP, executor

from .party import REST

RATE = 100.0
"""Messages on `/tf` a second, as a robot_state_publisher sends at most."""
LINKS = 7
"""Frames of an arm in each."""
ROBOT = 'ur5'

DOUBLE = 8
"""Bytes of a number; a pose ends with seven."""
WAY, BEAT = 0.02, 2.0
"""Half the way that poses go [m], and how long they take there and back [s]: up to 63 mm/s."""


def frames() -> None:
    """Publish frames until nobody wants them any more."""
    node, make = Node('frames'), ros_messages()
    kind = import_module('tf2_msgs.msg').TFMessage
    stamped = import_module('geometry_msgs.msg').TransformStamped
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    fixed = node.create_publisher(kind, '/tf_static', latched)
    moving = node.create_publisher(kind, '/tf', QoSProfile(depth=100))

    def transform(parent: str, child: str) -> Any:
        out = stamped(child_frame_id=child)
        out.header.frame_id, out.header.stamp = parent, make.time(time.time_ns())
        out.transform.rotation.w = 1.0
        return out

    fixed.publish(kind(transforms=[transform('world', 'base_link')]))
    over = threading.Event()

    def wait() -> None:
        sys.stdin.read()
        over.set()

    threading.Thread(target=wait, daemon=True).start()
    names = ['base_link', *(f'link_{k}' for k in range(LINKS))]
    while not over.wait(1.0 / RATE):
        moving.publish(kind(transforms=[transform(*pair) for pair in pairwise(names)]))


def pulse() -> None:
    node = Node('pulse')
    robot, make = catalog.load(ROBOT), ros_messages()
    state = make.joint_state(1, robot.joint_names, REST, np.zeros(robot.n), 'base_link')
    T = forward(robot, REST)
    messages = {
        '0': (JOINT_STATES, bytearray(serialize_message(state))),
        '1': (TWIN_POSE, bytearray(PoseEncoder('base')(1, T[:3, 3], T[:3, :3]))),
    }
    publishers: dict[str, Any] = {}
    for line in sys.stdin:
        topic, rate, count, poses = line.split()
        row, data = messages[poses]
        if topic not in publishers:
            qos = row.offered.to_rclpy()
            publishers[topic] = node.create_publisher(row.message_class(), topic, qos)
            while publishers[topic].get_subscription_count() == 0:
                time.sleep(0.01)
            time.sleep(1.0)  # discovery is one-sided: the other side may need a little longer
        x = T[0, 3] if poses == '1' else None
        _send(publishers[topic], data, 1.0 / float(rate), int(count), x)
        print('done', flush=True)


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


def relay() -> None:
    """Copy joint states, or poses, to the topic of the twin, with the same quality of service."""
    node = Node('relay')
    poses, bare, raw = (node.declare_parameter(n, False).value for n in ('poses', 'bare', 'raw'))
    kind = (TWIN_POSE if poses else JOINT_STATES).message_class()
    answer = TWIN_POSE.message_class() if bare else kind
    out = node.create_publisher(answer, TWIN_POSE.name, TWIN_POSE.offered.to_rclpy())
    said = answer()

    def stamp(message: Any) -> None:
        said.header.stamp = message.header.stamp
        out.publish(said)

    hear = stamp if bare else out.publish
    node.create_subscription(
        kind, JOINT_STATES.name, hear, JOINT_STATES.requested.to_rclpy(), raw=raw
    )
    runner = executor()
    runner.add_node(node)
    while rclpy.ok():
        runner.spin_until_future_complete(Future(), timeout_sec=LOOP)


if __name__ == '__main__':
    rclpy.init()
    try:
        {'frames': frames, 'pulse': pulse, 'relay': relay}[sys.argv[1]]()
    except KeyboardInterrupt:
        pass
    finally:
        rclpy.try_shutdown()
