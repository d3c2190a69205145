# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A posture followed from a seed, held against the joint positions a path was made from."""

from dataclasses import replace

import numpy as np
import pytest

from weld_twin_core.arm import catalog
from weld_twin_core.arm.chain import forward
from weld_twin_core.motion.inverse import solve_path
from weld_twin_core.motion.inverse.following import follow
from weld_twin_core.motion.paths import Polyline, Torch

NAMES = ['ur5', 'abb_irb120', 'kuka_kr6_r900']
START = np.array([0.3, -0.9, 0.7, 0.5, 0.8, -0.7])


def motion(count, size=0.3):
    """Return joint positions along a smooth motion, shape (count, 6)."""
    s = np.linspace(0.0, 1.0, count)[:, None]
    return START + size * (
        np.sin(s * [1.1, 0.7, 1.3, 2.0, 1.7, 0.9] + np.arange(6.0)) - np.sin(np.arange(6.0))
    )


@pytest.mark.parametrize('name', NAMES)
@pytest.mark.parametrize('count', [32, 57, 1000, 4500])
def test_the_joint_positions_a_path_was_made_from_are_found_again(name, count):
    robot, q = catalog.load(name), motion(count)
    np.testing.assert_allclose(follow(robot, forward(robot, q), q[0] + 0.01), q, atol=1e-10)


def test_an_arm_without_a_closed_form_is_followed_as_well():
    rng = np.random.default_rng(0)
    robot = catalog.load('ur5')
    robot = replace(robot, alpha=robot.alpha + 1e-3 * rng.normal(size=6))
    q = motion(200)
    solution = solve_path(robot, forward(robot, q), q[0])
    assert solution.method == 'followed'
    np.testing.assert_allclose(solution.q, q, atol=1e-10)


def test_a_motion_that_swings_far_is_followed_in_pieces():
    robot, q = catalog.load('ur5'), motion(1500, size=0.1)
    q[:, [0, 5]] += np.linspace(0.0, 3.0, len(q))[:, None]
    np.testing.assert_allclose(follow(robot, forward(robot, q), q[0]), q, atol=1e-9)


def test_a_corner_of_the_seam_is_left_to_the_careful_way_and_closes():
    robot = catalog.load('ur5')
    path = Polyline([[0.4, -0.1, 0.2], [0.4, 0.1, 0.2], [0.5, 0.1, 0.2]])
    poses = Torch().poses(path.sample(np.linspace(0.0, path.length, 301)))
    whole = solve_path(robot, poses)
    again = solve_path(robot, poses, whole.q[0])
    assert again.residual.max() < 1e-9
    np.testing.assert_allclose(again.q, whole.q, atol=1e-8)


def test_nothing_is_followed_where_there_is_doubt():
    robot, q = catalog.load('ur5'), motion(200)
    poses = forward(robot, q)
    assert follow(robot, poses[:31], q[0]) is None
    assert follow(robot, poses, q[0] + 0.3) is None
    assert follow(replace(robot, upper=q.max(axis=0) - 1e-3), poses, q[0]) is None
    assert follow(catalog.load('franka_panda'), poses, np.zeros(7)) is None
    leap = np.concatenate([poses[:100], forward(robot, q[100:] + [0.7, 0, 0, 0, 0, 0])])
    assert follow(robot, leap, q[0]) is None


def test_a_wrist_that_comes_by_its_singularity_is_not_followed():
    robot = catalog.load('abb_irb120')
    q = START + np.linspace(0.0, 1.0, 200)[:, None] * [0.2, 0.1, 0.0, 0.0, -0.8, 0.3]
    poses = forward(robot, q)
    assert follow(robot, poses, q[0]) is None
    np.testing.assert_allclose(solve_path(robot, poses, q[0]).q[:-1], q[:-1], atol=1e-6)
