# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Kernels for many poses and for one, against the plain chain, and turns against scipy's."""

from functools import partial
from threading import Thread

import numpy as np
import pytest
from drawn_robots import random_robot
from scipy.spatial.transform import Rotation

from weld_twin_core.arm import chain
from weld_twin_core.arm.bulk import bulk_kernel as bulk
from weld_twin_core.arm.bulk.bulk_kernel import _LENGTHS, BulkKernel, HalfAngle, aligned, kernel_of
from weld_twin_core.arm.single_pose import (
    SinglePose,
    quaternion_matrix,
    turn_between,
    turn_matrix,
)
from weld_twin_core.errors import DataError, ModelError

EXACT = 1e-13
TURNS = ('theta', 'a', 'alpha', 'beta')
CASES = {
    'six joints': (6, 'standard', ()),
    'seven joints': (7, 'standard', ()),
    'one joint': (1, 'standard', ()),
    'two joints': (2, 'modified', ()),
    'modified rows': (6, 'modified', ()),
    'sliding joints': (6, 'standard', (0, 3)),
    'modified rows that slide': (7, 'modified', (1, 6)),
}


@pytest.fixture(params=CASES, ids=list(CASES))
def any_robot(request):
    n, *how = CASES[request.param]
    return random_robot(n, n, *how)


def positions(robot, count):
    return np.random.default_rng(count).uniform(-3.2, 3.2, (count, robot.n))


def sincos(angles, by_tangent):
    u, v = HalfAngle(*angles.shape, by_tangent=by_tangent)(angles)
    return 2.0 * u, 1.0 - 2.0 * v


both_ways = pytest.mark.parametrize('by_tangent', [True, False])


@both_ways
def test_sine_and_cosine_agree_with_libm_over_several_turns(by_tangent):
    angles = np.random.default_rng(0).uniform(-7.0, 7.0, (3, 40_000))
    angles[0, :5] = 0.0, np.pi, -np.pi, np.nextafter(np.pi, 4.0), 2.0 * np.pi
    sine, cosine = sincos(angles, by_tangent)
    assert np.abs(sine - np.sin(angles)).max() < 4e-15
    assert np.abs(cosine - np.cos(angles)).max() < 4e-15


@both_ways
@pytest.mark.parametrize('turns', [1.0, 1e3, 1e6])
def test_far_out_sine_and_cosine_err_by_the_last_digit_of_the_angle(turns, by_tangent):
    angles = 2.0 * np.pi * turns + np.random.default_rng(1).uniform(-3.0, 3.0, 1000)
    sine, cosine = sincos(angles, by_tangent)
    allowed = 4e-15 + 2.0 * np.spacing(angles.max())
    assert np.abs(sine - np.sin(angles)).max() < allowed
    assert np.abs(cosine - np.cos(angles)).max() < allowed


def test_working_memory_begins_on_a_cache_line():
    assert all(aligned(3, size).ctypes.data % 64 == 0 for size in (8, 1000, 100_000))


def test_bulk_poses_are_those_of_the_plain_chain(any_robot):
    q = positions(any_robot, 2345)
    plain = chain.frames(any_robot, q)
    poses = BulkKernel(any_robot).poses(q)
    assert np.abs(poses[:, :3, 3] - plain.position).max() < EXACT
    assert np.abs(poses[:, :3, :3] - plain.rotation).max() < EXACT
    assert (poses[:, 3] == [0.0, 0.0, 0.0, 1.0]).all()


def test_every_sample_is_worked_on_whatever_their_number_and_what_came_before():
    kernel = BulkKernel(random_robot(6), [('theta', i) for i in range(6)])
    for count in (3000, 0, 1, 7, 999, 1000, 1001, 3000):
        q = positions(kernel.robot, count)
        out = np.full((count, 4, 4), np.nan)
        assert kernel.poses(q, out) is out
        for poses in (out, kernel.screws(q)[0]):
            assert np.abs(poses - chain.forward(kernel.robot, q)).max(initial=0.0) < EXACT


def test_poses_are_the_same_where_numpy_has_no_quick_tangent(any_robot, monkeypatch):
    q = positions(any_robot, 500)
    usual = BulkKernel(any_robot).poses(q)
    for by_tangent in (True, False):
        monkeypatch.setattr(bulk, 'HalfAngle', partial(HalfAngle, by_tangent=by_tangent))
        assert np.abs(BulkKernel(any_robot).poses(q) - usual).max() < EXACT


