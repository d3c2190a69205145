# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Calibration against known truth and scipy's least squares."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from weld_twin_core.arm import chain
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import angle_between, rotation_matrix, transform
from weld_twin_lab.benchmark.calibration import calibrate, linearised, minimal_channels

EXACT = 1e-13
KEYS = ('theta', 'd', 'a', 'alpha')


def displaced(robot: Robot) -> Robot:
    rng = np.random.default_rng(8)
    small = transform(rotation_matrix(1e-2 * rng.normal(size=3)), 1e-2 * rng.normal(size=3))
    rows = {key: getattr(robot, key) + 1e-2 * rng.normal(size=robot.n) for key in KEYS}
    return replace(robot, **rows, T_world_base=small @ robot.T_world_base)


def measured(robot: Robot, q: np.ndarray, noise: float) -> np.ndarray:
    poses = chain.forward(robot, q)
    poses[:, :3, 3] += noise * np.random.default_rng(9).normal(size=(len(q), 3))
    return poses


def test_columns_are_those_of_the_plain_chain(any_robot: Robot) -> None:
    q = np.random.default_rng(1).uniform(-3.0, 3.0, (20, any_robot.n))
    channels = [(key, i) for i in range(any_robot.n) for key in (*KEYS, 'beta')]
    columns, _ = linearised(any_robot, q, chain.forward(any_robot, q), channels)
    frames = chain.frames(any_robot, q)
    for column, channel in zip(columns, channels, strict=True):
        plain = chain.column(any_robot, frames, channel)
        assert np.abs(column.reshape(6, -1) - plain).max() < EXACT, channel


def test_a_calibration_of_modified_rows_with_hayati_angles_settles(
    make_robot: Callable[..., Robot],
) -> None:
    robot = make_robot(4, 'modified')
    q = np.random.default_rng(5).uniform(-3.0, 3.0, (60, 4))
    channels = [(key, i) for key in ('a', 'd') for i in (1, 2)]
    other = replace(robot, a=robot.a + [0.0, 0.01, 0.02, 0.0])
    found = calibrate(robot, q, chain.forward(other, q), channels)
    assert found.settled
    assert np.abs(found.robot.a - other.a).max() < EXACT


def test_thirty_numbers_bring_a_displaced_arm_back_to_rounding(
    make_robot: Callable[..., Robot],
) -> None:
    robot = make_robot(6, beta=False)
    q = np.random.default_rng(4).uniform(-3.0, 3.0, (200, 6))
    found = calibrate(robot, q, measured(displaced(robot), q, 0.0))
    assert len(minimal_channels(robot)) == 30
    assert not found.by_qr
    fresh = np.random.default_rng(5).uniform(-3.0, 3.0, (50, 6))
    gap = chain.forward(found.robot, fresh) - chain.forward(displaced(robot), fresh)
    assert np.abs(gap).max() < 1e-12


def test_with_noise_it_ends_where_scipy_ends(make_robot: Callable[..., Robot]) -> None:
    robot = make_robot(6, beta=False)
    q = np.random.default_rng(4).uniform(-3.0, 3.0, (60, 6))
    poses = measured(displaced(robot), q, 1e-5)
    channels = minimal_channels(robot)
    ours = calibrate(robot, q, poses).robot

    def gap(values: np.ndarray) -> np.ndarray:
        shift = {c: np.asarray(v) for c, v in zip(channels, values, strict=True)}
        found = chain.forward(ours, q, shift)
        turn = angle_between(poses[:, :3, :3], found[:, :3, :3])
        return np.concatenate([poses[:, :3, 3] - found[:, :3, 3], turn], axis=1).ravel()

    tight = dict.fromkeys(('xtol', 'ftol', 'gtol'), 1e-15)
    further = least_squares(gap, np.zeros(30), jac='3-point', x_scale='jac', **tight)
    assert np.abs(further.x).max() < 1e-10


def test_columns_that_depend_on_each_other_are_left_to_qr(
    make_robot: Callable[..., Robot],
) -> None:
    robot = make_robot(6, beta=False)
    q = np.random.default_rng(4).uniform(-3.0, 3.0, (200, 6))
    poses = measured(displaced(robot), q, 0.0)
    everything = (*minimal_channels(robot), ('theta', 5), ('d', 5))
    found = calibrate(robot, q, poses, everything)
    assert found.by_qr
    assert np.abs(chain.forward(found.robot, q) - poses).max() < 1e-12
