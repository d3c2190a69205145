# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""References: Pinocchio models from DH tables, helpers of this folder."""

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from weld_twin_core.arm import catalog

sys.path.insert(0, str(Path(__file__).parent))

# Joint axes at position zero, as in the makers' drawings: point on the axis [m] and direction;
# then the flange's position and its z and x axes.
BUILDS = (
    'abb_irb120',
    'abb_irb1600',
    'kuka_kr6_r900',
    'fanuc_m10ia',
    'ur5',
    'ur10',
    'franka_panda',
)


@pytest.fixture(params=BUILDS)
def robot(request):
    """Return an arm of each build in turn."""
    return catalog.load(request.param)


@pytest.fixture
def configurations():
    """Return a function that draws joint positions within the limits, shape (count, n)."""

    def draw(robot, count=20, seed=3):
        rng = np.random.default_rng(seed)
        return rng.uniform(robot.lower, robot.upper, size=(count, robot.n))

    return draw


@cache
def _pinocchio_model(name):
    pin = pytest.importorskip('pinocchio')
    robot = catalog.load(name)

    def move(kind, value):
        matrix = np.eye(4)
        if kind[0] == 'R':
            matrix[:3, :3] = Rotation.from_euler(kind[1], value).as_matrix()
        else:
            matrix['xyz'.index(kind[1]), 3] = value
        return pin.SE3(matrix)

    model, parent = pin.Model(), 0
    model.gravity.linear = robot.T_world_base[:3, :3] @ robot.gravity
    before = pin.SE3(robot.T_world_base)
    for i in range(robot.n):
        twist = move('Rx', robot.alpha[i]) * move('Tx', robot.a[i])
        if robot.convention == 'modified':
            before, after = before * twist, move('Tz', robot.d[i])
        else:
            after = move('Tz', robot.d[i]) * twist
        placement = before * move('Rz', robot.theta[i])
        parent = model.addJoint(parent, pin.JointModelRZ(), placement, robot.joint_names[i])
        mass, com = (0.0, np.zeros(3)) if robot.mass is None else (robot.mass[i], robot.com[i])
        inertia = pin.Inertia(mass, after.act(com), 0.01 * np.eye(3))
        model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
        before = after
    tip = before * pin.SE3(robot.T_flange_tool)
    model.addFrame(pin.Frame('tip', parent, 0, tip, pin.FrameType.OP_FRAME))
    return model


@pytest.fixture
def pinocchio_model():
    """Return a function from a bundled robot's name to a Pinocchio model with a frame 'tip'."""
    return _pinocchio_model
