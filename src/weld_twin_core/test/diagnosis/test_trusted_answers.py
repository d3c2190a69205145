# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Belief that was learned: log odds by hand, bounds on what may be said, an answer that adds up."""

import math
from dataclasses import replace

import pytest

from weld_twin_core.diagnosis.answer.settled import settled
from weld_twin_core.diagnosis.result import Cause, Site
from weld_twin_core.diagnosis.trust.model import trust_from, usual_trust
from weld_twin_core.diagnosis.trust.signs import Signs
from weld_twin_core.diagnosis.trust.trusted import trusted, trusted_cause, trusted_verdict
from weld_twin_core.diagnosis.verdict.decision import Verdict

PLAY = Site('backlash', 'elbow_joint')
NAMED = Verdict('identified', 0.95, ((PLAY,),), ())


def taught(sure_from=0.9, **levels):
    """Return what was learned: a bias and weights per unit of signs, by level."""
    return trust_from(
        {
            'card': {},
            'sure_from': dict.fromkeys((name.replace('_', ' ') for name in levels), sure_from),
            'told_unsure': 0.8,
            'levels': {
                name.replace('_', ' '): {
                    'bias': bias,
                    'least': 0.01,
                    'most': 0.99,
                    'terms': {
                        sign: {'weight': w, 'middle': 1.0, 'spread': 2.0, 'low': 0.0, 'high': 5.0}
                        for sign, w in weights.items()
                    },
                }
                for name, (bias, weights) in levels.items()
            },
        }
    )


def test_log_odds_are_a_sum_over_signs():
    trust = taught(sure_from=0.5, answer_named=(1.0, {'margin': 2.0, 'rise': -1.0}))
    told = trust.learned('answer', 'named', {'margin': 2.0, 'rise': 3.0})
    odds = 1.0 + 2.0 * (2.0 - 1.0) / 2.0 - 1.0 * (3.0 - 1.0) / 2.0
    assert told == pytest.approx(1.0 / (1.0 + math.exp(-odds)))


def test_a_sign_says_no_more_beyond_what_was_learned_from():
    trust = taught(sure_from=0.5, answer_named=(0.0, {'margin': 1.0}))
    far, edge = (trust.learned('answer', 'named', {'margin': x}) for x in (900.0, 5.0))
    assert far == edge


@pytest.mark.parametrize(
    ('gap', 'bias', 'told'),
    [(4.9, -6.0, 0.01), (5.1, -6.0, 0.7), (5.1, 6.0, 0.99)],
    ids=['seen', 'larger', 'larger but sure'],
)
def test_a_gap_beyond_all_that_was_learned_from_is_told_what_the_evidence_says(gap, bias, told):
    trust = taught(sure_from=0.9, answer_named=(bias, {'gap': 0.0}))
    signs = {'gap': gap, 'belief': 0.7}
    assert trust.learned('answer', 'named', signs) == pytest.approx(told)


def test_the_evidence_alone_makes_no_answer_sure():
    trust = taught(sure_from=0.9, answer_named=(-6.0, {'gap': 0.0}))
    signs = {'gap': 9.0, 'belief': 0.97}
    assert trust.learned('answer', 'named', signs) == 0.8
    assert not trust.sure('answer', 'named', signs)


def test_a_sign_that_is_missing_counts_as_usual():
    trust = taught(sure_from=0.5, answer_named=(0.4, {'margin': 1.0}))
    assert trust.learned('answer', 'named', {}) == pytest.approx(1.0 / (1.0 + math.exp(-0.4)))


@pytest.mark.parametrize(('constants', 'share'), [(2.0, 0.75), (0.0, 0.0)])
def test_a_constant_named_where_joints_rest_is_a_sign_of_its_own(constants, share):
    trust = taught(sure_from=0.5, answer_named=(0.0, {'constant_at_rest': -1.0}))
    told = trust.learned('answer', 'named', {'constants': constants, 'moving': 0.25})
    assert told == pytest.approx(1.0 / (1.0 + math.exp((share - 1.0) / 2.0)))


def test_few_cases_allow_no_certainty():
    trust = taught(answer_named=(40.0, {}))
    assert trust.learned('answer', 'named', {}) == 0.99


@pytest.mark.parametrize(
    ('bias', 'told', 'sure'), [(2.3, 0.909, True), (2.1, 0.891, False), (0.0, 0.5, False)]
)
def test_an_answer_is_believed_as_it_was_learned_and_sure_from_the_bound_on(bias, told, sure):
    verdict = trusted_verdict(NAMED, {}, taught(sure_from=0.9, answer_named=(bias, {})))
    assert verdict.confidence == pytest.approx(told, abs=1e-3)
    assert verdict.sure is sure


def test_an_answer_that_nothing_was_learned_of_stays_as_it_is():
    assert trusted_verdict(NAMED, {}, taught()) == NAMED


