# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Load torques against Pinocchio on chains built here, and against virtual work."""

import dataclasses

import numpy as np
import pytest

from weld_twin_core.arm import dynamics
from weld_twin_core.arm.chain import frames


def positions(robot, count=4, seed=0):
    return np.random.default_rng(seed).uniform(-1.5, 1.5, (count, robot.n))


def add_branch(pin, model, robot, place, rows):
    """Add rows from a place on what stands still; return the last joint, and the end in it."""

    def turn(axis, angle):
        return pin.SE3(pin.AngleAxis(angle, np.eye(3)['xyz'.index(axis)]).matrix(), np.zeros(3))

    def slide(axis, length):
        return pin.SE3(np.eye(3), length * np.eye(3)['xyz'.index(axis)])

    parent, after = 0, pin.SE3(place)
    for i in rows:
        before = turn('x', robot.alpha[i]) * turn('y', robot.beta[i]) * slide('x', robot.a[i])
        fixed = turn('z', robot.theta[i]) * slide('z', robot.d[i])
        if robot.convention == 'standard':
            at = after
            fixed = (
                fixed
                * slide('x', robot.a[i])
                * turn('x', robot.alpha[i])
                * turn('y', robot.beta[i])
            )
        else:
            at = after * before
        joint = pin.JointModelPZ() if robot.prismatic[i] else pin.JointModelRZ()
        parent, after = model.addJoint(parent, joint, at, f'j{i}'), fixed
        inertia = pin.Inertia(robot.mass[i], robot.com[i], np.zeros((3, 3)))
        model.appendBodyToJoint(parent, inertia, fixed)
    return parent, after


def pinocchio_model(pin, robot):
    """Build the chain joint by joint: constant parts of a row go before or after its joint."""
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
    return model


def in_order(robot, values):
    """Return values of joints in the order of the other library's tree: a positioner from its foot."""
    k = robot.behind
    return np.concatenate([values[:k][::-1], values[k:]])


def test_gravity_torque_is_the_negative_of_pinocchios_generalised_gravity(robot):
    pin = pytest.importorskip('pinocchio')
    model = pinocchio_model(pin, robot)
    data = model.createData()
    q = positions(robot)
    found = dynamics.gravity_torque(robot, q)
    for row, torque in zip(q, found, strict=True):
        expected = -pin.computeGeneralizedGravity(model, data, in_order(robot, row))
        np.testing.assert_allclose(in_order(robot, torque), expected, atol=1e-11)


@pytest.mark.parametrize('frame', ['tool', 'base'])
def test_wrench_torque_does_the_wrenchs_work(robot, textbook, frame):
    wrench = np.array([5.0, -3.0, 2.0, 0.5, 0.3, -0.2])
    q = positions(robot)
    found = dynamics.wrench_torque(robot, frames(robot, q), np.tile(wrench, (4, 1)), frame)
    for k, row in enumerate(q):
        expected = textbook.load_torque(robot, row, wrench, frame)
        weight = textbook.load_torque(robot, row)
        np.testing.assert_allclose(found[:, k], expected - weight, atol=1e-6)


def test_displaced_frames_give_the_torque_of_the_displaced_robot(robot, textbook):
    rng = np.random.default_rng(4)
    base, tool = 0.1 * rng.normal(size=6), 0.1 * rng.normal(size=6)
    shift = {('base', k): base[k] for k in range(6)} | {('tool', k): tool[k] for k in range(6)}
    shift |= {('beta', 1): 0.1 * np.ones((3, 1))}
    q = positions(robot)
    found = dynamics.gravity_torque(robot, q, shift)
    beta = robot.beta + 0.1 * np.eye(robot.n)[1]
    moved = dataclasses.replace(
        robot,
        beta=beta,
        T_world_base=textbook.frame(robot.T_world_base, base[:3], base[3:], 'left'),
        T_flange_tool=textbook.frame(robot.T_flange_tool, tool[:3], tool[3:], 'right'),
    )
    assert found.shape == (3, 4, robot.n)
    for k, row in enumerate(q):
        expected = textbook.load_torque(moved, row)
        np.testing.assert_allclose(found[:, k], np.tile(expected, (3, 1)), atol=1e-6)


def test_payload_draws_are_a_loop_over_draws(robot):
    # Three draws: as many as coordinates, where a wrong broadcast would go unnoticed.
    view = frames(robot, positions(robot))
    mass, com = np.array([0.5, 1.0, 2.0]), np.random.default_rng(5).normal(size=(3, 3))
    together = dynamics.payload_torque(robot, view, mass[:, None], com[:, None, :])
    assert together.shape == (robot.n, 3, 4)
    for k in range(3):
        alone = dynamics.payload_torque(robot, view, mass[k], com[k])
        np.testing.assert_allclose(together[:, k], alone, atol=1e-13)


@pytest.mark.parametrize('frame', ['tool', 'base'])
def test_slopes_are_differences_of_torques_and_a_torque_is_what_a_joint_carries(robot, frame):
    wrench, load = np.array([5.0, -3.0, 2.0, 0.5, 0.3, -0.2]), (2.0, np.array([0.1, -0.2, 0.3]))
    q, step = positions(robot), 1e-6

    def torques(q):
        chain = frames(robot, q)
        weight = dynamics.chain_gravity_torque(robot, chain)
        pull = dynamics.wrench_torque(robot, chain, np.tile(wrench, (4, 1)), frame)
        return weight + pull, dynamics.payload_torque(robot, chain, *load)

    chain = frames(robot, q)
    slopes = (
        dynamics.torque_slope(robot, chain, np.tile(wrench, (4, 1)), frame),
        dynamics.payload_slope(robot, chain, *load),
    )
    for j, way in enumerate(step * np.eye(robot.n)):
        for slope, ahead, before in zip(slopes, torques(q + way), torques(q - way), strict=True):
            np.testing.assert_allclose(slope[:, j], (ahead - before) / (2.0 * step), atol=1e-6)
    for i in robot.behind + np.flatnonzero(~np.array(robot.prismatic[robot.behind :])):
        row = chain.rows[i]
        given = robot, chain, int(i), row.z_point, np.tile(wrench, (4, 1)), frame
        about = (row.z * dynamics.carried_moment(*given)).sum(axis=0)
        np.testing.assert_allclose(about, torques(q)[0][i], atol=1e-9)
