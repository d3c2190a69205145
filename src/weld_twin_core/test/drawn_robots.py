# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Robots with every number drawn, and Pinocchio's models of robots, built from their rows."""

from functools import cache

import numpy as np
import pytest

from weld_twin_core.arm.robot import Robot


def random_robot(seed, n=6, convention='standard', slides=(), frames=True):
    """Return a robot with every number drawn, and masses on all links."""
    rng = np.random.default_rng(seed)

    def frame():
        quat = rng.normal(size=4)
        return {'xyz': rng.normal(scale=0.3, size=3), 'quat_xyzw': quat / np.linalg.norm(quat)}

    joints = [
        {
            'name': f'j{i}',
            'a': rng.normal(scale=0.3),
            'alpha': rng.uniform(-2, 2),
            'd': rng.normal(scale=0.3),
            'theta_offset': rng.uniform(-2, 2),
            'beta': rng.uniform(-0.5, 0.5),
            'type': 'prismatic' if i in slides else 'revolute',
        }
        for i in range(n)
    ]
    links = [{'mass': rng.uniform(1, 5), 'com': rng.normal(scale=0.1, size=3)} for _ in range(n)]
    data = {
        'name': f'random{seed}',
        'convention': convention,
        'joints': joints,
        'links': links,
        'payload': {'mass': 2.0, 'com': [0.02, -0.03, 0.1]},
    }
    if frames:
        data |= {'base': frame(), 'tool': frame()}
    return Robot.from_mapping(data)


def add_branch(pin, model, robot, place, rows):
    """Add rows from a place on what stands still; return the last joint, and the end in it."""

    def turn(axis, angle):
        return pin.SE3(pin.AngleAxis(angle, np.eye(3)['xyz'.index(axis)]).matrix(), np.zeros(3))

    def slide(axis, length):
        return pin.SE3(np.eye(3), length * np.eye(3)['xyz'.index(axis)])

    parent, after = 0, pin.SE3(place)
    for i in rows:
        turns = turn('x', robot.alpha[i]) * turn('y', robot.beta[i])
        along = slide('x', robot.a[i])
        before = along * turns if robot.convention == 'standard' else turns * along
        fixed = turn('z', robot.theta[i]) * slide('z', robot.d[i])
        if robot.convention == 'standard':
            at, fixed = after, fixed * before
        else:
            at = after * before
        joint = pin.JointModelPZ() if robot.prismatic[i] else pin.JointModelRZ()
        parent, after = model.addJoint(parent, joint, at, f'j{i}'), fixed
        mass, com = (0.0, np.zeros(3)) if robot.mass is None else (robot.mass[i], robot.com[i])
        inertia = pin.Inertia(mass, com, np.zeros((3, 3)))
        model.appendBodyToJoint(parent, inertia, fixed)
    return parent, after


@cache
def pinocchio_model(robot):
    """Return Pinocchio and its model of a robot with a frame 'tip': rows are parted at their joints."""
    pin = pytest.importorskip('pinocchio')
    model, k = pin.Model(), robot.behind
    # A robot stands in the measuring frame; beside a positioner all stand in the robot's base.
    base = np.eye(4) if k else robot.T_world_base
    model.gravity = pin.Motion(base[:3, :3] @ robot.gravity, np.zeros(3))
    if k:
        foot = np.linalg.inv(robot.T_root_base)
        add_branch(pin, model, robot, foot, range(k)[::-1])
    parent, after = add_branch(pin, model, robot, base, range(k, robot.n))
    tool = after * pin.SE3(robot.T_flange_tool)
    payload = pin.Inertia(robot.payload_mass, robot.payload_com, np.zeros((3, 3)))
    model.appendBodyToJoint(parent, payload, tool)
    model.addFrame(pin.Frame('tip', parent, 0, tool, pin.FrameType.OP_FRAME))
    return pin, model