def test_many_small_errors_are_not_learned_from_single_ones():
    trust = taught(sure_from=0.5, answer_named=(0.0, {}))
    assert trusted_verdict(NAMED, {'families': 2.0}, trust).confidence == 0.95
    assert trusted_verdict(NAMED, {'families': 0.0}, trust).confidence == 0.5


def test_the_first_place_has_what_was_learned_and_the_others_share_the_rest():
    cause = Cause((('tool', 0.6), ('wrist', 0.3), ('base', 0.1)), (), (), 1.0, (1.0, 1.0))
    trust = taught(sure_from=0.5, place_unknown=(math.log(4.0), {}))
    told = dict(trusted_cause(cause, 'unknown', {}, trust).place)
    assert told == pytest.approx({'tool': 0.8, 'wrist': 0.15, 'base': 0.05})


def test_members_of_a_set_share_the_belief_in_the_set():
    cause = Cause((), (), ((PLAY, 0.6), (Site('joint_offset', 'wrist'), 0.2)), 1.0, (1.0, 1.0))
    trust = taught(sure_from=0.5, name_named=(0.0, {}))
    told = trusted_cause(cause, 'ambiguous', {}, trust).name
    assert [p for _, p in told] == pytest.approx([0.375, 0.125])


def test_a_place_is_never_less_certain_than_the_name_that_lies_there():
    cause = Cause((('elbow_joint', 0.9),), (('direction', 0.9),), ((PLAY, 0.9),), 1.0, (1.0, 1.0))
    trust = taught(sure_from=0.5, name_named=(3.0, {}), place_named=(1.0, {}))
    told = trusted_cause(cause, 'identified', {}, trust)
    assert told.place[0][1] == told.name[0][1] > 0.9


def test_each_cause_is_weighed_by_signs_of_its_own():
    cause = Cause((('elbow_joint', 0.9),), (), (), 0.5, (0.4, 0.6))
    trust = taught(sure_from=0.5, place_unknown=(0.0, {'cause_size': 1.0, 'margin': 1.0}))
    signs = Signs({'margin': 1.0}, ({'cause_size': 3.0}, {'cause_size': 1.0}))
    _, told = trusted(Verdict('unknown', 0.7, (), ()), (cause, cause), signs, trust)
    assert [c.place[0][1] for c in told] == pytest.approx([1.0 / (1.0 + math.exp(-1.0)), 0.5])


def test_what_this_package_has_learned_can_be_read():
    trust = usual_trust()
    assert trust.told_unsure == 0.8
    for level in trust.levels.values():
        assert 0.0 < level.least < level.most < 1.0
        assert all(term.spread > 0.0 and term.low <= term.high for term in level.terms.values())


def test_a_family_that_is_missing_counts_as_not_named():
    trust = taught(sure_from=0.5, answer_named=(0.0, {'named_backlash': 1.0}))
    absent, named = (trust.learned('answer', 'named', s) for s in ({}, {'named_backlash': 1.0}))
    assert absent == pytest.approx(1.0 / (1.0 + math.exp(0.5)))
    assert named == pytest.approx(0.5)


def test_names_beside_what_has_none_make_the_whole_as_likely_as_all_of_them():
    causes = [
        Cause((), (), ((PLAY, 0.8),), 0.5, (0.4, 0.6), slot=0),
        Cause((), (), ((Site('joint_offset', 'wrist'), 0.5),), 0.3, (0.2, 0.4), slot=1),
        Cause((('base', 0.9),), (), (), 0.2, (0.1, 0.3), rest=True),
    ]
    signs = Signs({'partly': 1.0}, ({}, {}, {}))
    verdict, told = trusted(Verdict('unknown', 0.9, ((PLAY,),), ()), causes, signs, taught())
    assert verdict.confidence == pytest.approx(0.9 * 0.8 * 0.5)
    assert [cause.probability for cause in told] == pytest.approx([0.8, 0.5, 0.9])
    assert not verdict.sure and not any(cause.sure for cause in told)


@pytest.mark.parametrize(('left', 'status'), [(0.45, 'identified'), (0.55, 'unknown')])
def test_unknown_is_what_leaves_more_without_a_name_than_with_one(left, status):
    named = Cause((), (), ((PLAY, 0.8),), 0.5, (0.4, 0.6), probability=0.8, slot=0)
    doubtful = replace(named, share=0.4, probability=0.5)
    rest = Cause((('base', 0.9),), (), (), left, (0.0, 1.0), rest=True)
    verdict = Verdict('unknown', 0.9, ((PLAY,),), ('what remains',))
    assert settled(verdict, (named, doubtful, rest)).status == status
    assert settled(verdict, (doubtful, rest)).status == 'unknown'
    assert settled(replace(verdict, sets=()), (named, rest)).status == 'unknown'
