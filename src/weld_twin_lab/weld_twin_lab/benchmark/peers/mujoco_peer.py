# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""MuJoCo's kinematics, in a Python loop."""

from __future__ import annotations

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array

from ..race import links
from . import Peer


def arm_model(robot: Robot) -> mujoco.MjModel:
    """Return the arm as a chain of hinges with a site at its tool."""
    spec = mujoco.MjSpec()
    body = spec.worldbody
    *placements, tool = links(robot)
    for i, placement in enumerate(placements):
        body = body.add_body(
            name=f'link{i}',
            pos=placement[:3, 3],
            quat=_quaternion(placement),
            mass=1.0,
            inertia=[1.0, 1.0, 1.0],
            ipos=[0.0, 0.0, 0.0],
            explicitinertial=True,
        )
        body.add_joint(name=f'q{i}', axis=[0.0, 0.0, 1.0])
    body.add_site(name='tool', pos=tool[:3, 3], quat=_quaternion(tool))
    return spec.compile()


def make(robot: Robot) -> Peer:
    model = arm_model(robot)
    data = mujoco.MjData(model)
    site = model.site('tool').id
    position, rotation = data.site_xpos[site], data.site_xmat[site].reshape(3, 3)
    linear, angular = np.zeros((3, model.nv)), np.zeros((3, model.nv))

    def pose(q: Array, out: Array) -> None:
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        out[:3, :3], out[:3, 3] = rotation, position

    def poses(q: Array) -> Array:
        out = np.tile(np.eye(4), (len(q), 1, 1))
        for one, target in zip(q, out, strict=True):
            pose(one, target)
        return out

    def screws(q: Array) -> tuple[Array, Array]:
        out, jacobians = np.tile(np.eye(4), (len(q), 1, 1)), np.empty((len(q), 6, model.nv))
        for one, target, jacobian in zip(q, out, jacobians, strict=True):
            pose(one, target)
            mujoco.mj_comPos(model, data)
            mujoco.mj_jacSite(model, data, linear, angular, site)
            jacobian[:3], jacobian[3:] = linear, angular
        return out, jacobians

    def single(q: Array) -> Array:
        out = np.eye(4)
        pose(q, out)
        return out

    return Peer(poses, screws, single)


def _quaternion(placement: Array) -> Array:
    x, y, z, w = Rotation.from_matrix(placement[:3, :3]).as_quat()
    return np.array([w, x, y, z])
