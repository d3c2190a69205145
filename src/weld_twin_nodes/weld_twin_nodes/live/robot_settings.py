# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The parameters by which a node is told its robot."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from weld_twin_core.arm.robot import Robot
from weld_twin_core.errors import TwinError
from weld_twin_msgs_py.messages.cdr_read import decoder
from weld_twin_msgs_py.messages.topics import ROBOT_DESCRIPTION
from weld_twin_msgs_py.robots import load_robot, parse_urdf

from .cell_frames import FRAME_SETTINGS, placed
from .cell_node import CellNode
from .input_settings import joint_names
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


CHANGED = 'robot changed'
"""Under which a node keeps what it says of a robot that changes while it runs."""


def robot_of(node: CellNode) -> Robot:
    """
    Return the robot a node's parameters name.

    Raises ModelError: there is no such robot, or its file or description cannot be used.
    """
    name = node.setting('robot')
    base, tip = node.setting('base_link') or None, node.setting('tip_link') or None
    if told_by_topic(name):
        topic = node.resolve_topic_name(ROBOT_DESCRIPTION.relative if name == 'topic' else name)
        robot = _described(node, topic, lambda text: parse_urdf(text, topic, base, tip))
    else:
        robot = load_robot(name, base, tip)
    robot = placed(node, robot)
    given = node.has_parameter('joint_map')
    node.take_robot(robot, joint_names(node, robot) if given else None)
    return robot


def told_by_topic(name: str) -> bool:
    """Return whether a robot's name means a topic with its URDF: 'topic', or a topic's name."""
    absolute = name.startswith('/') and not Path(name).suffix and not Path(name).is_file()
    return name == 'topic' or absolute


def _described(node: CellNode, topic: str, read: Callable[[str], Robot]) -> Robot:
    """Return the robot that a topic tells; what it tells from then on is held against that."""
    first: list[Robot] = []
    decode = decoder(ROBOT_DESCRIPTION.type)

    def take(data: Any) -> None:  # bytes, as the subscription is raw
        if not first:
            first.append(read(decode(data).data))
            return
        try:
            same = read(decode(data).data).to_mapping() == first[0].to_mapping()
        except TwinError as error:
            node.refuse(topic, str(error))
            return
        sentence = (
            f'another robot is told on {topic} now; this node goes on with the one that it '
            'started with: start it anew'
        )
        node.keep(CHANGED, '' if same else sentence)

    node.create_subscription(
        ROBOT_DESCRIPTION.message_class(),
        topic,
        take,
        ROBOT_DESCRIPTION.requested.to_rclpy(),
        raw=True,
    )
    node.serve_until(lambda: bool(first), f'the robot on {topic}')
    return first[0]
