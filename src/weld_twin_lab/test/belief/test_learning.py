# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Belief is learned from cases made up with a law that is known."""

import numpy as np
import pytest
from scipy.stats import binom

from weld_twin_core.diagnosis.trust.model import with_products
from weld_twin_lab.belief.bound import bounded, upper_limit
from weld_twin_lab.belief.judged import Example
from weld_twin_lab.belief.learning import learned, trust_of
from weld_twin_lab.belief.logistic import fitted
from weld_twin_lab.belief.mix import SHARES, mixed


def logistic(x):
    return 1.0 / (1.0 + np.exp(-x))


def examples(count, seed, slope=2.0):
    """Return answers that are right by a law in one sign alone."""
    rng = np.random.default_rng(seed)
    margin = rng.standard_normal(count)
    right = rng.random(count) < logistic(1.0 + slope * margin)
    return [
        Example(
            f'{seed}/{k}', 'answer named', {'belief': 0.9, 'margin': m, 'left': n}, bool(r), 0.9
        )
        for k, (m, r, n) in enumerate(zip(margin, right, rng.standard_normal(count), strict=True))
    ]


def test_weights_come_back_from_many_cases():
    rng = np.random.default_rng(1)
    columns = rng.standard_normal((4000, 2))
    right = rng.random(4000) < logistic(0.5 + columns @ [1.5, -0.7])
    weights = fitted(columns, right, np.zeros(2), np.zeros(2), 1.0, np.ones(4000))
    assert weights.bias == pytest.approx(0.5, abs=0.1)
    assert weights.slopes == pytest.approx([1.5, -0.7], abs=0.15)


def test_no_weight_gets_the_wrong_sign_and_without_news_the_prior_stays():
    rng = np.random.default_rng(2)
    columns = rng.standard_normal((300, 2))
    right = rng.random(300) < logistic(-2.0 * columns[:, 0])
    weights = fitted(columns, right, np.array([1.0, 0.0]), np.array([0.0, 0.8]), 1e6, np.ones(300))
    assert weights.slopes == pytest.approx([0.0, 0.8], abs=0.01)


def test_learned_belief_is_as_often_right_as_it_says():
    trust = trust_of(examples(1500, 3))
    told = np.array([trust.levels['answer named'].probability(e.signs) for e in examples(4000, 4)])
    right = np.array([e.right for e in examples(4000, 4)])
    for low in (0.1, 0.3, 0.5, 0.7, 0.9):
        here = (told >= low) & (told < low + 0.1)
        assert told[here].mean() == pytest.approx(right[here].mean(), abs=0.08)


def test_sure_and_wrong_is_bounded_on_cases_never_seen():
    trust = trust_of(examples(1500, 5, slope=4.0))
    fresh = examples(4000, 6, slope=4.0)
    sure = [trust.sure('answer', 'named', e.signs) for e in fresh]
    wrong = [s and not e.right for s, e in zip(sure, fresh, strict=True)]
    assert np.mean(wrong) <= 0.01
    assert np.mean(sure) > 0.2


def test_too_few_cases_are_told_as_sure_of_nothing():
    content = learned(examples(60, 7), {})
    assert content['sure_from']['answer named'] > 1.0
    assert content['card']['bounds']['answer named']['sure'] == 0.0


def test_the_limit_is_where_so_few_wrong_ones_are_rare():
    limit = upper_limit(2, 300, 0.1)
    assert binom.cdf(2, 300, limit) == pytest.approx(0.1)


def test_the_threshold_is_the_lowest_that_keeps_the_risk():
    probability = np.linspace(0.5, 0.999, 1000)
    right = probability > 0.7
    bound = bounded(probability, right, 0.02)
    wrong = np.sum((probability >= bound.sure_from) & ~right)
    lower = np.sum((probability >= bound.sure_from - 0.002) & ~right)
    assert bound.wrong == wrong
    assert (wrong + 1) / 1001 <= 0.02 < (lower + 1) / 1001


def test_one_more_case_is_sure_and_wrong_as_seldom_as_promised():
    rng = np.random.default_rng(8)
    missed = []
    for _ in range(400):
        p = rng.beta(6.0, 2.0, 301)
        right = rng.random(301) < p**1.5  # worse than it says, by a law unknown to the bound
        bound = bounded(p[:-1], right[:-1], 0.05)
        missed.append(p[-1] >= bound.sure_from and not right[-1])
    assert np.mean(missed) <= 0.05 + 2.0 * np.sqrt(0.05 * 0.95 / 400)


def test_the_mix_has_its_shares():
    kinds = [lot.kind for lot in mixed(11, 88)]
    assert {kind: kinds.count(kind) for kind in SHARES} == {k: 2 * n for k, n in SHARES.items()}


def bent(count, seed):
    """Return answers that a margin up to one helps, and no more beyond; some have no margin."""
    rng = np.random.default_rng(seed)
    margin = rng.uniform(-3.0, 5.0, count)
    right = rng.random(count) < logistic(3.0 * np.minimum(margin, 1.0))
    known = rng.random(count) < 0.8
    return [
        Example(
            f'{seed}/{k}',
            'answer named',
            {'belief': 0.9, **({'margin': m} if has else {})},
            bool(r),
            0.9,
        )
        for k, (m, r, has) in enumerate(zip(margin, right, known, strict=True))
    ]


def test_belief_bends_where_a_sign_stops_to_tell():
    level = trust_of(bent(1000, 9)).levels['answer named']
    told = [level.probability({'belief': 0.9, 'margin': m}) for m in (-2.0, 2.0, 4.9)]
    assert told[0] < 0.1
    assert told[1] > 0.9
    assert abs(told[2] - told[1]) < 0.04


def test_a_sign_that_some_examples_lack_counts_as_usual_there():
    level = trust_of(bent(1000, 10)).levels['answer named']
    right = np.mean([e.right for e in bent(4000, 11) if 'margin' not in e.signs])
    assert level.probability({'belief': 0.9}) == pytest.approx(right, abs=0.12)


def seldom(count, seed):
    """Return answers of families that depend on direction, which are wrong; one is seldom seen."""
    rng = np.random.default_rng(seed)
    rows = []
    for k in range(count):
        name = ('backlash', 'friction', 'joint_offset', 'link_length')[int(rng.integers(4))]
        odds = 0.0 if name in ('backlash', 'friction') else 3.0
        signs = {'belief': 0.9, f'named_{name}': 1.0}
        rows.append(
            Example(f'{seed}/{k}', 'answer named', signs, rng.random() < logistic(odds), 0.9)
        )
    return rows


def test_a_family_never_seen_is_believed_like_its_kind():
    level = trust_of(seldom(1500, 12)).levels['answer named']
    told = {
        name: level.probability(with_products({'belief': 0.9, f'named_{name}': 1.0}))
        for name in ('friction', 'hysteresis', 'link_twist')
    }
    assert told['hysteresis'] < 0.8 < told['link_twist']
    assert told['friction'] == pytest.approx(0.5, abs=0.1)


def test_a_name_that_does_not_always_come_back_is_not_sure():
    trust = trust_of(examples(1500, 13))
    signs = {'belief': 0.9, 'margin': 6.0, 'left': 0.0}
    assert trust.learned('answer', 'named', signs) > 0.9
    assert trust.sure('answer', 'named', signs)
    assert not trust.sure('answer', 'named', {**signs, 'own_back': 0.97})
