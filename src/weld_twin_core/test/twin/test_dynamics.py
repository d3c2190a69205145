# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Load torques against Pinocchio on chains built here, and against virtual work."""

import dataclasses

import numpy as np
import pytest
from drawn_robots import pinocchio_model

from weld_twin_core.arm import dynamics
from weld_twin_core.arm.chain import frames


def positions(robot, count=4, seed=0):
    return np.random.default_rng(seed).uniform(-1.5, 1.5, (count, robot.n))


def in_order(robot, values):
    """Return values of joints in the order of the other library's tree: a positioner from its foot."""
    k = robot.behind
    return np.concatenate([values[:k][::-1], values[k:]])


def test_gravity_torque_is_the_negative_of_pinocchios_generalised_gravity(robot):
    pin, model = pinocchio_model(robot)
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
