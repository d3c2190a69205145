# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Calibration from measured poses, and inverse kinematics along a seam."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from scipy.optimize import least_squares, leastsq

from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.channels import Channel
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import left_jacobian, rotation_matrix
from weld_twin_core.arrays import Array
from weld_twin_core.motion.inverse import solve_path

from .arms import SIZE, arm_of, random_positions, smooth_motion
from .calibration import calibrate, linearised, minimal_channels, moved
from .kinematics import OWN
from .race import Contender, Workload

CLOSED = 1e-9
"""What inverse kinematics leaves open [m]."""
NEWTON_STEPS = 20
"""Steps to a point at most; it begins at the solution of the point before."""
PYBOTICS_STEPS = 4
"""Steps after which it is stopped; its time for one is what is compared."""


def fits(poses: int, seam: int, peers: set[str]) -> Iterator[Workload]:
    """Yield the workloads."""
    yield _calibration(poses, peers)
    yield _inverse(seam, peers)


def _calibration(count: int, peers: set[str]) -> Workload:
    robot = arm_of(6)
    channels = minimal_channels(robot)
    error = SIZE * np.random.default_rng(6).normal(size=len(channels))
    q = random_positions(robot, count, seed=6)
    poses = forward(moved(robot, channels, error), q)

    def own() -> Robot:
        return calibrate(robot, q, poses).robot

    def scipy_way() -> Robot:
        return _by_trf(robot, q, poses)

    def gap(found: Robot) -> float:
        return float(np.abs(forward(found, q) - poses).max())

    contenders = [
        Contender(OWN, own, 1, gap(own())),
        Contender('scipy trf', scipy_way, 1, gap(scipy_way())),
    ]
    if 'pybotics' in peers:
        contenders.append(Contender('pybotics', _by_pybotics(robot, q, poses), 1, once=True))
    return Workload(
        f'calibration of {len(channels)} numbers on {count:,} poses',
        'fit',
        contenders,
        1e-9,
        'scipy trf has the same analytic Jacobian; pybotics fits positions by differences, and is '
        f'stopped after {PYBOTICS_STEPS} steps',
        ('scipy trf',),
    )


def _by_trf(robot: Robot, q: Array, poses: Array) -> Robot:
    channels = minimal_channels(robot)

    def residual(values: Array) -> Array:
        return linearised(moved(robot, channels, values), q, poses, ())[1]

    def jacobian(values: Array) -> Array:
        columns = linearised(moved(robot, channels, values), q, poses, channels)[0]
        return np.asarray(-(_from_start(channels, values) @ columns).T)

    found = least_squares(
        residual,
        np.zeros(len(channels)),
        jacobian,
        method='trf',
        x_scale='jac',
        xtol=1e-12,
        ftol=1e-15,
        gtol=1e-15,
    )
    return moved(robot, channels, found.x)


def _from_start(channels: Sequence[Channel], values: Array) -> Array:
    """Return how a change of values counted from the start displaces the frames, (P, P)."""
    out = np.eye(len(channels))
    at = {name: [channels.index((name, k)) for k in range(6)] for name in ('base', 'tool')}
    base, tool = (np.ix_(at[name][3:], at[name][3:]) for name in ('base', 'tool'))
    turn = values[at['tool'][3:]]
    out[base] = left_jacobian(values[at['base'][3:]]).T
    out[tool] = left_jacobian(-turn).T
    out[np.ix_(at['tool'][:3], at['tool'][:3])] = rotation_matrix(turn)
    return out


def _by_pybotics(robot: Robot, q: Array, poses: Array) -> Callable[[], object]:
    from pybotics.optimization import OptimizationHandler, optimize_accuracy

    from .peers.pybotics_peer import pybotics_arm

    def fit() -> object:
        handler = OptimizationHandler(
            pybotics_arm(robot), kinematic_chain_mask=True, world_mask=True
        )
        start = handler.generate_optimization_vector()
        positions = poses[:, :3, 3]
        calls = PYBOTICS_STEPS * (start.size + 1)
        return leastsq(
            optimize_accuracy, start, (handler, q, positions), full_output=True, maxfev=calls
        )

    return fit


def _inverse(count: int, peers: set[str]) -> Workload:
    robot = load('ur5')
    q = smooth_motion(robot, count)
    poses = forward(robot, q)

    def own() -> Array:
        return solve_path(robot, poses, seed=q[0]).q

    def left(found: Array) -> float:
        return float(np.abs(forward(robot, found)[:, :3, 3] - poses[:, :3, 3]).max())

    def all_postures() -> Array:
        return solve_path(robot, poses).q

    contenders = [
        Contender(OWN, own, count, left(own())),
        Contender(f'{OWN}, all postures', all_postures, count, left(all_postures())),
    ]
    if 'pinocchio' in peers:
        newton = _newton(robot, poses, q[0])
        contenders.append(Contender('pinocchio', newton, count, left(newton())))
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
