# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What some columns can do in the place of others, against least squares on the matrices."""

import numpy as np
import pytest

from weld_twin_core.diagnosis.algebra.definite import (
    outside,
    share_outside,
    span_of,
    unit_diagonal,
)

COUNT, ROWS = 7, 60


@pytest.fixture
def system():
    """Columns of very different size, as radians and metres are, and a right-hand side."""
    rng = np.random.default_rng(3)
    columns = rng.normal(size=(COUNT, ROWS)) * np.logspace(-3, 3, COUNT)[:, None]
    return columns, rng.normal(size=ROWS)


def left(columns, target):
    """Return what a least-squares fit of columns leaves of a row, by an orthogonal method."""
    return target - columns.T @ np.linalg.lstsq(columns.T, target, rcond=None)[0]


def test_what_lies_outside_is_what_least_squares_leaves(system):
    columns, y = system
    span = span_of(columns[[1, 4]])
    np.testing.assert_allclose(outside(y, span), left(columns[[1, 4]], y), rtol=1e-8)
    rest = columns[[0, 2, 3, 5, 6]]
    expected = np.array([left(columns[[1, 4]], row) for row in rest])
    size = np.linalg.norm(rest, axis=1)[:, None]
    np.testing.assert_allclose(outside(rest, span) / size, expected / size, atol=1e-10)
    share = np.linalg.norm(expected, axis=1) / size[:, 0]
    np.testing.assert_allclose(share_outside(rest, span), share, rtol=1e-8)


def test_fitting_after_a_projection_is_fitting_all_at_once(system):
    columns, y = system
    out, index = [1, 4], [0, 6]
    together = np.linalg.lstsq(columns[[*out, *index]].T, y, rcond=None)[0]
    span = span_of(columns[out])
    alone = np.linalg.lstsq(outside(columns[index], span).T, outside(y, span), rcond=None)[0]
    np.testing.assert_allclose(alone, together[2:], rtol=1e-7)


def test_a_column_that_others_can_do_has_no_share_outside(system):
    columns, _ = system
    mixed = 2.0 * columns[1] - 300.0 * columns[0]
    share = share_outside(np.stack([mixed, columns[3]]), span_of(columns[:2]))
    assert share[0] < 1e-12 and share[1] > 0.5


def test_equations_at_unit_scale_have_the_same_solution(system):
    columns, y = system
    scaled, size = unit_diagonal(columns @ columns.T)
    np.testing.assert_allclose(np.diag(scaled), 1.0)
    expected = np.linalg.lstsq(columns.T, y, rcond=None)[0]
    np.testing.assert_allclose(
        np.linalg.solve(scaled, columns @ y / size) / size, expected, rtol=1e-7
    )
