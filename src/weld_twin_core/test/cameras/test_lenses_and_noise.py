# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Lenses and the noise of poses, against formulas written out here and finite differences."""

from contextlib import nullcontext

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from weld_twin_core import DataError, Measurements
from weld_twin_core.cameras import Lens
from weld_twin_core.pose_noise import PoseNoise, alike, positive

LENS = Lens([812.0, 803.0], [331.0, 236.0], [-0.12, 0.07, 8e-4, -5e-4, 0.01])
POINTS = np.random.default_rng(0).uniform([-0.3, -0.25, 0.8], [0.3, 0.25, 1.5], (40, 3))


def by_hand(points):
    """Return pixels by the page of OpenCV, term by term."""
    x, y = (points[:, :2] / points[:, 2:]).T
    k1, k2, p1, p2, k3 = -0.12, 0.07, 8e-4, -5e-4, 0.01
    r = np.hypot(x, y)
    radial = 1 + k1 * r**2 + k2 * r**4 + k3 * r**6
    u = x * radial + 2 * p1 * x * y + p2 * (r**2 + 2 * x**2)
    v = y * radial + p1 * (r**2 + 2 * y**2) + 2 * p2 * x * y
    return np.column_stack([812.0 * u + 331.0, 803.0 * v + 236.0])


def test_a_lens_sees_points_where_opencv_does_and_finds_back():
    seen = LENS.project(POINTS)
    np.testing.assert_allclose(seen, by_hand(POINTS), atol=1e-9)
    np.testing.assert_allclose(LENS.rays(seen), POINTS[:, :2] / POINTS[:, 2:], atol=1e-10)


def test_derivatives_are_finite_differences():
    _, by_point, by_lens = LENS.derivatives(POINTS)
    for k in range(3):
        step = 1e-6 * np.eye(3)[k]
        slope = (LENS.project(POINTS + step) - LENS.project(POINTS - step)) / 2e-6
        np.testing.assert_allclose(by_point[..., k], slope, rtol=1e-5, atol=1e-3)
    for k in range(9):
        step = 1e-6 * np.eye(9)[k]
        slope = (LENS.moved(step).project(POINTS) - LENS.moved(-step).project(POINTS)) / 2e-6
        np.testing.assert_allclose(by_lens[..., k], slope, rtol=1e-5, atol=1e-4)


@pytest.mark.parametrize('clockwise', [True, False])
def test_a_turned_lens_sees_the_turned_image(clockwise):
    x, y = LENS.project(POINTS).T
    stored = np.column_stack([y, 640.0 - x] if clockwise else [480.0 - y, x])
    turn = -np.pi / 2 if clockwise else np.pi / 2
    about = Rotation.from_rotvec([0.0, 0.0, turn]).apply(POINTS)
    turned = LENS.turned(np.array([640.0, 480.0]), clockwise=clockwise)
    np.testing.assert_allclose(turned.project(about), stored, atol=1e-9)


def test_noise_goes_along_when_poses_are_inverted():
    rng = np.random.default_rng(4)
    half = rng.normal(size=(5, 6, 6)) * np.array([1e-4, 2e-4, 1e-3, 1e-3, 2e-3, 3e-4])[:, None]
    covariance = half @ np.swapaxes(half, 1, 2)
    turn = Rotation.from_rotvec(rng.normal(size=(5, 3))).as_matrix()
    where = rng.normal(size=(5, 3))
    noise = PoseNoise.of(covariance)
    np.testing.assert_allclose(noise.covariance, covariance, rtol=1e-6, atol=1e-14)
    given = Measurements(np.arange(5.0), where, turn, noise=noise)
    slope = np.empty((5, 6, 6))
    for k in range(6):
        step = 1e-6 * np.eye(6)[k]
        moved = Rotation.from_rotvec(step[3:]).as_matrix() @ turn
        then = Measurements(np.arange(5.0), where + step[:3], moved).inverted()
        now = given.inverted()
        slope[:, :3, k] = (then.position - now.position) / 1e-6
        away = then.rotation @ np.swapaxes(now.rotation, 1, 2)
        slope[:, 3:, k] = Rotation.from_matrix(away).as_rotvec() / 1e-6
    wanted = slope @ covariance @ np.swapaxes(slope, 1, 2)
    np.testing.assert_allclose(given.inverted().noise.covariance, wanted, rtol=1e-3, atol=1e-11)


def test_a_covariance_that_somebody_typed_in_tells_nothing():
    usual = np.diag([1e-6] * 3 + [1e-4] * 3)
    assert alike(np.stack([usual, usual]))
    assert not alike(np.stack([usual, 2.0 * usual]))
    assert not alike(np.diag([1e-6, 1e-6, 1e-5, 1e-4, 1e-4, 1e-4])[None])
    assert positive(np.stack([usual, np.zeros((6, 6)), -usual])).tolist() == [True, False, False]


def test_a_lens_without_a_focal_length_is_refused():
    with pytest.raises(DataError, match='focal'):
        Lens([0.0, 800.0], [320.0, 240.0], [])


@pytest.mark.parametrize(('count', 'known'), [(3, False), (4, True), (6, False), (8, True)])
def test_a_lens_is_bent_by_as_many_numbers_as_opencv_writes(count, known):
    with nullcontext() if known else pytest.raises(DataError, match=f'got {count}'):
        assert Lens([1.0, 1.0], [0.0, 0.0], [0.1] * count).distortion.sum() == 0.1 * count
