# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A lean of the link that an arm stands in, as displaced channels."""

from __future__ import annotations

import numpy as np

from ..arm.channels import Channel
from ..arm.robot import Robot
from ..arrays import Array


def base_leans(robot: Robot, axes: Array) -> list[dict[Channel, float]]:
    """
    Return the channels that turn an arm's base about axes through its origin.

    Beside a positioner a lean of the arm is that of the positioner the other way round: the frames
    between the two are all that the chain has.

    axes: in the base frame of the arm's rows, shape (K, 3).
    """
    if not robot.behind:
        turned = axes @ robot.T_world_base[:3, :3].T
        return [{('base', 3 + k): float(axis[k]) for k in range(3)} for axis in turned]
    foot = np.linalg.inv(robot.T_root_base)[:3, 3]
    return [
        {('root', k): float(value) for k, value in enumerate([*-np.cross(axis, foot), *-axis])}
        for axis in axes
    ]
