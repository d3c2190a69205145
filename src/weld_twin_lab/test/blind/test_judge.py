# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Verdicts held against truths, and measures of many, by hand, or against scipy."""

import numpy as np
import pytest
from blind_verdicts import diagnosis, offset, truth
from scipy.stats import binomtest

from weld_twin_lab.blind.scoring import (
    bootstrap,
    brier,
    calibration_error,
    calibration_error_by_chance,
    judge,
    measures,
    page,
    share,
)

A, B, C = ('joint_offset', 'a'), ('joint_offset', 'b'), ('gear_ratio', 'a')
BASE = ('base_pose', None)
ONE, TWO = truth('single', [offset('a')]), truth('double', [offset('a'), offset('b')])
NOTHING = truth('none')


@pytest.mark.parametrize(
    ('case', 'verdict', 'named', 'right'),
    [
        (ONE, diagnosis('identified', [A]), True, True),
        (ONE, diagnosis('ambiguous', [A, C]), True, True),
        (ONE, diagnosis('identified', [A], [C]), True, False),
        (ONE, diagnosis('identified', [C]), False, False),
        (ONE, diagnosis('unknown', [A]), True, False),
        (ONE, diagnosis('none'), False, False),
        (ONE, None, False, False),
        (TWO, diagnosis('identified', [A], [B]), True, True),
        (TWO, diagnosis('identified', [B, C], [A, B]), True, True),
        (TWO, diagnosis('identified', [A]), False, False),
        (TWO, diagnosis('ambiguous', [A, B]), False, False),
        (TWO, diagnosis('identified', [A, B], [C]), False, False),
        (NOTHING, diagnosis('none'), False, True),
        (NOTHING, diagnosis('identified', [A]), False, False),
        (truth('outside', [offset('a')]), diagnosis('unknown', [C]), False, True),
        (truth('withheld', [offset('a')]), diagnosis('ambiguous', [C]), False, False),
    ],
)
def test_a_verdict_is_worth_what_it_says_of_the_causes(case, verdict, named, right):
    judged = judge(case, verdict)
    assert (judged.named, judged.right) == (named, right)


def test_the_like_of_an_ambiguous_construction_is_as_good_as_the_truth():
    case = truth('ambiguous', [offset('a')], alike=[[list(BASE)]])
    assert judge(case, diagnosis('identified', [BASE])).right
    assert not judge(case, diagnosis('identified', [C])).right


def test_seven_equal_lags_are_as_good_as_one_late_clock():
    lags = [{'effect': 'servo_lag', 'joint': f'j{k}', 'time_constant': 0.01} for k in range(7)]
    case = truth('ambiguous', lags, alike=[[['time_delay', None]]], ratios=[4.0])
    assert judge(case, diagnosis('identified', [('time_delay', None)])).right
    all_seven = [[('servo_lag', f'j{k}')] for k in range(7)]
    assert judge(case, diagnosis('identified', *all_seven)).right
    assert not judge(case, diagnosis('identified', [('servo_lag', 'j0')])).right


@pytest.mark.parametrize(
    ('status', 'groups', 'confidence', 'wrong'),
    [
        ('identified', [[C]], 0.81, True),
        ('identified', [[C]], 0.8, False),
        ('none', [], 0.97, True),
        ('unknown', [], 0.9, False),
        ('identified', [[A]], 0.99, False),
    ],
)
def test_a_verdict_is_sure_and_wrong_only_when_it_claims_something(
    status, groups, confidence, wrong
):
    verdict = diagnosis(status, *groups, confidence=confidence)
    assert judge(ONE, verdict).confidently_wrong is wrong


def test_the_stratum_is_that_of_the_weakest_cause():
    case = truth('double', [offset('a'), offset('b')], ratios=[7.0, 0.4])
    assert judge(case, diagnosis('identified', [A])).stratum == 0.4


def single(verdict, ratio=5.0):
    return judge(truth('single', [offset('a')], ratios=[ratio]), verdict)


def double(verdict, ratios=(5.0, 5.0)):
    return judge(truth('double', [offset('a'), offset('b')], ratios=list(ratios)), verdict)


