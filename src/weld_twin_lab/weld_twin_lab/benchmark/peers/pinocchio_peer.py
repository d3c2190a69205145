# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Pinocchio, in a Python loop over its compiled algorithms."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array

from ..race import DH_KEYS, links
from . import Peer

AXES = {'theta': 'RZ', 'd': 'PZ', 'a': 'PX', 'alpha': 'RX'}


def chain_model(robot: Robot) -> tuple[pin.Model, int]:
    """Return the arm as a model, and the index of its tool frame."""
    model, parent = pin.Model(), 0
    *placements, tool = links(robot)
    for i, placement in enumerate(placements):
        parent = model.addJoint(parent, pin.JointModelRZ(), pin.SE3(placement), f'q{i}')
    return model, model.addFrame(pin.Frame('tool', parent, pin.SE3(tool), pin.OP_FRAME))


def dh_model(robot: Robot) -> tuple[pin.Model, int]:
    """Return a model with a joint for every DH value, and the index of its tool frame."""
    model, parent = pin.Model(), 0
    placement = pin.SE3(robot.T_world_base)
    for i in range(robot.n):
        for key in DH_KEYS:
            joint = getattr(pin, f'JointModel{AXES[key]}')()
            parent = model.addJoint(parent, joint, placement, f'{key}{i}')
            placement = pin.SE3.Identity()
    frame = pin.Frame('tool', parent, pin.SE3(robot.T_flange_tool), pin.OP_FRAME)
    return model, model.addFrame(frame)


def make(robot: Robot) -> Peer:
    model, tool = chain_model(robot)
    data = model.createData()
    wide, wide_tool = dh_model(robot)
    wide_data = wide.createData()
    values = np.stack([getattr(robot, key) for key in DH_KEYS], axis=1).ravel()

    def single(q: Array) -> Array:
        pin.forwardKinematics(model, data, q)
        return np.asarray(pin.updateFramePlacement(model, data, tool).homogeneous)

    def poses(q: Array) -> Array:
        out = np.empty((len(q), 4, 4))
        for one, pose in zip(q, out, strict=True):
            pin.forwardKinematics(model, data, one)
            pose[:] = pin.updateFramePlacement(model, data, tool).homogeneous
        return out

    def screws(q: Array) -> tuple[Array, Array]:
        return _jacobians(model, data, tool, q)

    def dh(q: Array) -> tuple[Array, Array]:
        every = np.broadcast_to(values, (len(q), values.size)).copy()
        every[:, ::4] += q
        return _jacobians(wide, wide_data, wide_tool, every)

    return Peer(poses, screws, single, dh)


def _jacobians(model: pin.Model, data: pin.Data, tool: int, q: Array) -> tuple[Array, Array]:
    poses, out = np.empty((len(q), 4, 4)), np.empty((len(q), 6, model.nv))
    for one, pose, jacobian in zip(q, poses, out, strict=True):
        pin.computeJointJacobians(model, data, one)
        pose[:] = pin.updateFramePlacement(model, data, tool).homogeneous
        jacobian[:] = pin.getFrameJacobian(model, data, tool, pin.LOCAL_WORLD_ALIGNED)
    return poses, out
