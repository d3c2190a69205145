# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How large small errors are, learned from an arm or from equations made by hand; and what data hide."""

import warnings
from itertools import product

import numpy as np
import pytest

from weld_twin_core.diagnosis.algebra.learned_sizes import learned_precision
from weld_twin_core.diagnosis.predicting.sizes import (
    BELIEF,
    SIZES,
    Prior,
    Rows,
    _Chain,
    hidden,
    weighed,
)

pytestmark = pytest.mark.drawn

SMALL = 40
"""Coordinates of one family."""
NO = np.array([False])
"""Of the one family that there is: neither of gears nor tied."""


def arm(seed, truth, frame_width=1e3):
    """Return rows of an arm whose small errors are given, and one error that a frame hides."""
    rng = np.random.default_rng(seed)
    frame, own = rng.normal(size=(1, 300)), rng.normal(size=(SMALL, 300))
    columns = np.concatenate([frame, own, 0.7 * frame])
    residual = truth @ columns[1 : 1 + SMALL] + rng.normal(size=300)
    zero = np.zeros(SMALL + 2)
    group = np.array([-1, *[0] * SMALL, 0])
    prior = Prior(zero, np.array([frame_width, *[5.0] * (SMALL + 1)]), group, NO, NO)
    return weighed(Rows(columns, residual, 1.0), prior, 1.0)


def test_an_arm_with_next_to_no_errors_is_known_better_than_by_least_squares():
    known = arm(1, np.zeros(SMALL))
    # Least squares know each to one over the root of 300 rows.
    assert np.sqrt(np.diag(known.covariance))[1 : 1 + SMALL].mean() < 0.8 / np.sqrt(300.0)
    assert np.abs(known.mean[1:]).max() < 0.1


@pytest.mark.parametrize(
    ('frame_width', 'every', 'rest'), [(1e3, 8, 0.0), (1e5, 2, 0.02), (1e7, 2, 0.02)]
)
def test_errors_that_are_there_are_not_drawn_back(frame_width, every, rest):
    """Whatever the frames' information is, beside which that of an error is rounding."""
    truth = np.where(np.arange(SMALL) % every == 0, 4.0, rest)
    known = arm(2, truth, frame_width)
    off = (known.mean[1 : 1 + SMALL] - truth) / np.sqrt(np.diag(known.covariance))[1 : 1 + SMALL]
    assert np.abs(off).max() < 4.0 and np.sqrt((off**2).mean()) < 1.3


def test_what_a_frame_hides_is_as_wide_as_the_family_has_it():
    sound, rough = (arm(3, truth) for truth in (np.zeros(SMALL), np.full(SMALL, 4.0)))
    hidden = [float(np.sqrt(each.covariance[-1, -1])) for each in (sound, rough)]
    # A third of the usual 5 from an arm without errors: four of its kind are believed beside forty seen.
    assert 0.5 < hidden[0] < 2.5 < hidden[1] < 8.0
    # Together with the frame it is known, for that is what was measured.
    both = np.array([1.0, 0.7])
    pair = rough.covariance[np.ix_([0, -1], [0, -1])]
    assert np.sqrt(both @ pair @ both) < 0.2


def test_what_places_that_nobody_measured_take_up_is_hidden():
    """A first zero turns all places with it; what is left of it in the data is rounding."""
    rng = np.random.default_rng(4)
    columns = np.stack([1e-14 * rng.normal(size=300), rng.normal(size=300)])
    rows = Rows(columns, np.zeros(300), 1.0, np.array([20.0, 20.0]))
    assert hidden(rows, np.zeros(2, dtype=bool)).tolist() == [True, False]