CASES = [
    single(diagnosis('identified', [A])),
    single(diagnosis('identified', [C])),
    single(diagnosis('ambiguous', [A, C])),
    single(diagnosis('identified', [B])),
    single(diagnosis('identified', [A]), 2.0),
    single(diagnosis('none', confidence=0.5), 1.0),
    single(diagnosis('none'), 0.5),
    single(diagnosis('unknown'), 20.0),
    double(diagnosis('identified', [A], [B])),
    double(diagnosis('identified', [A])),
    double(diagnosis('identified', [A], [B]), (5.0, 2.9)),
    judge(truth('none'), diagnosis('none')),
    judge(truth('none'), diagnosis('identified', [A])),
    judge(truth('outside', [offset('a')]), diagnosis('unknown')),
    judge(truth('withheld', [offset('a')]), diagnosis('ambiguous', [B, C])),
    judge(truth('withheld', [offset('a')]), diagnosis('identified', [B])),
]


@pytest.mark.parametrize(
    ('key', 'value', 'count'),
    [
        ('single', 3 / 8, 8),
        ('double', 2 / 3, 3),
        ('triple', None, 0),
        ('none', 1 / 2, 2),
        ('withheld', 0.0, 2),
        ('outside', 1.0, 1),
        ('confident_wrong', 7 / 16, 16),
    ],
)
def test_measures_are_the_counts_made_by_hand(key, value, count):
    measure = next(m for m in measures(CASES) if m.key == key)
    assert measure.estimate.cases == count
    assert measure.estimate.value == (None if value is None else pytest.approx(value))


def test_a_goal_is_reached_from_the_right_side():
    reached = {m.key: m.reached for m in measures(CASES)}
    assert reached['confident_wrong'] is False
    assert reached['single'] is None
    assert {m.key: m.reached for m in measures(CASES[:1])}['confident_wrong'] is True


def test_calibration_leaves_out_cases_without_a_verdict():
    found = {m.key: m.estimate for m in measures([*CASES[:2], single(None)])}
    assert found['ece'].value == pytest.approx(abs(0.9 - 0.5))


def test_the_page_names_every_failure_and_why_there_is_no_verdict():
    made = {'seed': 1, 'seal': 'a' * 64, 'engine': 'b' * 64, 'version': '0'}
    made |= {'with_holdout': True, 'truths_readable': False}
    spent = ('median_seconds', 'most_seconds', 'median_memory_mib', 'most_memory_mib')
    costs = dict.fromkeys(spent, 2.0)
    score = {
        'made': made,
        'count': len(CASES),
        'measures': [measure.as_dict() for measure in measures(CASES)],
        'costs': costs,
        'errors': {'case_0001': 'no joint moves'},
        'cases': [case.as_dict() for case in CASES],
    }
    failed = [line for line in page(score).splitlines() if line.startswith('| case_')]
    assert len(failed) == sum(not case.right for case in CASES)
    assert any('no joint moves' in line for line in failed)


@pytest.mark.parametrize(('hits', 'count'), [(0, 7), (1, 1), (3, 10), (399, 400), (40, 40)])
def test_a_share_has_the_wilson_interval_of_scipy(hits, count):
    value, low, high, n = share([True] * hits + [False] * (count - hits))
    reference = binomtest(hits, count).proportion_ci(0.95, method='wilson')
    assert n == count
    np.testing.assert_allclose([value, low, high], [hits / count, *reference], atol=1e-12)


def test_no_case_has_no_share():
    assert share([]) == (None, None, None, 0)
    assert bootstrap([]) == (None, None, None, 0)


def test_a_bootstrap_interval_has_the_width_of_theory():
    values = np.random.default_rng(1).standard_normal(400)
    value, low, high, _ = bootstrap(values, np.mean)
    assert value == pytest.approx(values.mean())
    assert high - low == pytest.approx(2 * 1.96 * values.std() / 20.0, rel=0.08)


def test_brier_score_and_calibration_error_by_hand():
    assert brier([0.9, 0.6], [True, False]).value == pytest.approx((0.01 + 0.36) / 2)
    # 0.9-1.0: two cases of mean confidence 0.95, half right; 0.5-0.6: one case, right.
    error = calibration_error([0.95, 0.95, 0.5], [True, False, True])
    assert error.value == pytest.approx((2 * 0.45 + 1 * 0.5) / 3)


def test_a_calibrated_confidence_has_little_error():
    rng = np.random.default_rng(2)
    sure = rng.uniform(size=2000)
    error = calibration_error(sure, rng.uniform(size=2000) < sure).value
    assert error == pytest.approx(calibration_error_by_chance(sure), abs=0.015)
    assert error < 0.04
    assert calibration_error(sure, rng.uniform(size=2000) < 0.5 * sure).value > 0.2
