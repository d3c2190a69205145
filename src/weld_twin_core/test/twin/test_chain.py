# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The chain against plain matrix products, Pinocchio and finite differences."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from weld_twin_core.arm import chain


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


@pytest.mark.parametrize('size', [0.0, 0.1])
def test_every_geometric_channel_has_the_right_column_at_any_displacement(robot, size):
    rng = np.random.default_rng(1)
    q, step = positions(robot), 1e-6
    channels = geometric_channels(robot)
    assert len(channels) == 12 + 5 * robot.n + (6 if robot.behind else 0)
    shift = {channel: np.asarray(size * rng.normal()) for channel in channels}
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
