# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The parameters by which a node is told its robot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rclpy.executors import SingleThreadedExecutor

from weld_twin_core.arm.robot import Robot
from weld_twin_core.errors import ModelError
from weld_twin_msgs_py.messages.cdr_read import decoder
from weld_twin_msgs_py.messages.topics import ROBOT_DESCRIPTION
from weld_twin_msgs_py.robots import load_robot, parse_urdf

from .cell_frames import FRAME_SETTINGS, placed
from .cell_node import CellNode
from .settings import Setting

ROBOT_SETTINGS = (
    Setting(
        'robot',
        'ur5',
        "bundled robot, path of a robot file or URDF, or 'topic' "
        '(or /robot_description) to wait for the URDF that robot_state_publisher tells',
    ),
    Setting('base_link', '', 'first link of the chain in a URDF; empty: its root'),
    Setting('tip_link', '', 'last link of the chain in a URDF; empty: its only leaf'),
    *FRAME_SETTINGS,
)
LOOK = 0.1
"""Seconds of one turn of the loop that waits for a description."""


def robot_of(node: CellNode) -> Robot:
    """
    Return the robot a node's parameters name.

    Raises
    ------
    ModelError
        There is no such robot, or its file or description cannot be used.

    """
    name = node.setting('robot')
    base, tip = node.setting('base_link') or None, node.setting('tip_link') or None
    if told_by_topic(name):
        topic = node.resolve_topic_name(ROBOT_DESCRIPTION.relative if name == 'topic' else name)
        robot = parse_urdf(_described(node, topic), topic, base, tip)
    else:
        robot = load_robot(name, base, tip)
    node.take_robot_name(robot.name)
    return placed(node, robot)


def told_by_topic(name: str) -> bool:
    """Return whether a robot's name means a topic with its URDF: 'topic', or a topic's name."""
    absolute = name.startswith('/') and not Path(name).suffix and not Path(name).is_file()
    return name == 'topic' or absolute


def _described(node: CellNode, topic: str) -> str:
    """Return the next text on a topic; the node's health is told meanwhile."""
    texts: list[str] = []
    decode = decoder(ROBOT_DESCRIPTION.type)

    def take(data: Any) -> None:  # bytes, as the subscription is raw
        texts.append(decode(data).data)

    subscription = node.create_subscription(
        ROBOT_DESCRIPTION.message_class(),
        topic,
        take,
        ROBOT_DESCRIPTION.requested.to_rclpy(),
        raw=True,
    )
    node.get_logger().info(f'waiting for the robot on {topic}')
    node.health.lasting['robot'] = f'waiting for the robot on {topic}'
    runner = SingleThreadedExecutor(context=node.context)
    runner.add_node(node)
    try:
        while not texts:
            if not node.context.ok():
                raise ModelError(f'stopped before a robot was told on {topic}')
            runner.spin_once(timeout_sec=LOOK)
    finally:
        runner.remove_node(node)
        runner.shutdown()
    node.destroy_subscription(subscription)
    del node.health.lasting['robot']
    return texts[-1]
