# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""An investigation asks for what decides, keeps within its budget, and says why it ends."""

from hashlib import sha256

import pytest

from weld_twin_core.errors import DataError
from weld_twin_nodes.offline.investigation import (
    begin,
    belief,
    changed,
    decided,
    question,
    read_state,
    recordings,
    take_in,
    weighed,
    write_state,
)
from weld_twin_report.report.investigation_page import investigation_page

SPRING = {'effect': 'joint_compliance', 'joint': 'elbow_joint'}
ZERO = {'effect': 'joint_offset', 'joint': 'elbow_joint'}
ELSE = {'effect': 'backlash', 'joint': 'wrist_1_joint'}


def stations(count=12, sigma=36.0, cost=3.0):
    t, q = [15.0 * k for k in range(count)], [[0.01 * k] for k in range(count)]
    told = {'sentence': f'Measure {count} stations at rest.', 'reason': 'They would part.'}
    told |= {'kind': 'stations', 'cost': cost, 'robot_minutes': cost, 'stations': count}
    told |= {'expected_separation_sigma': sigma, 'between': [[SPRING], [ZERO]]}
    return {**told, 'motion': {'static': True, 'joint_names': ['a'], 't': t, 'q': q}}


def found(status='ambiguous', wanted=None, groups=((SPRING, ZERO),), confidence=0.95):
    verdict = {'status': status, 'confidence': confidence, 'effects': [SPRING]}
    verdict['indistinguishable'] = [list(group) for group in groups]
    candidates = [{**SPRING, 'probability': 0.6}]
    return {'verdict': verdict, 'candidates': candidates, 'next_experiment': wanted}


def test_what_it_says_before_it_is_made_is_kept():
    asked = question(found(wanted=stations()), 30.0, [])
    assert (asked['minutes'], asked['stations'], asked['expected_sigma']) == (3.0, 12, 36.0)
    assert asked['between'] == [[SPRING], [ZERO]] and asked['decided'] is None


@pytest.mark.parametrize(
    ('content', 'left', 'state'),
    [
        (found('identified'), 30.0, 'sure'),
        (found('none'), 30.0, 'sure'),
        (found('unsound', confidence=None), 30.0, 'unsound'),
        (found(wanted=stations()), 2.0, 'budget spent'),
        (found(wanted=stations(sigma=0.5)), 30.0, 'nothing would part them'),
        (found(wanted=None), 30.0, 'nothing would part them'),
        # A minute is left: what would part them does not fit in any more.
        (found(wanted=None), 1.0, 'budget spent'),
        (found(wanted=stations(sigma=0.5)), 1.0, 'budget spent'),
        (found(wanted={**stations(), 'motion': None}), 30.0, 'nothing would part them'),
    ],
)
def test_it_ends_with_a_reason(content, left, state):
    assert question(content, left, [])[0] == state


def test_data_that_were_widened_in_vain_are_not_widened_again():
    wanted = {**stations(), 'expected_separation_sigma': None, 'between': None}
    assert isinstance(question(found('unknown', wanted), 30.0, []), dict)
    often = ['stations'] * 3
    assert question(found('unknown', wanted), 30.0, often)[0] == 'nothing would part them'


def test_what_is_identified_without_being_sure_is_asked_about():
    wanted = {**stations(), 'expected_separation_sigma': None, 'between': None}
    doubtful = found('identified', wanted, confidence=0.8)
    assert question(doubtful, 30.0, [])['kind'] == 'stations'


@pytest.mark.parametrize(
    ('content', 'answer'),
    [
        (found('identified', groups=((SPRING,),)), True),
        (found('ambiguous', groups=((SPRING, ZERO),)), False),
        (found('ambiguous', groups=((SPRING, {'effect': 'payload', 'joint': None}),)), True),
    ],
)
def test_an_experiment_is_judged_by_what_it_said(content, answer):
    assert decided(question(found(wanted=stations()), 30.0, []), content) is answer


def at(place, on):
    return {'effect': 'joint_curve', 'joint': place, 'at': place, 'on': on}


def without_name(place, on, probability=0.9):
    cause = {'place': [{'at': place, 'probability': probability}], 'share': 0.8}
    cause['dependence'] = [{'on': on, 'probability': probability}]
    content = found('unknown', groups=())
    return {**content, 'verdict': {**content['verdict'], 'causes': [cause]}}


@pytest.mark.parametrize(
    ('sides', 'content', 'answer'),
    [
        ([[at('a', 'angle')], [at('b', 'angle')]], without_name('a', 'angle'), True),
        ([[at('a', 'angle')], [at('b', 'angle')]], without_name('c', 'angle'), False),
        ([[at('a', 'angle')], [at('b', 'angle')]], without_name('a', 'angle', 0.5), False),
        ([[], [at('a', 'load')]], without_name('a', 'load'), True),
        ([[], [at('a', 'load')]], without_name('a', 'angle'), True),
        (None, without_name('a', 'angle'), None),
    ],
)
def test_where_no_name_fits_place_and_dependence_are_what_is_decided(sides, content, answer):
    assert decided({'between': sides}, content) is answer


def test_what_was_changed_in_the_cell_is_remembered(tmp_path, kept):
    bags = [tmp_path / 'monday', tmp_path / 'heavy']
    for bag in bags:
        bag.write_text(bag.name)
    wanted = {**stations(), 'changes': 'load=5', 'promise': 0.9}
    state = take_in(begin('ur5', [], 60.0), [str(bags[0])], found(wanted=wanted))
    assert state['rounds'][0]['asked']['changes'] == 'load=5'
    state = take_in(
        state, [str(bags[1])], found('identified', groups=((SPRING,),)), None, 'load=4'
    )
    assert changed(state) == {str(bags[1].resolve()): 'load=4'}
    kept('changed', investigation_page(state))


