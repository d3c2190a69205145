# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Inverse kinematics against forward kinematics: poses, paths, and what is followed."""

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from weld_twin_core import ReachError, catalog, forward, jacobian, solve, solve_path
from weld_twin_core.arm.rotation import angle_between
from weld_twin_core.motion.inverse import family, polish
from weld_twin_core.motion.inverse.along_path import jumps
from weld_twin_core.motion.inverse.following import follow
from weld_twin_core.motion.paths import Line, Polyline, Torch

ARMS = ('ur5', 'ur10', 'kuka_kr6_r900', 'abb_irb120', 'abb_irb1600', 'fanuc_m10ia')


def gaps(robot, q, pose):
    """Return the errors of position [m] and orientation [rad], shapes (K,)."""
    reached = forward(robot, q)
    turned = angle_between(reached[:, :3, :3], np.broadcast_to(pose[:3, :3], (len(q), 3, 3)))
    position = np.linalg.norm(reached[:, :3, 3] - pose[:3, 3], axis=1)
    return position, np.linalg.norm(turned, axis=1)


def with_errors(robot, seed=0):
    """Return the arm with errors on every DH value, as after a calibration."""
    rng = np.random.default_rng(seed)
    wrong = {
        key: getattr(robot, key) + rng.normal(scale=1e-3, size=robot.n)
        for key in ('a', 'd', 'alpha', 'theta', 'beta')
    }
    return replace(robot, **wrong)


def is_among(robot, q, found, tolerance=1e-6):
    apart = np.angle(np.exp(1j * (found - q)))
    return bool((np.abs(apart).max(axis=1) < tolerance).any())


def test_the_family_is_read_off_the_geometry():
    assert family(catalog.load('ur5')) == 'three parallel'
    assert family(catalog.load('kuka_kr6_r900')) == 'spherical wrist'
    assert family(catalog.load('franka_panda')) is None
    assert family(with_errors(catalog.load('ur5'))) is None


def test_the_family_does_not_depend_on_base_and_tool():
    robot = catalog.load('abb_irb120')
    frame = forward(catalog.load('ur5'), np.linspace(0.2, 1.0, 6))
    moved = robot.with_frames(base=frame, tool=frame)
    assert family(moved) == 'spherical wrist'
    q = np.array([0.3, 0.4, -0.2, 0.5, 0.6, -0.7])
    assert is_among(moved, q, solve(moved, forward(moved, q)))


@settings(max_examples=60, deadline=None)
@given(name=st.sampled_from(ARMS), part=st.lists(st.floats(0.02, 0.98), min_size=6, max_size=6))
def test_the_joint_positions_a_pose_was_made_with_are_found_again(name, part):
    robot = catalog.load(name)
    q = robot.lower + np.array(part) * (robot.upper - robot.lower)
    # Next to a singularity the posture is not determined by the pose.
    assume(np.linalg.cond(jacobian(robot, q)) < 1e3)
    pose = forward(robot, q)
    found = solve(robot, pose)
    position, turned = gaps(robot, found, pose)
    assert position.max() <= 1e-9
    assert turned.max() <= 1e-9
    assert is_among(robot, q, found)
    assert ((found >= robot.lower) & (found <= robot.upper)).all()


def test_a_ur_has_eight_postures_and_they_differ():
    robot = catalog.load('ur5')
    found = solve(robot, forward(robot, np.array([0.4, -1.2, 1.5, -1.0, -1.2, 0.3])))
    assert len(found) == 8
    apart = np.abs(np.angle(np.exp(1j * (found[:, None] - found)))).max(axis=-1)
    assert (apart + 10.0 * np.eye(8)).min() > 0.1


@pytest.mark.parametrize('name', ['ur5', 'abb_irb120', 'kuka_kr6_r900'])
def test_the_search_finds_as_many_postures_of_an_arm_with_errors_as_the_closed_form(name):
    nominal = catalog.load(name)
    q = np.array([0.3, -1.0, 1.2, 0.4, 0.9, -0.5])
    robot = with_errors(nominal)
    pose = forward(robot, q)
    found = solve(robot, pose)
    position, turned = gaps(robot, found, pose)
    assert max(position.max(), turned.max()) <= 1e-9
    assert is_among(robot, q, found)
    assert len(found) == len(solve(nominal, forward(nominal, q)))


def test_a_seven_joint_arm_reaches_poses_made_within_its_limits(configurations):
    robot = catalog.load('franka_panda')
    for q in configurations(robot, 5):
        pose = forward(robot, q)
        found = solve(robot, pose)
        position, turned = gaps(robot, found, pose)
        assert max(position.max(), turned.max()) <= 1e-9
        assert ((found >= robot.lower - 1e-9) & (found <= robot.upper + 1e-9)).all()


def test_polish_closes_a_rough_start_to_rounding(robot, configurations):
    q = configurations(robot, 50)
    q = q[np.linalg.cond(jacobian(robot, q)) < 100.0]
    poses = forward(robot, q)
    closed, error = polish(robot, q + 1e-3, poses)
    assert np.abs(error).max() < 1e-12
    np.testing.assert_allclose(forward(robot, closed), poses, atol=1e-12)


