# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Columns and their equations: amounts, inverses and projections against matrices written out."""

import numpy as np
import pytest
from scipy.linalg import LinAlgError

from weld_twin_core.diagnosis.algebra.columns import Columns, MovedJoint, Piece, moved_joint
from weld_twin_core.diagnosis.algebra.definite import (
    inverted,
    outside,
    share_outside,
    solved,
    span_of,
    unit_diagonal,
    well_conditioned,
)

ROWS = np.repeat([6, 3], [5, 4])
"""Five poses of one recording and four points of another."""


@pytest.fixture
def columns():
    rng = np.random.default_rng(3)
    joint = MovedJoint(rng.normal(size=ROWS.sum()), np.cumsum(ROWS) - ROWS)
    return Piece(rng.normal(size=(4, ROWS.size)), joint)


def written(columns):
    """Return the columns by a loop over samples."""
    ends = np.cumsum(ROWS)
    spans = [slice(e - r, e) for e, r in zip(ends, ROWS, strict=True)]
    out = [
        np.concatenate([s * columns.joint.row[k] for s, k in zip(each, spans, strict=True)])
        for each in columns.each
    ]
    return np.array(out)


def test_amounts_are_the_joints_column_times_what_each_sample_moves(columns):
    np.testing.assert_allclose(columns.written_out(), written(columns), rtol=1e-15)


def test_pieces_of_one_joint_are_joined_and_keep_their_order(columns):
    other = Piece(np.ones((2, ROWS.sum())))
    pieces = [Piece(columns.each[:1], columns.joint), Piece(columns.each[1:], columns.joint)]
    joined = Columns.joined([*pieces, other, columns]).pieces
    assert [piece.count for piece in joined] == [4, 2, 4]
    np.testing.assert_array_equal(joined[0].written_out(), columns.written_out())


def test_only_what_moves_one_joint_and_nothing_else_is_kept_as_amounts():
    one = [{('q', 2): np.ones(3)}, {('q', 2): np.zeros(3)}]
    assert moved_joint([one, one]) == 2
    assert moved_joint([one, [{('q', 1): np.ones(3)}]]) is None
    assert moved_joint([[{('tau', 2): np.ones(3)}]]) is None
    assert moved_joint([[]]) is None


@pytest.fixture
def mixed(columns):
    """Return columns of a design: three written out, four of one joint, four of another."""
    rng = np.random.default_rng(8)
    other = MovedJoint(rng.normal(size=ROWS.sum()), columns.joint.first)
    wide = Piece(rng.normal(size=(3, ROWS.sum())))
    return Columns((wide, columns, Piece(rng.normal(size=(4, ROWS.size)), other)))


@pytest.mark.parametrize('samples', [range(9), range(2, 6), [0, 3, 4, 8]])
@pytest.mark.parametrize('index', [range(11), [1, 3, 4, 10], [5, 6], []])
def test_a_design_in_pieces_has_the_products_of_its_columns_written_out(mixed, index, samples):
    rng, index = np.random.default_rng(4), np.array(index, int)
    rows = np.flatnonzero(np.isin(np.repeat(np.arange(ROWS.size), ROWS), samples))
    plain = mixed.written_out()[index][:, rows]
    if samples == range(2, 6):
        rows = slice(rows[0], rows[-1] + 1)
    found = mixed.chosen(index).within(rows)
    other, weights = rng.normal(size=(2, plain.shape[1])), rng.normal(size=(5, index.size))
    np.testing.assert_allclose(found.written_out(), plain, rtol=1e-15)
    np.testing.assert_allclose(found.normal(), plain @ plain.T, atol=1e-13)
    np.testing.assert_allclose(found.products(other), plain @ other.T, atol=1e-13)
    np.testing.assert_allclose(found.times(other[0]), plain @ other[0], atol=1e-13)
    np.testing.assert_allclose(found.mixed(weights), weights @ plain, atol=1e-13)
    np.testing.assert_allclose(found.peaks(), np.abs(plain).max(axis=1), rtol=1e-14)


def definite(count, least=0.1):
    """Return a matrix with eigenvalues from ``least`` to one, and its inverse."""
    turn, _ = np.linalg.qr(np.random.default_rng(count).normal(size=(count, count)))
    values = np.geomspace(least, 1.0, count)
    return (turn * values) @ turn.T, (turn / values) @ turn.T


@pytest.mark.parametrize('count', [1, 5, 64, 65, 130])
def test_an_inverse_is_whole_and_a_solution_comes_with_its_variances(count):
    matrix, expected = definite(count)
    right = np.arange(count, dtype=float)
    solution, spread = solved(matrix.copy(), right)
    np.testing.assert_allclose(inverted(matrix.copy()), expected, atol=1e-12)
    np.testing.assert_allclose(solution, expected @ right, atol=1e-9)
    np.testing.assert_allclose(spread, np.diag(expected), rtol=1e-12)


def test_what_is_not_definite_is_refused_and_what_is_nearly_not_is_told():
    matrix, _ = definite(20)
    assert well_conditioned(matrix, 1e-12)
    assert not well_conditioned(definite(20, least=1e-13)[0], 1e-12)
    matrix[3, 3] = -1.0
    assert not well_conditioned(matrix, 1e-12)
    with pytest.raises(LinAlgError):
        solved(matrix.copy(), np.ones(20))
    with pytest.raises(LinAlgError):
        inverted(matrix)


def test_a_span_knows_neither_the_size_of_columns_nor_their_copies():
    one, other = np.random.default_rng(3).normal(size=(2, 9))
    columns = np.array([1e-9 * one, 0.0 * one, 1e6 * (other + one), one - 1e-14 * other])
    span = span_of(columns)
    assert span.shape == (2, 9)
    np.testing.assert_allclose(span @ span.T, np.eye(2), atol=1e-12)
    for column in (one, other):
        np.testing.assert_allclose(column @ span.T @ span, column, atol=1e-9)
    assert span_of(0.0 * columns).shape == span_of(columns[:0]).shape == (0, 9)


COUNT, SAMPLES = 7, 60


@pytest.fixture
def system():
    """Columns of very different size, as radians and metres are, and a right-hand side."""
    rng = np.random.default_rng(3)
    columns = rng.normal(size=(COUNT, SAMPLES)) * np.logspace(-3, 3, COUNT)[:, None]
    return columns, rng.normal(size=SAMPLES)


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