def test_of_two_errors_that_move_the_tool_alike_the_wrong_one_is_not_told_for_sure():
    """Every fifth of the pairs has one large error, and the recordings tell by a thousandth which."""
    off = []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        alike = np.repeat(rng.normal(size=(SMALL // 2, 300)), 2, axis=0)
        own = np.sqrt(0.999) * alike + np.sqrt(0.001) * rng.normal(size=(SMALL, 300))
        truth = np.where(np.arange(SMALL) % 10 == 0, 1.0, 0.0)
        columns = np.concatenate([rng.normal(size=(1, 300)), own])
        width = np.array([1e3, *[5.0] * SMALL])
        prior = Prior(np.zeros(SMALL + 1), width, np.array([-1, *[0] * SMALL]), NO, NO)
        rows = Rows(columns, truth @ own + rng.normal(size=300), 1.0)
        known = weighed(rows, prior, 1.0)
        off.append((known.mean[1:] - truth) / np.sqrt(np.diag(known.covariance))[1:])
    assert np.sqrt(np.mean(np.square(off))) < 1.5 and np.abs(off).max() < 5.0


def test_sizes_are_drawn_as_often_as_the_normal_law_of_the_rows_says():
    """Of a family with one size for two errors and an error that looks like one of them."""
    rng = np.random.default_rng(5)
    frame, one, other, more = rng.normal(size=(4, 12))
    columns = np.stack([frame, one, other, one + 0.5 * more])
    residual = 10.0 * one + rng.normal(size=12)
    middle, width = np.array([0.0, 0.5, -1.0, 1.0]), np.array([50.0, 1.0, 2.0, 3.0])
    prior = Prior(middle, width, np.array([-1, 0, 0, 1]), NO.repeat(2), np.array([True, False]))
    noise, share = 30.0, 0.8
    chain = _Chain(Rows(columns, residual, share), prior, noise)
    often = np.zeros((2, SIZES.size))
    for _ in range(2000):
        chain._sizes()
        for k, size in enumerate(chain.size[[1, 3]]):
            often[k, np.searchsorted(SIZES, size)] += 1.0 / 2000.0
    assert chain.size[1] == chain.size[2]
    law = np.zeros((SIZES.size, SIZES.size))
    for (i, first), (j, second) in product(enumerate(SIZES), repeat=2):
        spread = width * [1.0, first, first, second]
        covariance = (columns.T * spread**2) @ columns + noise / share * np.eye(12)
        off = residual - middle @ columns
        likely = off @ np.linalg.solve(covariance, off) + np.linalg.slogdet(covariance)[1]
        law[i, j] = np.exp(-likely / 2.0) * BELIEF[i] * BELIEF[j]
    law /= law.sum()
    np.testing.assert_allclose(often, [law.sum(axis=1), law.sum(axis=0)], atol=0.03)


ROWS = 400


def equations(seed=3, members=12):
    """Return normal equations of errors drawn with a known spread, under noise of one."""
    rng = np.random.default_rng(seed)
    columns = rng.normal(size=(members, ROWS))
    residual = 3.0 * rng.normal(size=members) @ columns + rng.normal(size=ROWS)
    return columns @ columns.T, columns @ residual, float(residual @ residual), ROWS


@pytest.mark.parametrize(
    ('labels', 'scale', 'believed'),
    [
        (np.zeros(12, int), 0.5, np.zeros(12)),
        (np.repeat([0, -1], 6), 0.5, np.zeros(12)),
        (np.zeros(12, int), 1.0, np.repeat([100.0, 0.0], 6)),  # known in part: bounded by nothing
    ],
)
def test_errors_of_which_nothing_is_known_are_learned_from_the_data_alone(labels, scale, believed):
    """An effect of a user's own has no entry in the table: its precision is zero."""
    scales = np.full(12, scale)
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        found, freedom = learned_precision(*equations(), labels, scales, believed)
    alone, same = learned_precision(*equations(), labels, scales)
    np.testing.assert_array_equal(found, alone)
    assert freedom == same


@pytest.mark.parametrize(('height', 'low', 'high'), [(0.0, 0.0, 0.25), (2.0, 1.0, 3.0)])
def test_heights_along_a_curve_have_one_size_and_leave_a_slope_beside_them_as_sure_as_it_is(
    height, low, high
):
    """Seven rows know a height to 0.4; forty of them know how high they are to the fourth root less."""
    off, sure = [], []
    place = np.linspace(0.0, 1.0, 300)
    hats = np.maximum(0.0, 1.0 - np.abs(SMALL * place - np.arange(SMALL + 1)[:, None]))
    for seed in range(6):
        rng = np.random.default_rng(seed)
        columns = np.concatenate([rng.normal(size=(1, 300)), 5.0 * (place - 0.5)[None], hats])
        residual = height * rng.normal(size=SMALL + 1) @ hats + rng.normal(size=300)
        group = np.array([-1, 0, *[1] * (SMALL + 1)])
        width = np.array([1e3, *[1.0] * (SMALL + 2)])
        gears, tied = np.array([False, True]), np.array([False, True])
        prior = Prior(np.zeros(SMALL + 3), width, group, gears, tied)
        known = weighed(Rows(columns, residual, 1.0), prior, 1.0)
        assert np.ptp(known.open[2:]) == 0.0 and low <= known.open[2] <= high
        sure.append(np.sqrt(known.covariance[1, 1]))
        off.append(known.mean[1] / sure[-1])
    assert np.sqrt(np.mean(np.square(off))) < 1.5
    # Of an even gear's slope as much is known as without a curve: 300 rows, 5 / sqrt(12) each.
    assert height or max(sure) < 1.1 / (np.sqrt(300.0 / 12.0) * 5.0)