def test_a_path_keeps_the_branch_nearest_the_seed():
    robot = catalog.load('ur5')
    poses = Torch().poses(Line([0.4, -0.1, 0.2], [0.4, 0.1, 0.2]).sample(np.linspace(0, 0.2, 50)))
    for seed in solve(robot, poses[0]):
        solution = solve_path(robot, poses, seed)
        np.testing.assert_allclose(solution.q[0], seed, atol=1e-6)
        assert np.abs(np.diff(solution.q, axis=0)).max() < 0.1


WRIST = [0.3, -0.9, 0.7, 0.5, 0.0, -0.7]


@pytest.mark.parametrize(
    ('name', 'middle', 'joint', 'reach', 'off'),
    [
        ('ur5', [3.25, -1.2, 1.5, -1.8, -1.57, 0.0], 0, 0.25, 1e-9),
        ('ur5', WRIST, 4, 0.3, 1e-7),
        ('abb_irb120', WRIST, 4, 0.3, 1e-7),
    ],
)
def test_a_joint_passes_half_a_turn_and_a_wrist_its_singularity_straight_on(
    name, middle, joint, reach, off
):
    robot = catalog.load(name)
    q = middle + np.linspace(-reach, reach, 60)[:, None] * np.eye(6)[joint]
    solution = solve_path(robot, forward(robot, q), q[0])
    np.testing.assert_allclose(solution.q, q, atol=off)


def test_a_sample_on_the_singularity_itself_gets_the_posture_around_it():
    # The pose does not determine joints 4 and 6 there; the neighbours do, to a part of a step.
    robot = catalog.load('abb_irb120')
    step = 0.015
    bent = step * np.arange(-20, 21)[:, None] * np.eye(6)[4]
    q = WRIST + bent
    poses = forward(robot, q)
    solution = solve_path(robot, poses, q[0])
    assert solution.residual.max() < 1e-9
    np.testing.assert_allclose(
        np.delete(solution.q, 20, axis=0), np.delete(q, 20, axis=0), atol=1e-7
    )
    np.testing.assert_allclose(solution.q[20], q[20], atol=0.05 * step)


def test_a_joint_that_spins_while_the_tool_rests_is_a_jump():
    robot = catalog.load('abb_irb120')
    q = np.array([[0.3, 0.4, -0.2, 1.3, 0.001, -0.7], [0.3, 0.4, -0.2, -0.5, 0.001, 1.1]])
    assert jumps(robot, q, forward(robot, q)).all()
    q[1] = q[0] + 0.3
    assert not jumps(robot, q, forward(robot, q)).any()


def test_the_posture_report_is_that_of_the_jacobian():
    robot = catalog.load('kuka_kr6_r900')
    poses = Torch().poses(Line([0.5, -0.1, 0.2], [0.5, 0.1, 0.2]).sample(np.linspace(0, 0.2, 9)))
    solution = solve_path(robot, poses)
    margin = np.minimum(solution.q - robot.lower, robot.upper - solution.q).min(axis=1)
    np.testing.assert_allclose(solution.limit_margin, margin)
    scaled = jacobian(robot, solution.q)
    length = 0.4 + 0.025 + 0.455 + np.hypot(0.035, 0.42) + 0.08
    scaled[:, :3] /= length
    np.testing.assert_allclose(solution.condition, np.linalg.cond(scaled))
    np.testing.assert_allclose(solution.manipulability, np.abs(np.linalg.det(scaled)))


@pytest.mark.parametrize('end', [1.5, -0.5])
def test_a_seam_out_of_reach_names_its_first_sample(end):
    robot = catalog.load('ur5')
    line = Line([0.45, 0.0, 0.2], [end, 0.0, 0.2])
    poses = Torch().poses(line.sample(np.linspace(0.0, line.length, 80)))
    with pytest.raises(ReachError, match=r'ur5 cannot reach sample \d+ at .* the nearest') as no:
        solve_path(robot, poses)
    first = int(re.search(r'sample (\d+)', str(no.value)).group(1))
    assert '({:.3f}, {:.3f}, {:.3f}) m'.format(*poses[first, :3, 3]) in str(no.value)
    assert solve_path(robot, poses[:first]).residual.max() < 1e-9


def test_a_joint_limit_in_the_way_is_named():
    robot = catalog.load('abb_irb120')
    q = np.array([0.3, 0.4, -0.2, 0.5, 0.6, -0.7])
    stiff = np.arange(6) == 4
    narrow = replace(
        robot, lower=np.where(stiff, -0.01, robot.lower), upper=np.where(stiff, 0.01, robot.upper)
    )
    with pytest.raises(ReachError, match=r"'joint_5' would have to be at .* outside \[-0\.010, 0"):
        solve(narrow, forward(robot, q))


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
