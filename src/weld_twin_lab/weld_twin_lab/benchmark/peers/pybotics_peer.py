# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""pybotics, in a Python loop; its rows are modified DH ones."""

from __future__ import annotations

import numpy as np
from pybotics.kinematic_chain import MDHKinematicChain
from pybotics.robot import Robot as PyboticsRobot

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array

from ..arms import turn_x
from . import Peer


def pybotics_arm(robot: Robot) -> PyboticsRobot:
    """Return the arm: the link after a joint is the link before the next, the last the tool's."""
    alpha, a = (np.concatenate([[0.0], values[:-1]]) for values in (robot.alpha, robot.a))
    arm = PyboticsRobot(
        MDHKinematicChain(np.stack([alpha, a, robot.theta, robot.d], axis=1)),
        world_frame=np.array(robot.T_world_base),
    )
    arm.tool.matrix = turn_x(robot.alpha[-1], robot.a[-1]) @ robot.T_flange_tool
    return arm


def make(robot: Robot) -> Peer:
    """Return the peer."""
    arm = pybotics_arm(robot)

    def poses(q: Array) -> Array:
        return np.stack([arm.fk(one) for one in q])

    return Peer(poses, single=arm.fk)
