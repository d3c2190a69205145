# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Robots and recordings of the core's tests, and kinematics written a second time, plainly."""

import math
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from drawn_robots import random_robot
from scipy.spatial.transform import Rotation

from weld_twin_core import JointMotion, Recording, Robot, Signal, load

sys.path.insert(0, str(Path(__file__).parent))  # what lies beside the tests can be imported


def random_cell(seed, convention='standard', slides=()):
    """Return a robot beside a positioner of two joints, j1 at its foot and j0 at the workpiece."""
    arm = random_robot(seed, n=4, convention=convention, slides=slides).to_mapping()
    foot = random_robot(seed + 50, n=2, convention=convention).to_mapping()
    for rows, names in ((arm['joints'], ('j2', 'j3', 'j4', 'j5')), (foot['joints'], ('j1', 'j0'))):
        for row, name in zip(rows, names, strict=True):
            row['name'] = name
    return Robot.from_mapping(arm | {'workpiece': {k: v for k, v in foot.items() if k in KEPT}})


KEPT = ('base', 'tool', 'joints', 'links', 'payload', 'convention')


ROBOTS = {
    'ur5': replace(load('ur5'), joint_names=tuple(f'j{i}' for i in range(6))),
    'standard': random_robot(1),
    'modified': random_robot(2, convention='modified'),
    'seven joints': random_robot(3, n=7),
    'gantry': random_robot(4, slides=(0, 3), convention='standard'),
    'modified gantry': random_robot(5, slides=(1,), convention='modified'),
    'positioner': random_cell(6, slides=(0,)),
    'modified positioner': random_cell(12, convention='modified'),
}


BUILDS = ('standard', 'modified gantry', 'positioner', 'modified positioner')
"""What effects can meet: either convention, axes that slide, joints behind the workpiece."""


@pytest.fixture(params=ROBOTS, ids=str)
def robot(request):
    """Return each kind of robot in turn."""
    return ROBOTS[request.param]


@pytest.fixture(params=BUILDS, ids=str)
def build(request):
    """Return each build in turn, for what is tried with every effect."""
    return ROBOTS[request.param]


@pytest.fixture
def arm():
    """Return the UR5."""
    return ROBOTS['ur5']


@pytest.fixture
def positioner():
    """Return a robot on a track (j2) beside a positioner."""
    return ROBOTS['positioner']


def elementary(axis, angle=0.0, slide=0.0):
    """Return a turn about and a slide along one coordinate axis, shape (4, 4)."""
    k = 'xyz'.index(axis)
    i, j = (k + 1) % 3, (k + 2) % 3
    out = np.eye(4)
    out[i, i] = out[j, j] = math.cos(angle)
    out[j, i] = math.sin(angle)
    out[i, j] = -out[j, i]
    out[k, 3] = slide
    return out


def textbook_rows(robot, q, table=()):
    """Return the matrices of all DH rows at one joint position."""
    rows = {key: np.array(getattr(robot, key)) for key in ('a', 'alpha', 'd', 'theta', 'beta')}
    for (key, i), value in dict(table).items():
        rows[key][i] += value
    out = []
    for i in range(robot.n):
        theta, d = rows['theta'][i], rows['d'][i]
        if robot.prismatic[i]:
            d = d + q[i]
        else:
            theta = theta + q[i]
        along_z = elementary('z', theta) @ elementary('z', slide=d)
        along_x, twist = elementary('x', slide=rows['a'][i]), elementary('x', rows['alpha'][i])
        hayati = elementary('y', rows['beta'][i])
        if robot.convention == 'standard':
            out.append(along_z @ along_x @ twist @ hayati)
        else:
            out.append(twist @ hayati @ along_x @ along_z)
    return out


def turned_frame(frame, xyz, rotvec, side):
    """Return a frame with its origin moved and turned from the left or from the right."""
    turn = Rotation.from_rotvec(rotvec).as_matrix()
    out = np.array(frame)
    out[:3, 3] += xyz
    out[:3, :3] = turn @ out[:3, :3] if side == 'left' else out[:3, :3] @ turn
    return out


def textbook_pose(robot, q, table=(), base=None, tool=None, root=None):
    """Return T_world_tool by multiplying one matrix after the other."""
    pose = robot.T_world_base if base is None else base
    rows = textbook_rows(robot, q, table)
    if robot.behind:
        for row in rows[: robot.behind]:
            pose = pose @ np.linalg.inv(row)
        pose = pose @ (robot.T_root_base if root is None else root)
    for row in rows[robot.behind :]:
        pose = pose @ row
    return pose @ (robot.T_flange_tool if tool is None else tool)


