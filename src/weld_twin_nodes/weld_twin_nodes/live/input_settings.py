# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The parameters by which a node is told what its inputs call things."""

from __future__ import annotations

from weld_twin_core.arm.robot import Robot
from weld_twin_core.errors import ModelError
from weld_twin_msgs_py.assembly.joint_states import names_called
from weld_twin_msgs_py.files.yaml_file import parse_yaml

from .cell_node import CellNode
from .settings import Setting

JOINT_SETTINGS = (
    Setting(
        'joint_prefix',
        '',
        "what the joint states put before the robot's joint names; empty: any one prefix is taken "
        'off and reported',
    ),
    Setting(
        'joint_map',
        '',
        "what the joint states call joints, as a YAML mapping from the robot's own names, such as "
        "'{joint_1: A1, joint_2: A2}'; names left out stay",
    ),
    Setting(
        'joints_beside',
        '',
        'joints on the same topic that do not carry the arm, such as those of a gripper, separated '
        'by commas: that they move is no cause for a warning',
    ),
    Setting(
        'joint_part',
        '',
        "part of a controller's state that is taken; empty: reference for commanded joints, "
        'feedback where it stands for a measurement',
    ),
)
MEASURED_SETTINGS = (
    Setting(
        'measured_frame',
        '',
        'frame that was measured, where measurements come as transforms',
    ),
)


def joint_names(node: CellNode, robot: Robot) -> tuple[str, ...] | None:
    """
    Return what the joint states call the joints of a robot; None where nothing is said.

    Raises ModelError: the map is no mapping of names, names a joint the robot has not, or gives a
    name twice.
    """
    prefix, text = node.setting('joint_prefix'), node.setting('joint_map')
    if not prefix and not text:
        return None
    given = parse_yaml(text, 'joint_map') if text else {}
    if not isinstance(given, dict) or not all(isinstance(v, str) for v in given.values()):
        raise ModelError(
            f'joint_map must be a mapping of names such as {{joint_1: A1}}, got {text!r}'
        )
    return names_called(robot, prefix, given)
