# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The parameters by which a node is told its frames."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import matrix_from_quaternion, rotation_matrix, transform
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError, ModelError
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.assembly.frame_names import BASE, WORLD

from .base_on_tf import base_on_tf
from .cell_node import CellNode
from .settings import NO_NUMBERS, Setting

FRAME_SETTINGS = (
    Setting(
        'measuring_frame',
        '',
        'frame that measurements must be given in, and that poses are given in; empty: the first '
        'that comes, and world',
    ),
    Setting('base_frame', '', "name of the robot's base in what is published; empty: base"),
    Setting(
        'base_from_tf',
        False,
        'take from /tf where the base is: base_frame in measuring_frame, when the node starts',
    ),
    Setting(
        'T_measuring_base',
        NO_NUMBERS,
        'where the base is in the measuring frame [m, rad]: x y z and a rotation vector, or x y z '
        'and a quaternion x y z w; not set: as the robot or its model has it',
        numbers=True,
    ),
)


def measuring_frame(node: CellNode) -> str:
    """Return the name of the frame in which poses are told."""
    return node.setting('measuring_frame') or WORLD


def base_frame(node: CellNode) -> str:
    """Return the name of the robot's base in what is published."""
    return node.setting('base_frame') or BASE


def placed(node: CellNode, robot: Robot) -> Robot:
    """
    Return the robot with its base where the node's parameters put it.

    Raises ModelError: ``T_measuring_base`` is no pose, or the node is stopped before `/tf` tells
    one.
    """
    values = node.setting('T_measuring_base')
    if values != NO_NUMBERS:
        return robot.with_origin(frame_from(values))
    if not node.setting('base_from_tf'):
        return robot
    if node.arm is not None:  # it was asked for when the node took its robot
        return robot.with_frames(base=node.arm.T_world_base)
    return robot.with_origin(base_on_tf(node))


def placed_twin(node: CellNode, twin: Twin) -> Twin:
    """Return the twin of a model likewise; the parameter counts more than a fitted base."""
    robot = placed(node, twin.robot)
    moved = abs(robot.T_world_base - twin.robot.T_world_base).max()
    if moved > 0.0:
        node.remark('the base that was given is used; the base of the model differs from it')
    return twin if moved == 0.0 else Twin(robot, twin.effects)


def frame_from(values: Sequence[float] | str) -> Array:
    """
    Return the 4 x 4 matrix of x y z and a rotation vector or a quaternion.

    Raises ModelError: there are neither six nor seven finite numbers, or the quaternion is not of
    length 1.
    """
    try:
        numbers = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.size not in (6, 7) or not np.isfinite(numbers).all():
        raise ModelError(
            'T_measuring_base takes 6 numbers, x y z and a rotation vector, or 7, x y z and a '
            f'quaternion x y z w, got {values if isinstance(values, str) else list(values)}'
        )
    if numbers.size == 6:
        return transform(rotation_matrix(numbers[3:]), numbers[:3])
    try:
        return transform(matrix_from_quaternion(numbers[3:], 'T_measuring_base'), numbers[:3])
    except DataError as error:
        raise ModelError(str(error)) from None
