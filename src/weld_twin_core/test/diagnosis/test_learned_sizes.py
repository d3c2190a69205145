# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Usual sizes of many small errors, learned from normal equations made by hand."""

import warnings

import numpy as np
import pytest

from weld_twin_core.diagnosis.algebra.learned_sizes import learned_precision

ROWS = 400
SPREAD = 3.0
"""In typical sizes."""


def equations(seed=3, members=12):
    """Return normal equations of errors drawn with a known spread, under noise of one."""
    rng = np.random.default_rng(seed)
    columns = rng.normal(size=(members, ROWS))
    residual = SPREAD * rng.normal(size=members) @ columns + rng.normal(size=ROWS)
    return columns @ columns.T, columns @ residual, float(residual @ residual), ROWS


def test_the_spread_of_a_group_is_learned():
    labels, scales = np.zeros(12, int), np.ones(12)
    precision, freedom = learned_precision(*equations(), labels, scales)
    assert precision[0] ** -0.5 == pytest.approx(SPREAD, rel=0.35)
    assert freedom == pytest.approx(12.0, abs=0.1)


def test_machines_at_large_bound_the_spread():
    labels, scales = np.zeros(12, int), np.ones(12)
    believed = np.full(12, 0.5**-2.0)
    precision, _ = learned_precision(*equations(), labels, scales, believed)
    alone, _ = learned_precision(*equations(), labels, scales)
    assert precision[0] > 10.0 * alone[0]


@pytest.mark.parametrize('labels', [np.zeros(12, int), np.repeat([0, -1], 6)])
def test_errors_that_nothing_is_known_of_are_learned_from_the_data_alone(labels):
    """An effect of a user's own has no entry in the table: its precision is zero."""
    scales = np.full(12, 0.5)
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        found, freedom = learned_precision(*equations(), labels, scales, np.zeros(12))
    alone, same = learned_precision(*equations(), labels, scales)
    np.testing.assert_array_equal(found, alone)
    assert freedom == same


def test_a_group_partly_known_is_bounded_by_nothing():
    labels, scales = np.zeros(12, int), np.ones(12)
    believed = np.repeat([100.0, 0.0], 6)
    found, _ = learned_precision(*equations(), labels, scales, believed)
    alone, _ = learned_precision(*equations(), labels, scales)
    np.testing.assert_array_equal(found, alone)
