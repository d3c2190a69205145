# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The bulk kernels against the plain chain, which test_chain holds against Pinocchio."""

from collections.abc import Callable
from functools import partial
from threading import Thread

import numpy as np
import pytest

from weld_twin_core.arm import chain
from weld_twin_core.arm.bulk import bulk_kernel as bulk
from weld_twin_core.arm.bulk.bulk_kernel import _LENGTHS, BulkKernel, HalfAngle, aligned, kernel_of
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.single_pose import SinglePose
from weld_twin_core.errors import ModelError

EXACT = 1e-13
TURNS = ('theta', 'a', 'alpha', 'beta')


def positions(robot: Robot, count: int) -> np.ndarray:
    return np.random.default_rng(count).uniform(-3.2, 3.2, (count, robot.n))


def sincos(angles: np.ndarray, by_tangent: bool) -> tuple[np.ndarray, np.ndarray]:
    u, v = HalfAngle(*angles.shape, by_tangent=by_tangent)(angles)
    return 2.0 * u, 1.0 - 2.0 * v


both_ways = pytest.mark.parametrize('by_tangent', [True, False])


@both_ways
def test_sine_and_cosine_agree_with_libm_over_several_turns(by_tangent: bool) -> None:
    angles = np.random.default_rng(0).uniform(-7.0, 7.0, (3, 40_000))
    angles[0, :5] = 0.0, np.pi, -np.pi, np.nextafter(np.pi, 4.0), 2.0 * np.pi
    sine, cosine = sincos(angles, by_tangent)
    assert np.abs(sine - np.sin(angles)).max() < 4e-15
    assert np.abs(cosine - np.cos(angles)).max() < 4e-15


@both_ways
@pytest.mark.parametrize('turns', [1.0, 1e3, 1e6])
def test_far_out_sine_and_cosine_err_by_the_last_digit_of_the_angle(
    turns: float, by_tangent: bool
) -> None:
    angles = 2.0 * np.pi * turns + np.random.default_rng(1).uniform(-3.0, 3.0, 1000)
    sine, cosine = sincos(angles, by_tangent)
    allowed = 4e-15 + 2.0 * np.spacing(angles.max())
    assert np.abs(sine - np.sin(angles)).max() < allowed
    assert np.abs(cosine - np.cos(angles)).max() < allowed


def test_working_memory_begins_on_a_cache_line() -> None:
    assert all(aligned(3, size).ctypes.data % 64 == 0 for size in (8, 1000, 100_000))


def test_bulk_poses_are_those_of_the_plain_chain(any_robot: Robot) -> None:
    q = positions(any_robot, 2345)
    plain = chain.frames(any_robot, q)
    poses = BulkKernel(any_robot).poses(q)
    assert np.abs(poses[:, :3, 3] - plain.position).max() < EXACT
    assert np.abs(poses[:, :3, :3] - plain.rotation).max() < EXACT
    assert (poses[:, 3] == [0.0, 0.0, 0.0, 1.0]).all()


def test_every_sample_is_worked_on_whatever_their_number_and_what_came_before(
    make_robot: Callable[..., Robot],
) -> None:
    kernel = BulkKernel(make_robot(6), [('theta', i) for i in range(6)])
    for count in (3000, 0, 1, 7, 999, 1000, 1001, 3000):
        q = positions(kernel.robot, count)
        out = np.full((count, 4, 4), np.nan)
        assert kernel.poses(q, out) is out
        for poses in (out, kernel.screws(q)[0]):
            assert np.abs(poses - chain.forward(kernel.robot, q)).max(initial=0.0) < EXACT


def test_poses_are_the_same_where_numpy_has_no_quick_tangent(
    any_robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    q = positions(any_robot, 500)
    usual = BulkKernel(any_robot).poses(q)
    for by_tangent in (True, False):
        monkeypatch.setattr(bulk, 'HalfAngle', partial(HalfAngle, by_tangent=by_tangent))
        assert np.abs(BulkKernel(any_robot).poses(q) - usual).max() < EXACT


def test_bulk_screws_are_the_columns_of_the_plain_chain(any_robot: Robot) -> None:
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


def test_a_kernel_is_prepared_once_for_each_thread(make_robot: Callable[..., Robot]) -> None:
    robot = make_robot(6)
    others: list[BulkKernel] = []
    thread = Thread(target=lambda: others.append(kernel_of(robot)))
    thread.start()
    thread.join()
    assert kernel_of(robot) is kernel_of(robot) is not others[0]


def test_a_kernel_keeps_the_memory_of_a_few_lengths_only(make_robot: Callable[..., Robot]) -> None:
    kernel = BulkKernel(make_robot(6))
    for count in range(1, 20):
        kernel.poses(positions(kernel.robot, count))
    assert len(kernel._memory) <= _LENGTHS


def test_memory_that_poses_cannot_be_written_to_is_refused(
    make_robot: Callable[..., Robot],
) -> None:
    kernel = BulkKernel(make_robot(6))
    for out in (np.empty((4, 4, 5)).transpose(2, 0, 1), np.empty((4, 4, 4))):
        with pytest.raises(ModelError, match='contiguous array'):
            kernel.poses(positions(kernel.robot, 5), out)


def test_joint_positions_screws_and_channels_of_another_shape_are_refused(
    make_robot: Callable[..., Robot],
) -> None:
    kernel = BulkKernel(make_robot(6), [('theta', 0), ('alpha', 3)])
    with pytest.raises(ModelError, match=r'of shape \(N, 6\), got \(5, 1\)'):
        kernel.poses(np.zeros((5, 1)))
    with pytest.raises(ModelError, match=r'shape \(6, 2, 5\), got \(6, 3, 5\)'):
        kernel.screws(np.zeros((5, 6)), out=np.empty((6, 3, 5)))
    with pytest.raises(ModelError, match=r"channel \('theta', 6\) is no DH value"):
        BulkKernel(kernel.robot, [('theta', 6)])


def test_forward_of_many_is_forward_of_each(make_robot: Callable[..., Robot]) -> None:
    robot = make_robot(6)
    q = positions(robot, chain.MANY)
    few = np.concatenate([chain.forward(robot, part) for part in np.array_split(q, 4)])
    assert np.abs(chain.forward(robot, q) - few).max() < EXACT


def test_a_single_pose_is_that_of_the_plain_chain(any_robot: Robot) -> None:
    pose = SinglePose(any_robot)
    for q in positions(any_robot, 50):
        assert np.abs(pose(q) - chain.forward(any_robot, q)).max() < EXACT