def test_bulk_screws_are_the_columns_of_the_plain_chain(any_robot):
    q = positions(any_robot, 1100)
    channels = [(kind, i) for i in range(any_robot.n) for kind in TURNS]
    np.random.default_rng(0).shuffle(channels)  # they may come in any order
    poses, screws = BulkKernel(any_robot, channels).screws(q)
    plain = chain.frames(any_robot, q)
    assert np.abs(poses[:, :3, 3] - plain.position).max() < EXACT
    for screw, (kind, i) in zip(screws.swapaxes(0, 1), channels, strict=True):
        column = chain.column(any_robot, plain, (kind, i))
        if kind == 'a':  # the axis of its screw is the direction it slides in
            assert np.abs(screw[3:] - column[:3]).max() < EXACT
        else:
            assert np.abs(screw - column).max() < EXACT


def test_a_kernel_is_prepared_once_for_each_thread():
    robot = random_robot(6)
    others = []
    thread = Thread(target=lambda: others.append(kernel_of(robot)))
    thread.start()
    thread.join()
    assert kernel_of(robot) is kernel_of(robot) is not others[0]


def test_a_kernel_keeps_the_memory_of_a_few_lengths_only():
    kernel = BulkKernel(random_robot(6))
    for count in range(1, 20):
        kernel.poses(positions(kernel.robot, count))
    assert len(kernel._memory) <= _LENGTHS


def test_memory_that_poses_cannot_be_written_to_is_refused():
    kernel = BulkKernel(random_robot(6))
    for out in (np.empty((4, 4, 5)).transpose(2, 0, 1), np.empty((4, 4, 4))):
        with pytest.raises(ModelError, match='contiguous array'):
            kernel.poses(positions(kernel.robot, 5), out)


def test_joint_positions_screws_and_channels_of_another_shape_are_refused():
    kernel = BulkKernel(random_robot(6), [('theta', 0), ('alpha', 3)])
    with pytest.raises(ModelError, match=r'of shape \(N, 6\), got \(5, 1\)'):
        kernel.poses(np.zeros((5, 1)))
    with pytest.raises(ModelError, match=r'shape \(6, 2, 5\), got \(6, 3, 5\)'):
        kernel.screws(np.zeros((5, 6)), out=np.empty((6, 3, 5)))
    with pytest.raises(ModelError, match=r"channel \('theta', 6\) is no DH value"):
        BulkKernel(kernel.robot, [('theta', 6)])


def test_forward_of_many_is_forward_of_each():
    robot = random_robot(6)
    q = positions(robot, chain.MANY)
    few = np.concatenate([chain.forward(robot, part) for part in np.array_split(q, 4)])
    assert np.abs(chain.forward(robot, q) - few).max() < EXACT


def test_a_single_pose_is_that_of_the_plain_chain(any_robot):
    pose = SinglePose(any_robot)
    for q in positions(any_robot, 50):
        assert np.abs(pose(q) - chain.forward(any_robot, q)).max() < EXACT


RNG = np.random.default_rng(8)
SIZES = (0.0, 1e-9, 1e-5, 0.999e-4, 1.001e-4, 1e-2, 1.0, 1.6, 3.1, np.pi)


@pytest.mark.parametrize('size', SIZES)
def test_a_turn_and_back(size):
    for axis in RNG.normal(size=(20, 3)):
        turn = size * axis / np.linalg.norm(axis)
        start = Rotation.from_quat(RNG.normal(size=4))
        matrix = turn_matrix(turn)
        np.testing.assert_allclose(matrix, Rotation.from_rotvec(turn).as_matrix(), atol=1e-15)
        back = np.array(turn_between(matrix @ start.as_matrix(), start.as_matrix()))
        # Near half a turn rounding decides which of two vectors it is, and grows.
        apart = Rotation.from_rotvec(back) * Rotation.from_rotvec(turn).inv()
        assert apart.magnitude() < 1e-14


def test_quaternions_of_any_length_near_one():
    for q in RNG.normal(size=(50, 4)):
        given = q / np.linalg.norm(q) * RNG.uniform(0.9901, 1.0099)
        expected = Rotation.from_quat(q).as_matrix()
        np.testing.assert_allclose(quaternion_matrix(*given, 'q'), expected, atol=1e-15)


@pytest.mark.parametrize('length', [0.0, 0.98, 1.02, np.nan, np.inf])
def test_what_is_no_rotation_is_refused(length):
    with pytest.raises(DataError, match='orientation'):
        quaternion_matrix(0.0, 0.6 * length, 0.0, 0.8 * length, 'orientation')
