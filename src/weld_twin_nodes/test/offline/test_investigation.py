# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""An investigation asks for what decides, keeps within its budget, and says why it ends."""

import pytest

from weld_twin_core.errors import DataError
from weld_twin_nodes.offline.investigation import (
    begin,
    decided,
    question,
    read_state,
    recordings,
    shortened,
    take_in,
    write_state,
)
from weld_twin_nodes.report.investigation_page import investigation_page

SPRING = {'effect': 'joint_compliance', 'joint': 'elbow_joint'}
ZERO = {'effect': 'joint_offset', 'joint': 'elbow_joint'}


def stations(count=60, sigma=36.0, cost=15.0):
    return {
        'kind': 'stations',
        'sentence': f'Measure {count} stations at rest.',
        'reason': 'They would part.',
        'cost': cost,
        'expected_separation_sigma': sigma,
        'between': [[SPRING], [ZERO]],
        'motion': {
            'static': True,
            'joint_names': ['a'],
            't': [15.0 * k for k in range(count)],
            'q': [[0.01 * k] for k in range(count)],
        },
    }


def found(status='ambiguous', wanted=None, groups=((SPRING, ZERO),)):
    verdict = {
        'status': status,
        'confidence': 0.6,
        'effects': [SPRING],
        'indistinguishable': [list(group) for group in groups],
    }
    return {
        'verdict': verdict,
        'candidates': [{**SPRING, 'probability': 0.6}],
        'next_experiment': wanted,
    }


def test_an_experiment_has_no_more_stations_than_its_decision_needs():
    # 36 sigma with 60 stations; 9 are wanted: (9 / 36)^2 of 60 is less than four, so the fewest.
    few = shortened(stations())
    assert few['stations'] == 12 and few['minutes'] == pytest.approx(3.0)
    assert few['expected_sigma'] == pytest.approx(36.0 * (12 / 60) ** 0.5)
    assert len(few['motion']['t']) == len(few['motion']['q']) == 12
    assert few['sentence'] == 'Measure 12 stations at rest.' and 'adds 16' in few['reason']
    # 12 sigma: (9 / 12)^2 of 60 is 34 stations.
    assert shortened(stations(sigma=12.0))['stations'] == 34
    assert shortened(stations(sigma=3.0))['stations'] == 60


def test_what_has_to_be_set_up_still_counts_when_stations_are_left_out():
    assert shortened(stations(cost=30.0))['minutes'] == pytest.approx(15.0 + 3.0)


@pytest.mark.parametrize(
    ('content', 'left', 'state'),
    [
        (found('identified'), 30.0, 'sure'),
        (found('none'), 30.0, 'sure'),
        (found('unsound'), 30.0, 'unsound'),
        (found(wanted=stations()), 2.0, 'budget spent'),
        (found(wanted=stations(sigma=0.5)), 30.0, 'nothing would part them'),
        (found(wanted=None), 30.0, 'nothing would part them'),
        (found(wanted={**stations(), 'motion': None}), 30.0, 'nothing would part them'),
    ],
)
def test_it_ends_with_a_reason(content, left, state):
    assert question(content, left, [])[0] == state


def test_data_that_were_widened_in_vain_are_not_widened_again():
    wanted = {**stations(), 'expected_separation_sigma': None, 'between': None}
    assert isinstance(question(found('unknown', wanted), 30.0, []), dict)
    assert question(found('unknown', wanted), 30.0, ['stations'])[0] == 'nothing would part them'


@pytest.mark.parametrize(
    ('content', 'answer'),
    [
        (found('identified', groups=((SPRING,),)), True),
        (found('ambiguous', groups=((SPRING, ZERO),)), False),
        (found('ambiguous', groups=((SPRING, {'effect': 'payload', 'joint': None}),)), True),
    ],
)
def test_an_experiment_is_judged_by_what_it_said(content, answer):
    assert decided(shortened(stations()), content) is answer


def test_the_state_survives_and_a_recording_that_changed_is_refused(tmp_path):
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
    assert 'it decided that' in page and '1 of 1' in page and 'monday' in page
    bags[0].write_text('another')
    with pytest.raises(DataError, match=r"monday' has changed since"):
        recordings(state)
