# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Inverse kinematics along a seam."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.motion.inverse import solve_path

from .arms import smooth_motion
from .kinematics import OWN
from .race import Contender, Workload

CLOSED = 1e-9
"""What inverse kinematics leaves open [m]."""
NEWTON_STEPS = 20
"""Steps to a point at most; it begins at the solution of the point before."""


def inverse(count: int, with_pinocchio: bool) -> Workload:
    """Return the workload."""
    robot = load('ur5')
    q = smooth_motion(robot, count)
    poses = forward(robot, q)

    def own() -> Array:
        return solve_path(robot, poses, seed=q[0]).q

    def gap_of(solved: Array) -> float:
        return float(np.abs(forward(robot, solved)[:, :3, 3] - poses[:, :3, 3]).max())

    def all_postures() -> Array:
        return solve_path(robot, poses).q

    contenders = [
        Contender(OWN, own, count, gap_of(own())),
        Contender(f'{OWN}, all postures', all_postures, count, gap_of(all_postures())),
    ]
    if with_pinocchio:
        newton = _newton(robot, poses, q[0])
        contenders.append(Contender('pinocchio', newton, count, gap_of(newton())))
    return Workload(
        f'inverse kinematics along {count:,} points',
        'point',
        contenders,
        CLOSED,
        "from a posture to start with, unless all are looked at; Pinocchio is given Newton's "
        'method from point to point',
    )


def _newton(robot: Robot, poses: Array, start: Array) -> Callable[[], Array]:
    import pinocchio as pin

    from .peers.pinocchio_peer import chain_model

    model, tool = chain_model(robot)
    data = model.createData()
    goals = [pin.SE3(pose) for pose in poses]

    def follow() -> Array:
        out = np.empty((len(goals), model.nq))
        q = start.copy()
        for goal, target in zip(goals, out, strict=True):
            for _ in range(NEWTON_STEPS):
                pin.computeJointJacobians(model, data, q)
                error = pin.log6(pin.updateFramePlacement(model, data, tool).actInv(goal)).vector
                if error @ error < (0.1 * CLOSED) ** 2:
                    break
                jacobian = pin.getFrameJacobian(model, data, tool, pin.LOCAL)
                q = q + np.linalg.solve(jacobian, error)
            target[:] = q
        return out

    return follow
