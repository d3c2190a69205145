# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The Robotics Toolbox: its compiled elementary transforms, a batch of poses in one call."""

from __future__ import annotations

import numpy as np
from roboticstoolbox import DHRobot, RevoluteDH

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array

from . import Peer


def make(robot: Robot) -> Peer:
    """Return the peer."""
    rows = zip(robot.theta, robot.d, robot.a, robot.alpha, strict=True)
    arm = DHRobot([RevoluteDH(offset=t, d=d, a=a, alpha=alpha) for t, d, a, alpha in rows])
    arm.base, arm.tool = robot.T_world_base, robot.T_flange_tool
    chain = arm.ets()  # with base and tool in it

    def poses(q: Array) -> Array:
        return np.asarray(chain.eval(q)).reshape(-1, 4, 4)

    def screws(q: Array) -> tuple[Array, Array]:
        jacobians = np.stack([chain.jacob0(one) for one in q])
        return poses(q), jacobians

    def single(q: Array) -> Array:
        return np.asarray(chain.eval(q))

    return Peer(poses, screws, single=single, loops=False)
