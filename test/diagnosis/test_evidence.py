# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a fall of the sum of squares is worth, and how many rows of a residual count."""

from itertools import accumulate

import numpy as np
import pytest
from diagnosis_cells import effect
from scipy.stats import cauchy, norm

import weld_twin_core as wt
from weld_twin_core.diagnosis.algebra.fit import Fit
from weld_twin_core.diagnosis.algebra.independent_rows import effective_share, visited
from weld_twin_core.diagnosis.algebra.problem import Model
from weld_twin_core.diagnosis.algebra.workspace import SeedSystems, Unit, evidence, ranking
from weld_twin_core.diagnosis.result import Site


def wandering(rho, samples, components, seed=0):
    """Return a stationary first-order autoregression, shape (samples, components)."""
    rng = np.random.default_rng(seed)
    push = rng.normal(size=(samples, components))
    push[0] /= np.sqrt(1.0 - rho**2)
    return np.array(list(accumulate(push, lambda last, new: rho * last + new)))


@pytest.mark.parametrize('rho', [0.0, 0.3, 0.6, 0.9])
def test_the_share_of_independent_rows_is_that_of_an_autoregression(rho):
    residual = wandering(rho, 60000, 3).ravel()
    share = effective_share(residual, (3,), (60000,))
    assert share == pytest.approx((1.0 - rho) / (1.0 + rho), rel=0.08 if rho else 0.05)
    assert share <= 1.0


def test_rows_never_count_more_than_they_are_and_recordings_by_theirs():
    assert effective_share(wandering(-0.7, 5000, 3).ravel(), (3,), (5000,)) <= 1.0
    long, short = wandering(0.6, 40000, 3).ravel(), wandering(0.0, 20000, 3, seed=1).ravel()
    share = effective_share(np.concatenate([long, short]), (3, 3), (40000, 20000))
    assert share == pytest.approx((2.0 * 0.25 + 1.0) / 3.0, rel=0.08)


def test_evidence_is_the_ratio_of_likelihoods_less_half_a_log_per_parameter():
    rng = np.random.default_rng(4)
    columns = rng.normal(size=(2, 50))
    y = np.array([0.5, -0.3]) @ columns + rng.normal(size=50)
    left = y - np.linalg.lstsq(columns.T, y, rcond=None)[0] @ columns

    def most_likely(residual):
        return norm.logpdf(residual, scale=np.sqrt(np.mean(residual**2))).sum()

    expected = most_likely(left) - most_likely(y) - 0.5 * 2.0 * np.log(50.0)
    assert evidence(y @ y, y @ y - left @ left, 2.0, 50.0) == pytest.approx(expected)


def test_a_size_counts_as_often_as_machines_have_it():
    robot = wt.load('ur5')
    large = wt.effects.JointOffset('elbow_joint', offset=0.02)  # four times the usual 5 mrad
    small = wt.effects.LinkLength('wrist_1_joint', da=1e-4)  # a fifth of the usual 0.5 mm
    model = Model(robot, (np.eye(4),), found=(large, small))
    expected = cauchy.logpdf([4.0, 0.2]) - cauchy.logpdf(0.0)
    assert Fit(model, np.zeros(0)).sized == pytest.approx(expected.sum())


def test_visits_of_a_station_count_as_one_as_far_as_they_agree():
    rng = np.random.default_rng(4)
    postures, order = rng.normal(size=(300, 6)), rng.permutation(np.repeat(np.arange(300), 3))
    q = postures[order] + rng.uniform(-5e-4, 5e-4, size=(900, 6))
    station = visited(q)
    assert np.unique(np.stack([station, order]), axis=1).shape == (2, 300)
    missed, noise = rng.normal(size=(300, 3))[order], rng.normal(size=(900, 3))
    for size, share in ((0.0, 1.0), (1.0, 1.0 / (1.0 + 2.0 * 0.5)), (30.0, 1.0 / 3.0)):
        residual = (size * missed + noise).ravel()
        assert effective_share(residual, (3,), (900,), (station,)) == pytest.approx(
            share, abs=0.04
        )
        assert effective_share(residual, (3,), (900,)) > 0.9


