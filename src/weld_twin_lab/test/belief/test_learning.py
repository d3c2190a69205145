# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Weights are learned from cases made up with a law that is known."""

import numpy as np
import pytest
from scipy.stats import binom

from weld_twin_core.diagnosis.calibration.features import odds
from weld_twin_core.diagnosis.calibration.weights import calibration_from
from weld_twin_core.errors import DataError
from weld_twin_lab.belief import learning
from weld_twin_lab.belief.judged import Example
from weld_twin_lab.belief.learning import (
    TERMS,
    bounded,
    count_of,
    fitted,
    learned,
    precise,
    restated,
    upper_limit,
)
from weld_twin_lab.belief.trial import SHARES, mixed


@pytest.fixture(autouse=True)
def one_way(monkeypatch):
    """Part cases in one way, not four: a quarter of the time."""
    monkeypatch.setattr(learning, 'PARTITIONS', 1)


def logistic(x):
    return 1.0 / (1.0 + np.exp(-x))


def examples(count, seed, slope=2.0, kinds=tuple(TERMS)):
    """Return statements that are right by a law in one feature alone, which not all have."""
    out = []
    for kind in kinds:
        # What one kind is learned from leaves the draws of the others as they are.
        rng = np.random.default_rng([seed, *kind.encode()])
        first = next(iter(TERMS[kind]))
        way = TERMS[kind][first] or 1
        for k, x in enumerate(rng.standard_normal(count)):
            right = bool(rng.random() < logistic(1.0 + slope * x))
            features = {name: float(rng.standard_normal()) for name in TERMS[kind]}
            out.append(Example(f'{seed}/{k}', kind, {**features, first: way * x}, right, 0.5))
    return out


def test_weights_come_back_from_many_cases():
    rng = np.random.default_rng(1)
    columns = rng.standard_normal((4000, 2))
    right = rng.random(4000) < logistic(0.5 + columns @ [1.5, -0.7])
    weights = fitted(columns, right, np.zeros(2), 1.0, np.ones(4000))
    assert weights.bias == pytest.approx(0.5, abs=0.1)
    assert weights.slopes == pytest.approx([1.5, -0.7], abs=0.15)


def test_no_weight_gets_the_wrong_sign():
    rng = np.random.default_rng(2)
    columns = rng.standard_normal((300, 2))
    right = rng.random(300) < logistic(-2.0 * columns[:, 0])
    weights = fitted(columns, right, np.array([1.0, 0.0]), 1.0, np.ones(300))
    assert weights.slopes[0] == 0.0


def test_what_is_learned_is_as_often_right_as_it_says_and_sure_as_seldom_wrong():
    asked = ('answer, named',)
    others = [kind for kind in TERMS if kind not in asked]
    rows = examples(3000, 3, slope=4.0, kinds=asked) + examples(600, 3, slope=4.0, kinds=others)
    content = learned(rows, {'seeds': [3]}, risk=0.01)
    told = calibration_from(content)
    # What is sure is bounded over all kinds of answers, as often as each comes.
    rest = [kind for kind in others if kind.startswith('answer')]
    fresh = examples(3000, 4, slope=4.0, kinds=asked) + examples(600, 4, slope=4.0, kinds=rest)
    p = np.array([told.probability(e.kind, e.features) for e in fresh])
    right = np.array([e.right for e in fresh])
    for low in (0.1, 0.3, 0.5, 0.7, 0.9):
        here = (p >= low) & (p < low + 0.1)
        assert p[here].mean() == pytest.approx(right[here].mean(), abs=0.12)
    sure = np.array([told.sure('answer', one) for one in p])
    assert sure.mean() > 0.1
    assert (sure & ~right).mean() <= 0.015
    assert count_of(content) <= 200
    assert content['card']['seeds'] == [3]


def test_a_family_named_alone_counts_where_it_was_seen_often_and_others_do_not():
    rng = np.random.default_rng(5)
    rows = examples(400, 6)
    for k in range(600):
        alone = 'only backlash' if k % 2 else 'only drift'
        base = dict.fromkeys(TERMS['name'], 0.0)
        right = bool(rng.random() < (0.3 if k % 2 else 0.95))
        rows.append(Example(f'7/{k}', 'name', {**base, alone: 1.0}, right, 0.5))
    rows.append(Example('7/0', 'name', {'only wear': 1.0}, True, 0.5))
    weights = learned(rows, {})['statements']['name']['weights']
    assert weights['only backlash']['weight'] < -1.0 < 0.0 < weights['only drift']['weight']
    assert 'only wear' not in weights


