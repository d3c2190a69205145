# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Inverses and solutions in the place of a matrix, held against those by eigenvalues."""

import numpy as np
import pytest
from scipy.linalg import LinAlgError

from weld_twin_core.diagnosis.algebra.definite import inverted, solved, span_of, well_conditioned


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
