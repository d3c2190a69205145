# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""References: Pinocchio models from DH tables, the makers' joint axes, helpers of this folder."""

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
X, Y, Z = np.eye(3)
DRAWINGS = {
    'abb_irb120': (
        [
            ((0, 0, 0), Z),
            ((0, 0, 0.29), Y),
            ((0, 0, 0.56), Y),
            ((0, 0, 0.63), X),
            ((0.302, 0, 0.63), Y),
            ((0.302, 0, 0.63), X),
        ],
        (0.374, 0, 0.63),
        X,
        -Z,
    ),
    'abb_irb1600': (
        [
            ((0, 0, 0), Z),
            ((0.15, 0, 0.4865), Y),
            ((0.15, 0, 0.9615), Y),
            ((0.45, 0, 0.9615), X),
            ((0.75, 0, 0.9615), Y),
            ((0.815, 0, 0.9615), X),
        ],
        (0.815, 0, 0.9615),
        X,
        -Z,
    ),
    'kuka_kr6_r900': (
        [
            ((0, 0, 0.4), -Z),
            ((0.025, 0, 0.4), Y),
            ((0.48, 0, 0.4), Y),
            ((0.48, 0, 0.435), -X),
            ((0.9, 0, 0.435), Y),
            ((0.98, 0, 0.435), -X),
        ],
        (0.98, 0, 0.435),
        X,
        -Z,
    ),
    'fanuc_m10ia': (
        [
            ((0, 0, 0), Z),
            ((0.15, -0.04, 0.45), Y),
            ((0.15, -0.0625, 1.05), -Y),
            ((0.3305, 0, 1.25), -X),
            ((0.79, -0.0565, 1.25), -Y),
            ((0.89, 0, 1.25), -X),
        ],
        (0.89, 0, 1.25),
        X,
        Z,
    ),
}


# One of each build, for the tests that plan: the others are tested as models, in test_catalog.
BUILDS = (*DRAWINGS, 'ur5', 'ur10', 'franka_panda')


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


@pytest.fixture
def drawing():
    """Return the tool pose from a maker's joint axes by a product of rotations."""

    def pose(name, q):
        axes, flange, z, x = DRAWINGS[name]
        rotation, position = np.eye(3), np.zeros(3)
        for (point, axis), angle in zip(axes, q, strict=True):
            turn = Rotation.from_rotvec(angle * np.asarray(axis)).as_matrix()
            position = position + rotation @ (np.asarray(point) - turn @ point)
            rotation = rotation @ turn
        out = np.eye(4)
        out[:3, :3] = rotation @ np.column_stack([x, np.cross(z, x), z])
        out[:3, 3] = position + rotation @ np.asarray(flange)
        return out

    return pose


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