def test_a_set_of_many_names_is_believed_more_where_it_was_right_more_often():
    rng = np.random.default_rng(8)
    others = tuple(kind for kind in TERMS if kind != 'name of many')
    rows = examples(200, 8, kinds=others)
    for k in range(400):
        members = float(rng.integers(1, 6))
        right = bool(rng.random() < logistic(members - 2.0))
        features = {**dict.fromkeys(TERMS['name of many'], 0.0), 'members': members}
        rows.append(Example(f'8/{k}', 'name of many', features, right, 0.5))
    told = calibration_from(learned(rows, {}))
    one, many = (told.probability('name of many', {'members': m}) for m in (1.0, 4.0))
    assert one < 0.4 < 0.8 < many


def test_a_weight_that_is_left_out_leaves_its_feature_as_usual():
    kind, far = 'name of many', 'rows'
    others = tuple(name for name in TERMS if name != kind)
    rows = examples(200, 12, kinds=others)
    for k, e in enumerate(examples(4000, 13, slope=0.0, kinds=(kind,))):
        # It hardly moves, says nothing but by chance, and lies far from zero.
        features = {**e.features, far: 40.0 + 1e-3 * (k % 9)}
        rows.append(e._replace(features=features))
    content = learned(rows, {})
    assert far not in content['statements'][kind]['weights']
    told = calibration_from(content)
    own = [e for e in rows if e.kind == kind]
    p = np.array([told.probability(kind, e.features) for e in own])
    assert p.mean() == pytest.approx(np.mean([e.right for e in own]), abs=0.03)


def test_an_answer_is_learned_from_its_name_as_new_weights_report_it():
    rows = examples(400, 9, slope=4.0, kinds=('name',))
    others = tuple(kind for kind in TERMS if kind not in ('name', 'answer, named'))
    rows += examples(400, 10, kinds=others)
    name = {e.case: e for e in rows if e.kind == 'name'}

    def answer(case, reported, told=1):
        own = {'names': float(np.log(reported)), 'least name': odds(reported), 'told': told}
        features = {**dict.fromkeys(TERMS['answer, named'], 0.0), **own}
        return Example(case, 'answer, named', features, name[case].right, reported)

    # The weights of its time had no more to say of a name than 0.5, whatever the evidence.
    rows += [answer(case, 0.5) for case in name]
    now = [e for e in restated(rows) if e.kind == 'answer, named']
    p = np.exp([e.features['names'] for e in now])
    right = np.array([e.right for e in now])
    assert p[right].mean() > 0.75 > 0.4 > p[~right].mean()
    assert [e.features['least name'] for e in now] == pytest.approx([odds(one) for one in p])
    # So what is learned of such answers tells them apart as the names do.
    weights = learned(rows, {})['statements']['answer, named']['weights']
    assert weights['names']['weight'] + weights['least name']['weight'] > 0.5
    # One whose names are not all that it says stays.
    for other in (answer('9/0', 0.7), answer('9/0', 0.5, told=2)):
        assert restated([*rows, other])[-1] == other


def test_what_is_sure_is_read_off_cases_of_today():
    rows = examples(200, 10, slope=4.0)
    old = [e._replace(case=f'old/{k}', right=False, weight=0.01) for k, e in enumerate(rows)]
    alone, both = (learned(own, {}, risk=0.02) for own in (rows, [*rows, *old]))
    assert alone['card']['bounds']['answer']['cases'] == 4 * 200
    assert both['card']['bounds']['answer']['cases'] == 4 * 200


def test_too_few_cases_are_told_as_sure_of_nothing():
    content = learned(examples(20, 7), {}, risk=0.002)
    assert content['sure_from']['answer'] > 1.0
    assert content['card']['bounds']['answer']['sure'] == 0.0


def test_a_kind_of_statement_without_examples_is_told_in_a_sentence():
    with pytest.raises(DataError, match='too few to learn from'):
        learned(examples(20, 7, kinds=list(TERMS)[:1]), {}, risk=0.002)


def test_of_the_sure_ones_as_few_are_wrong_as_promised():
    probability = np.linspace(0.5, 0.999, 2000)
    right = probability > 0.8
    right[1900] = False
    bound = precise(probability, right, 0.01)

    def wrong(threshold):
        sure = probability >= threshold
        return ((sure & ~right).sum() + 1) / (sure.sum() + 1)

    assert bound.wrong == (~right & (probability >= bound.sure_from)).sum() == 1
    assert wrong(bound.sure_from) <= 0.01 < wrong(bound.sure_from - 0.002)
    assert precise(probability[:3], right[:3], 0.01).sure_from > 1.0


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
