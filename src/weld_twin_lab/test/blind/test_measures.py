# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Measures over cases written by hand, against counts made by hand."""

from __future__ import annotations

import pytest
from blind_verdicts import diagnosis, offset, truth

from weld_twin_lab.blind.achieved import Achieved
from weld_twin_lab.blind.judging import judge
from weld_twin_lab.blind.measures import (
    by,
    by_stratum,
    calibration_measures,
    semi_real_measures,
    shrink_measures,
    verdict_measures,
)
from weld_twin_lab.blind.score_page import score_page
from weld_twin_lab.blind.scoring import Score

A, B, C = ('joint_offset', 'a'), ('joint_offset', 'b'), ('gear_ratio', 'a')


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
        ('single_family', 3 / 5, 5),
        ('single_joint', 3 / 5, 5),
        ('single_exact', 2 / 5, 5),
        ('faint_named', 1 / 2, 2),
        ('double_named', 1 / 2, 2),
        ('triple_named', None, 0),
        ('false_alarm', 1 / 2, 2),
        ('withheld_honest', 1 / 2, 2),
        ('withheld_unknown', 0.0, 2),
        ('outside_unknown', 1.0, 1),
        ('false_unknown', 1 / 13, 13),
        ('confident_wrong', 7 / 16, 16),
    ],
)
def test_measures_are_the_counts_made_by_hand(key, value, count):
    measure = next(m for m in verdict_measures(CASES) if m.key == key)
    assert measure.estimate.cases == count
    assert measure.estimate.value == (None if value is None else pytest.approx(value))


def test_a_goal_is_reached_from_the_right_side():
    reached = {m.key: m.reached for m in verdict_measures(CASES)}
    assert reached['single_family'] is False
    assert reached['false_alarm'] is False
    assert reached['triple_named'] is None
    assert reached['outside_unknown'] is None
    assert {m.key: m.reached for m in verdict_measures(CASES[:1])}['single_family'] is True


def test_every_case_is_in_one_group_of_its_kind():
    rows = by(CASES, lambda case: case.kind)
    assert {row['group']: row['count'] for row in rows} == {
        'double': 3,
        'none': 2,
        'outside': 1,
        'single': 8,
        'withheld': 2,
    }
    assert next(row for row in rows if row['group'] == 'single')['sets'] == {
        'exact': 3,
        'partial': 0,
        'wrong': 2,
        'silent': 3,
    }


def test_strata_hold_the_weakest_cause():
    rows = {(row['stratum'], row['group']): row['count'] for row in by_stratum(CASES)}
    assert rows == {
        ('< 1', 'single'): 1,
        ('1-3', 'single'): 2,
        ('1-3', 'double'): 1,
        ('3-10', 'single'): 4,
        ('3-10', 'double'): 2,
        ('> 10', 'single'): 1,
    }


def test_calibration_leaves_out_cases_without_a_verdict():
    measures = {m.key: m.estimate for m in calibration_measures([*CASES[:2], single(None)])}
    assert measures['brier'].value == pytest.approx((0.01 + 0.81) / 2)
    assert measures['ece'].value == pytest.approx(abs(0.9 - 0.5))


def shrink(claimed, ratio, test, covered=True):
    return Achieved(1e-4, ratio * 1e-4, ratio, claimed, covered, True, 1.02, test)


def test_shrink_claimed_is_held_against_shrink_achieved():
    shrinks = [
        shrink(0.2, 0.21, 'same motion'),
        shrink(0.2, 0.25, 'new motion'),
        shrink(0.3, 0.3, 'same motion', covered=False),
    ]
    measures = {m.key: m.estimate for m in shrink_measures(shrinks)}
    assert measures['shrink_off'].value == pytest.approx(0.01)
    assert measures['shrink_off_same'].value == pytest.approx(0.005)
    assert measures['shrink_off_new'].value == pytest.approx(0.05)
    assert measures['shrink_cover'].value == pytest.approx(2 / 3)
    assert measures['over_floor'].value == pytest.approx(1.02)


def test_what_a_real_bag_has_of_its_own_is_no_proof():
    cases = [
        judge(truth('semi-real', [offset('a')], ratios=[5.0]), diagnosis('identified', [A], [B])),
        judge(truth('semi-real', [offset('b')], ratios=[5.0]), diagnosis('identified', [A], [B])),
    ]
    told = {m.key: m.estimate for m in semi_real_measures(cases, {'free': 'joint_offset of b'})}
    assert told['semi_real_2'] == pytest.approx((1.0, 0.2065, 1.0, 1), abs=1e-3)


def test_the_page_escapes_what_it_did_not_write_and_names_every_failure():
    made = {
        'seed': 1,
        'seal': 'a' * 64,
        'engine': 'b' * 64,
        'version': '0',
        'with_holdout': True,
        'truths_readable': False,
    }
    costs = {
        'median_seconds': 1.0,
        'most_seconds': 2.0,
        'median_memory_mib': 3.0,
        'most_memory_mib': 4.0,
    }
    score = Score(
        made,
        CASES,
        {'case_0001': shrink(0.2, 0.21, 'same motion')},
        costs,
        {'case_0001': '<script>alert(1)</script>'},
        {},
    )
    page = score_page(score)
    assert '<script' not in page
    assert '&lt;script&gt;' in page
    failed = page[page.index('id="failures"') :]
    assert failed.count('<th scope="row">case_') == sum(not case.right for case in CASES)
    assert ' src=' not in page
    assert 'href="http' not in page
