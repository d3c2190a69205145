# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Cubic curves and even points, against scipy's."""

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline, CubicSpline
from scipy.spatial.transform import Rotation
from scipy.stats.qmc import Halton

from weld_twin_core.arm import rotation
from weld_twin_core.arrays import halton
from weld_twin_core.cubics import hermite, natural_slopes, slopes_of_many


@pytest.fixture
def knots():
    rng = np.random.default_rng(2)
    x = np.cumsum(rng.uniform(0.1, 1.0, 9))
    return x, rng.normal(size=(9, 3)), np.append(x, rng.uniform(x[0], x[-1], 40))


def same(x, y, slopes, at, other):
    value, rate = hermite(x, y, slopes, at)
    np.testing.assert_allclose(value, other(at), atol=1e-13)
    np.testing.assert_allclose(rate, other(at, 1), atol=1e-12)


def test_pieces_with_given_slopes(knots):
    x, y, at = knots
    slopes = np.random.default_rng(3).normal(size=y.shape)
    same(x, y, slopes, at, CubicHermiteSpline(x, y, slopes, axis=0))


def test_a_natural_spline_bends_without_a_jump(knots):
    x, y, at = knots
    same(x, y, natural_slopes(x, y), at, CubicSpline(x, y, bc_type='natural'))


def test_a_spline_through_many_knots_is_the_same(knots):
    x, y, at = knots
    same(x, y, slopes_of_many(x, y), at, CubicSpline(x, y))
    same(x[:4], y[:4], slopes_of_many(x[:4], y[:4]), x[:4], CubicSpline(x[:4], y[:4]))


def test_a_natural_spline_through_two_knots_is_a_line():
    x, y = np.array([0.0, 2.0]), np.array([[1.0], [5.0]])
    np.testing.assert_allclose(natural_slopes(x, y), [[2.0], [2.0]], atol=1e-14)


def test_points_that_fill_a_box_are_those_of_halton():
    points = Halton(20, scramble=False).random(101)[1:]
    np.testing.assert_allclose(halton(20, 100), points, atol=1e-15)


@pytest.mark.parametrize('size', [1e-9, 1e-3, 0.3, 2.0, 3.14159])
def test_turns_of_every_size_are_those_of_scipy(size):
    vectors = np.random.default_rng(4).normal(size=(200, 3))
    turns = Rotation.from_rotvec(size * vectors / np.linalg.norm(vectors, axis=1)[:, None])
    matrices, quaternions = turns.as_matrix(), turns.as_quat(canonical=True)
    np.testing.assert_allclose(rotation.rotation_vector(matrices), turns.as_rotvec(), atol=2e-15)
    np.testing.assert_allclose(rotation.quaternion_from_matrix(matrices), quaternions, atol=1e-15)
    np.testing.assert_allclose(
        rotation.matrix_from_quaternion(1.005 * quaternions), matrices, atol=2e-15
    )
