# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The chain and its load torques against plain products, Pinocchio, virtual work and differences."""

from dataclasses import replace

import numpy as np
import pytest
from drawn_robots import pinocchio_model
from scipy.spatial.transform import Rotation

from weld_twin_core.arm import chain, dynamics
from weld_twin_core.arm.chain import frames


def positions(robot, count=5, seed=0):
    return np.random.default_rng(seed).uniform(-1.5, 1.5, (count, robot.n))


def geometric_channels(robot):
    """Return every geometric channel: base, theta d a alpha beta of every row, root, tool."""
    rows = [(key, i) for i in range(robot.n) for key in chain.ROW_CHANNELS]
    frames = ('base', 'root', 'tool') if robot.behind else ('base', 'tool')
    return rows + [(name, k) for name in frames for k in range(6)]


def pose_difference(after, before):
    """Return the twist between two stacks of poses, shape (..., 6)."""
    turn = after[..., :3, :3] @ np.swapaxes(before[..., :3, :3], -1, -2)
    spin = Rotation.from_matrix(turn.reshape(-1, 3, 3)).as_rotvec().reshape(turn.shape[:-2] + (3,))
    return np.concatenate([after[..., :3, 3] - before[..., :3, 3], spin], axis=-1)


def test_forward_is_the_product_of_the_textbook_matrices(robot, textbook):
    q = positions(robot)
    expected = np.stack([textbook.pose(robot, row) for row in q])
    np.testing.assert_allclose(chain.forward(robot, q), expected, atol=1e-13)


def test_jacobian_is_the_derivative_of_the_pose(robot):
    q, step = positions(robot), 1e-6
    found = chain.jacobian(robot, q)
    for i, dq in enumerate(np.eye(robot.n) * step):
        difference = pose_difference(chain.forward(robot, q + dq), chain.forward(robot, q - dq))
        np.testing.assert_allclose(found[..., i], difference / (2 * step), atol=1e-8)


@pytest.mark.parametrize(('size', 'draws'), [(0.0, ()), (0.1, ()), (0.1, (4, 1))])
def test_every_geometric_channel_has_the_right_column_at_any_displacement(robot, size, draws):
    rng = np.random.default_rng(1)
    q, step = positions(robot), 1e-6
    channels = geometric_channels(robot)
    assert len(channels) == 12 + 5 * robot.n + (6 if robot.behind else 0)
    shift = {channel: np.asarray(size * rng.normal()) for channel in channels}
    shift['theta', robot.n - 1] = size * rng.normal(size=draws)
    at = chain.frames(robot, q, shift)
    for channel in channels:
        after, before = (
            chain.forward(robot, q, {**shift, channel: shift[channel] + way})
            for way in (step, -step)
        )
        difference = pose_difference(after, before) / (2 * step)
        found = np.moveaxis(chain.column(robot, at, channel, shift), 0, -1)
        np.testing.assert_allclose(found, difference, atol=2e-8, err_msg=str(channel))


def test_displaced_channels_are_displaced_numbers_of_the_textbook(robot, textbook):
    rng = np.random.default_rng(2)
    q = positions(robot)
    table = {(key, i): 0.1 * rng.normal() for key in chain.ROW_CHANNELS for i in range(robot.n)}
    base, tool = 0.1 * rng.normal(size=6), 0.1 * rng.normal(size=6)
    shift = {key: np.asarray(value) for key, value in table.items()}
    for k in range(6):
        shift |= {('base', k): base[k], ('tool', k): tool[k]}
    frames = {
        'base': textbook.frame(robot.T_world_base, base[:3], base[3:], 'left'),
        'tool': textbook.frame(robot.T_flange_tool, tool[:3], tool[3:], 'right'),
    }
    expected = np.stack([textbook.pose(robot, row, table, **frames) for row in q])
    np.testing.assert_allclose(chain.forward(robot, q, shift), expected, atol=1e-13)


@pytest.mark.parametrize('lead', [(), (1,), (0,), (4,), (3, 4)])
def test_leading_axes_are_samples_and_draws(robot, lead):
    q = np.random.default_rng(3).uniform(-1, 1, (*lead, robot.n))
    found = chain.forward(robot, q)
    assert found.shape == (*lead, 4, 4)
    assert chain.jacobian(robot, q).shape == (*lead, 6, robot.n)
    for index in np.ndindex(lead):
        np.testing.assert_allclose(found[index], chain.forward(robot, q[index]), atol=1e-14)


def test_a_channel_without_a_direct_column_is_refused(arm):
    with pytest.raises(KeyError):
        chain.column(arm, chain.frames(arm, np.zeros(6)), ('tau', 0))


def in_order(robot, values):
    """Return values of joints in the order of the other library's tree: a positioner from its foot."""
    k = robot.behind
    return np.concatenate([values[:k][::-1], values[k:]])


def test_gravity_torque_is_the_negative_of_pinocchios_generalised_gravity(robot):
    pin, model = pinocchio_model(robot)
    data = model.createData()
    q = positions(robot, 4)
    found = dynamics.gravity_torque(robot, q)
    for row, torque in zip(q, found, strict=True):
        expected = -pin.computeGeneralizedGravity(model, data, in_order(robot, row))
        np.testing.assert_allclose(in_order(robot, torque), expected, atol=1e-11)


@pytest.mark.parametrize('frame', ['tool', 'base'])
def test_wrench_torque_does_the_wrenchs_work(robot, textbook, frame):
    wrench = np.array([5.0, -3.0, 2.0, 0.5, 0.3, -0.2])
    q = positions(robot, 4)
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
    q = positions(robot, 4)
    found = dynamics.gravity_torque(robot, q, shift)
    beta = robot.beta + 0.1 * np.eye(robot.n)[1]
    moved = replace(
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
    view = frames(robot, positions(robot, 4))
    mass, com = np.array([0.5, 1.0, 2.0]), np.random.default_rng(5).normal(size=(3, 3))
    together = dynamics.payload_torque(robot, view, mass[:, None], com[:, None, :])
    assert together.shape == (robot.n, 3, 4)
    for k in range(3):
        alone = dynamics.payload_torque(robot, view, mass[k], com[k])
        np.testing.assert_allclose(together[:, k], alone, atol=1e-13)


@pytest.mark.parametrize('frame', ['tool', 'base'])
def test_slopes_are_differences_of_torques_and_a_torque_is_what_a_joint_carries(robot, frame):
    wrench, load = np.array([5.0, -3.0, 2.0, 0.5, 0.3, -0.2]), (2.0, np.array([0.1, -0.2, 0.3]))
    q, step = positions(robot, 4), 1e-6

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
