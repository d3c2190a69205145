# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The parameters by which a node is told its robot."""

from __future__ import annotations

from weld_twin_core.robot import Robot
from weld_twin_msgs_py.robots import load_robot

from .cell_node import CellNode
from .settings import Setting

ROBOT_SETTINGS = (
    Setting('robot', 'ur5', 'bundled robot, or path of a robot file or URDF'),
    Setting('base_link', '', 'first link of the chain in a URDF; empty: its root'),
    Setting('tip_link', '', 'last link of the chain in a URDF; empty: its only leaf'),
)


def robot_of(node: CellNode) -> Robot:
    """
    Return the robot a node's parameters name.

    Raises
    ------
    ModelError
        There is no such robot, or its file cannot be used.

    """
    return load_robot(
        node.setting('robot'), node.setting('base_link') or None, node.setting('tip_link') or None
    )