def best(columns, y, effective):
    """Return the best choice of a base that may move, its components given as columns."""
    seed = effect('base_pose', xyz=[0, 0, 0], rotvec=[0, 0, 0])
    index = np.arange(len(columns))
    unit = Unit(Site('base_pose', None), (seed,), (index,), (0.0,))
    systems = SeedSystems.of([index], [columns @ columns.T])
    systems = systems.given(np.zeros((0, 0)), np.zeros(0), y @ y, (columns @ y)[:, None])
    return ranking(systems, [unit], effective)[0]


@pytest.mark.parametrize('sizes', [(0.8, -0.5), (-0.5, 0.8)])
def test_only_the_columns_that_earn_their_place_are_chosen(sizes):
    rng = np.random.default_rng(6)
    columns = rng.normal(size=(6, 500))
    y = sizes @ columns[[2, 5]] + rng.normal(size=500)
    choice = best(columns, y, 500.0)
    assert sorted(choice.columns) == [2, 5]
    vector = choice.effect().vector()
    expected = np.linalg.lstsq(columns[[2, 5]].T, y, rcond=None)[0]
    np.testing.assert_allclose(vector, [0, 0, expected[0], 0, 0, expected[1]], rtol=1e-8)


def test_a_column_that_repeats_another_is_not_taken_twice():
    rng = np.random.default_rng(9)
    columns = rng.normal(size=(3, 600))
    columns[2] = -2.0 * columns[0]
    choice = best(columns, columns[0] + columns[1] + rng.normal(size=600), 600.0)
    assert len(choice.columns) == 2
    assert 1 in choice.columns


SEEDS = ((0, 1), (2,), (3, 4, 5), (6, 7), (8, 9, 10), (11,))
"""Columns of every seed, of units with one, two and three of them."""


def grown_by_hand(own, columns, y, index):
    """Return the columns of a seed that pay as they enter one by one, or all, and their evidence."""

    def worth(some):
        both = np.concatenate([own, columns[some]])
        left = [y - b.T @ np.linalg.lstsq(b.T, y, rcond=None)[0] for b in (own, both)]
        before, after = (r @ r for r in left)
        return evidence(before, before - after, float(len(some)), 200.0)

    some, now = [], -np.inf
    while len(some) < len(index):
        more = max(({*index} - {*some}), key=lambda k: worth([*some, k]))
        if worth([*some, more]) <= now:
            break
        some, now = [*some, more], worth([*some, more])
    return max((now, sorted(some)), (worth(list(index)), list(index)))


def test_every_unit_has_the_seed_and_the_columns_that_least_squares_choose():
    rng = np.random.default_rng(11)
    own, columns = rng.normal(size=(3, 200)), rng.normal(size=(12, 200))
    columns[5] = columns[4] + 0.05 * columns[5]
    y = [1.0, -2.0, 0.5] @ own + 6.0 * (columns[5] - columns[4]) + 0.4 * columns[7]
    y += 0.3 * columns[8] - 0.3 * columns[10] + rng.normal(size=200)
    index, surprise = [np.array(each) for each in SEEDS], (0.0, 1.9, 2.5, 3.0, 0.7, 30.0)
    ends = ((0, 1), (1, 3), (3, 6))
    units = [
        Unit(Site(str(k), None), (None,) * (b - a), tuple(index[a:b]), surprise[a:b])
        for k, (a, b) in enumerate(ends)
    ]
    systems = SeedSystems.of(index, [columns[each] @ columns[each].T for each in index])
    products = columns @ np.concatenate([own, y[None]]).T
    systems = systems.given(own @ own.T, own @ y, y @ y, products)
    by_hand = [grown_by_hand(own, columns, y, each) for each in SEEDS]
    for open_to in (None, np.arange(6) != 4):
        expected = []
        for k, (a, b) in enumerate(ends):
            seeds = [s for s in range(a, b) if open_to is None or open_to[s]]
            s = max(seeds, key=lambda s: by_hand[s][0] - surprise[s])
            worth, chosen = by_hand[s]
            expected.append((worth - surprise[s], str(k), s - a, chosen))
        expected.sort(reverse=True)
        found = ranking(systems, units, 200.0, open_to=open_to)
        assert [(c.unit.site.effect, c.seed, sorted(c.columns)) for c in found] == [
            each[1:] for each in expected
        ]
        np.testing.assert_allclose(
            [c.log_bayes for c in found], [each[0] for each in expected], atol=1e-6
        )
        least = found[1].log_bayes
        assert len(ranking(systems, units, 200.0, least, open_to=open_to)) == 1