def test_a_recording_that_was_replaced_while_it_was_diagnosed_is_refused_next_time(tmp_path):
    bag = tmp_path / 'monday'
    bag.write_text('another')
    read = {'use': 'recording', 'path': str(bag), 'sha256': sha256(b'monday').hexdigest()}
    state = take_in(begin('ur5', [], 60.0), [str(bag)], {**found(), 'inputs': [read]})
    with pytest.raises(DataError, match='has changed since'):
        recordings(state)
    bag.write_text('monday')
    assert recordings(state) == ([str(bag.resolve())], [])


def test_the_state_survives_and_a_recording_that_changed_is_refused(tmp_path, kept):
    bags = [tmp_path / 'monday', tmp_path / 'tuesday']
    for bag in bags:
        bag.write_text(bag.name)
    state = take_in(begin('ur5', [], 10.0), [str(bags[0])], found(wanted=stations()))
    state['rounds'][-1]['asked'].pop('motion')
    write_state(tmp_path, state)
    state = take_in(read_state(tmp_path), [str(bags[1])], found('identified', groups=((SPRING,),)))
    assert (state['state'], state['spent_min']) == ('sure', 3.0)
    assert state['rounds'][0]['asked']['decided'] is True
    page = investigation_page(state)
    kept('decided', page)
    # Of the two explanations of the fork one is left, and the other struck out.
    assert page.count('class="stays"') == 1 and page.count('class="gone"') == 1
    bags[0].write_text('another')
    with pytest.raises(DataError, match=r"monday' has changed since"):
        recordings(state)


OF_OTHERS = {**stations(), 'between': [[SPRING], [ELSE]]}


def named(cause, confidence, status='identified', wanted=None):
    groups = ((cause,),) if cause else ()
    return found(status, wanted, groups, confidence)


@pytest.mark.parametrize(
    ('together', 'alone', 'believed', 'closed'),
    [
        # What the other does not see has to be very likely by itself.
        (named(SPRING, 0.98), named(None, 0.9, 'unknown'), 0, False),
        (named(None, 0.99, 'unknown'), named(SPRING, 0.98), 1, False),
        (named(None, 0.99, 'unknown'), named(SPRING, 0.998), 1, True),
        # Two that are sure of different causes are not sure.
        (named(SPRING, 0.995), named(ELSE, 0.99), 0, False),
        (named(SPRING, 0.99), named(ELSE, 0.995), 1, False),
        # Neither is sure by itself, and both say the same; or one hardly says it.
        (named(SPRING, 0.9), named(SPRING, 0.92), 0, True),
        (named(SPRING, 0.8), named(SPRING, 0.4), 0, False),
        # What all recordings rule out, the experiments leave open: what both hold is told.
        (named(SPRING, 0.95), found(wanted=stations(sigma=0.5)), 1, True),
        # Two causes against one.
        (found(groups=((SPRING, ZERO), (ELSE,))), named(SPRING, 0.6), 0, False),
        # Some motion parts what is named beside each other; or none does, and only others are asked.
        (found(wanted=stations()), found(wanted=stations()), 0, False),
        (found(wanted=OF_OTHERS), found(wanted=OF_OTHERS), 0, True),
        (found(wanted=stations(sigma=0.5)), found(wanted=stations(sigma=0.5)), 0, True),
        (found(), found(), 0, False),
        # What was knocked between two recordings is sound in each.
        (named(None, None, 'unsound'), named(None, 0.9, 'unknown'), 1, False),
        (named(None, 0.99, 'none'), named(None, 0.99, 'none'), 0, True),
    ],
)
def test_experiments_alone_are_heard_beside_all_recordings(together, alone, believed, closed):
    told, why = weighed(together, alone)
    expected = (together, alone)[believed]['verdict']
    assert told['verdict']['status'] == expected['status']
    assert told['verdict']['indistinguishable'] == expected['indistinguishable']
    assert bool(why) is closed


def test_what_is_sure_of_all_recordings_and_unknown_without_the_first_is_asked_about():
    unknown = named(None, 0.9, 'unknown', stations(sigma=None))
    for wanted in (None, {**stations(), 'motion': None}):
        told, why = weighed(named(SPRING, 0.99, wanted=wanted), unknown)
        assert not why and told['verdict']['status'] == 'identified'
        assert question(told, 30.0, [], why)['kind'] == 'stations'
    own = stations(count=4)
    assert weighed(named(SPRING, 0.99, wanted=own), unknown)[0]['next_experiment'] is own


def test_belief_is_that_of_both_and_the_other_raises_it_or_lowers_it():
    alone = belief(named(SPRING, 0.9), named(None, 0.9, 'unknown'))
    assert belief(named(SPRING, 0.9), named(SPRING, 0.9)) > alone
    assert belief(named(SPRING, 0.9), named(ELSE, 0.9)) < alone
    # What was learned counts, where a diagnosis tells less of it.
    learned = named(SPRING, 0.8)
    learned['verdict']['learned'] = 0.98
    assert belief(learned, named(None, 0.9, 'unknown')) > alone
    told, _ = weighed(learned, named(SPRING, 0.9))
    assert told['verdict']['confidence'] == belief(learned, named(SPRING, 0.9))


def test_nothing_is_sure_at_first_before_every_joint_has_moved_widely():
    wider = {**stations(), 'expected_separation_sigma': None, 'between': None, 'confirms': ['a']}
    still = named(SPRING, 0.99, wanted=wider)
    assert question(still, 30.0, [])['kind'] == 'stations'
    assert weighed(still)[1] == '' and weighed(still, still)[1]
    assert question(named(SPRING, 0.99), 30.0, [])[0] == 'sure'
