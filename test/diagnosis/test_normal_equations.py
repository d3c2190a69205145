# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Normal equations against least squares on the matrices themselves."""

import numpy as np
import pytest

from weld_twin_core.diagnosis.algebra.gram import Gram

COUNT, ROWS = 7, 60


@pytest.fixture
def system():
    """Columns of very different size, as radians and metres are, and a right-hand side."""
    rng = np.random.default_rng(3)
    columns = rng.normal(size=(COUNT, ROWS)) * np.logspace(-3, 3, COUNT)[:, None]
    return columns, rng.normal(size=ROWS)


def least_squares(columns, target, ridge=None):
    """Return coefficients and residual by an orthogonal method, never by normal equations."""
    a, b = columns.T, target
    if ridge is not None:
        a = np.concatenate([a, np.diag(np.sqrt(ridge))])
        b = np.concatenate([b, np.zeros(len(ridge))])
    x = np.linalg.lstsq(a, b, rcond=None)[0]
    return x, target - columns.T @ x


def projected(columns, index):
    """Return the part of every column that some of them do not span."""
    q, _ = np.linalg.qr(columns[index].T)
    return columns - (columns @ q) @ q.T


def test_coefficients_are_those_of_least_squares(system):
    columns, y = system
    index = np.array([0, 2, 5])
    expected, _ = least_squares(columns[index], y)
    np.testing.assert_allclose(Gram.of(columns, y).solve(index), expected, rtol=1e-8)


def test_a_prior_precision_is_a_ridge_on_its_own_column(system):
    columns, y = system
    index, ridge = np.array([1, 3, 6]), np.array([1e-4, 50.0, 0.0])
    expected, _ = least_squares(columns[index], y, ridge)
    np.testing.assert_allclose(Gram.of(columns, y).solve(index, ridge), expected, rtol=1e-8)


def test_the_gain_is_the_fall_of_the_sum_of_squares(system):
    columns, y = system
    index = np.array([0, 4, 6])
    _, left = least_squares(columns[index], y)
    assert Gram.of(columns, y).gain(index) == pytest.approx(y @ y - left @ left, rel=1e-9)


def test_no_columns_gain_nothing(system):
    assert Gram.of(*system).gain(np.array([], dtype=int)) == 0.0


def test_columns_taken_out_leave_what_they_do_not_span(system):
    columns, y = system
    out, rest = np.array([1, 4]), np.array([0, 2, 3, 5, 6])
    less = Gram.of(columns, y).without(out)
    free, (_, left) = projected(columns, out), least_squares(columns[out], y)
    size = np.sqrt(np.outer((columns[rest] ** 2).sum(axis=1), (columns[rest] ** 2).sum(axis=1)))
    np.testing.assert_allclose(
        less.normal[np.ix_(rest, rest)] / size, free[rest] @ free[rest].T / size, atol=1e-10
    )
    np.testing.assert_allclose(less.right[rest], free[rest] @ y, rtol=1e-8)
    assert less.rss == pytest.approx(left @ left, rel=1e-10)
    assert not less.normal[out].any() and not less.right[out].any()


def test_fitting_after_a_projection_is_fitting_all_at_once(system):
    columns, y = system
    out, index = np.array([1, 4]), np.array([0, 6])
    together, _ = least_squares(columns[np.concatenate([out, index])], y)
    less = Gram.of(columns, y).without(out)
    np.testing.assert_allclose(less.solve(index), together[2:], rtol=1e-7)


def test_a_column_spanned_by_those_taken_out_is_no_longer_live(system):
    columns, y = system
    columns = np.concatenate([columns, [2.0 * columns[1] - 300.0 * columns[0]]])
    less = Gram.of(columns, y).without(np.array([0, 1]))
    np.testing.assert_array_equal(less.live(np.array([0, 3, COUNT])), [3])


def test_two_equal_columns_share_one_coefficient_without_failing(system):
    columns, y = system
    columns = np.concatenate([columns, columns[:1]])
    alone, _ = least_squares(columns[:1], y)
    both = Gram.of(columns, y).solve(np.array([0, COUNT]))
    np.testing.assert_allclose(both.sum(), alone[0], rtol=1e-6)
