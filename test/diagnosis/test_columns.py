# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Columns that move one joint, kept as amounts: the same as when they are written out."""

import numpy as np
import pytest

from weld_twin_core.diagnosis.algebra.columns import Columns, MovedJoint, Piece, moved_joint

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