def potential_energy(robot, q, extra_mass=0.0, extra_com=(0.0, 0.0, 0.0)):
    """
    Return the potential energy of links, payload and an extra payload [J].

    All that weighs stands on what does not move: the robot, and a positioner beside it.
    """
    gravity, energy, pose = robot.gravity, 0.0, np.eye(4)
    rows, k = textbook_rows(robot, q), robot.behind
    foot = np.linalg.inv(robot.T_root_base)
    for i in range(k)[::-1]:
        foot = foot @ rows[i]
        energy -= robot.mass[i] * gravity @ (foot[:3, :3] @ robot.com[i] + foot[:3, 3])
    for i in range(k, robot.n):
        pose = pose @ rows[i]
        energy -= robot.mass[i] * gravity @ (pose[:3, :3] @ robot.com[i] + pose[:3, 3])
    tool = pose @ robot.T_flange_tool
    for mass, com in ((robot.payload_mass, robot.payload_com), (extra_mass, extra_com)):
        energy -= mass * gravity @ (tool[:3, :3] @ np.asarray(com) + tool[:3, 3])
    return energy


def load_torque(robot, q, wrench=None, frame='tool', joints=None, **extra):
    """
    Return the load torque by virtual work, with central differences of textbook kinematics.

    That of other ``joints`` than those asked for, where not all are, is left at zero.
    """
    step, out = 1e-6, np.zeros(robot.n)
    here = textbook_pose(robot, q)
    foot = robot.T_world_base
    for row in textbook_rows(robot, q)[: robot.behind]:
        foot = foot @ np.linalg.inv(row)
    turn = here[:3, :3] if frame == 'tool' else (foot @ robot.T_root_base)[:3, :3]
    for i in range(robot.n) if joints is None else joints:
        dq = step * np.eye(robot.n)[i]
        out[i] = -(
            potential_energy(robot, q + dq, **extra) - potential_energy(robot, q - dq, **extra)
        ) / (2 * step)
        if wrench is not None:
            after, before = textbook_pose(robot, q + dq), textbook_pose(robot, q - dq)
            velocity = (after[:3, 3] - before[:3, 3]) / (2 * step)
            spin = Rotation.from_matrix(after[:3, :3] @ before[:3, :3].T).as_rotvec() / (2 * step)
            out[i] += velocity @ turn @ wrench[:3] + spin @ turn @ wrench[3:]
    return out


@pytest.fixture
def textbook():
    """Return the second, plain formulation of the kinematics and statics."""
    return SimpleNamespace(
        pose=textbook_pose, rows=textbook_rows, load_torque=load_torque, frame=turned_frame
    )


def cubic_motion(n, seed=7):
    """Return joint position and velocity as cubics in time: Hermite interpolation keeps them."""
    rng = np.random.default_rng(seed)
    spread = (0.6, 0.5, 0.2, 0.05)
    polynomials = [np.polynomial.Polynomial(rng.normal(scale=spread)) for _ in range(n)]

    def at(t):
        return np.stack([p(np.asarray(t)) for p in polynomials], axis=-1)

    def rate(t):
        return np.stack([p.deriv()(np.asarray(t)) for p in polynomials], axis=-1)

    return at, rate


def wrench_at(t):
    """Return a wrench that is straight in time, shape t.shape + (6,)."""
    return np.stack([3.0 + 2.0 * k - (1.0 + k) * np.asarray(t) for k in range(6)], axis=-1)


@pytest.fixture
def make_recording():
    """Return a maker of recordings with everything in them, on irregular stamps."""

    def make(robot, count=60, seed=7, wrench_frame='tool', static=False, **more):
        rng = np.random.default_rng(seed)
        t = np.cumsum(rng.uniform(0.005, 0.08, size=count)) + 3.0
        at, rate = cubic_motion(robot.n, seed)
        ends = np.array([0.0, 20.0])
        return Recording(
            'test',
            JointMotion(t, at(t - 3.0), rate(t - 3.0), static=static),
            wrench=Signal(ends, wrench_at(ends - 3.0)),
            wrench_frame=wrench_frame,
            temperature=Signal(ends, 20.0 + 2.0 * ends),
            **more,
        )

    return make


@pytest.fixture
def motion_at():
    """Return joint position at any time of the recordings, in closed form."""
    return lambda robot, t, seed=7: cubic_motion(robot.n, seed)[0](np.asarray(t) - 3.0)


@pytest.fixture
def stamps():
    """Return measurement stamps inside the recordings, off the joint stamps."""
    return lambda recording, count=25: np.linspace(
        recording.joints.t[0] + 0.11, recording.joints.t[-1] - 0.11, count
    )
