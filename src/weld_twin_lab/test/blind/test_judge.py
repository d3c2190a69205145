# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Verdicts held against truths, with the answers worked out by hand."""

import pytest
from blind_verdicts import diagnosis, offset, truth

from weld_twin_lab.blind.scoring import judge

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
