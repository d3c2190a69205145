# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the report says in words and numbers."""

from __future__ import annotations

from dataclasses import replace
from io import StringIO

import diagnoses
import pytest
from rich.console import Console

from weld_twin_core.diagnosis.result import Candidate, Found, Site
from weld_twin_core.effects import REGISTRY, effect_from_mapping
from weld_twin_nodes.wording.quantities import (
    millimetres,
    odds,
    parameter_rows,
    percent,
    uncertain,
)
from weld_twin_nodes.wording.verdict import verdict
from weld_twin_nodes.wording.words import cause, in_words, listed
from weld_twin_report.report import print_summary
from weld_twin_report.report.answer import Answer
from weld_twin_report.report.footing import next_section
from weld_twin_report.report.to_do import worth_doing


def plain(text):
    return text.replace('\N{NO-BREAK SPACE}', ' ').replace('\N{MINUS SIGN}', '-')


@pytest.mark.parametrize(
    ('metres', 'text'),
    [
        (4.213e-4, '0.421 mm'),
        (0.0123456, '12.35 mm'),
        (0.0, '0.000 mm'),
        (3e-7, '< 0.001 mm'),
        (None, '\N{EN DASH}'),
        (float('nan'), '\N{EN DASH}'),
    ],
)
def test_lengths_are_told_in_millimetres(metres, text):
    assert plain(millimetres(metres)) == text


@pytest.mark.parametrize(
    ('share', 'text'),
    [(0.0, '0 %'), (0.002, '< 1 %'), (0.93, '93 %'), (0.9999, '> 99 %'), (1.0, '100 %')],
)
def test_a_share_close_to_all_or_nothing_is_not_told_as_such(share, text):
    assert plain(percent(share)) == text


@pytest.mark.parametrize(
    ('value', 'std', 'text'),
    [
        (5.00123e-4, 1.234e-5, '0.500 ± 0.012 mrad'),
        (-0.02, 3e-4, '-20.00 ± 0.30 mrad'),
        (1.2e-3, None, '1.2 mrad'),
        (1.2e-3, 0.0, '1.2 mrad'),
        (0.12, 0.34, '120 ± 340 mrad'),
    ],
)
def test_a_value_has_as_many_digits_as_its_error_allows(value, std, text):
    assert plain(uncertain(value, std, 1e3, 'mrad')) == text


def test_every_effect_of_the_library_has_a_name_in_words():
    titled = {name for name, effect in REGISTRY.items() if effect.traits.title}
    assert titled == set(REGISTRY) - {'measurement_noise'}


def test_an_effect_of_the_user_is_named_by_its_own_name():
    assert cause('tooth_wear', 'joint_2') == 'tooth wear of joint_2'


@pytest.mark.parametrize(
    ('names', 'text'),
    [([], ''), (['a'], 'a'), (['a', 'b'], 'a and b'), (['a', 'b', 'c'], 'a, b and c')],
)
def test_lists_read_as_prose(names, text):
    assert listed(names) == text


def test_one_cause_is_told_with_what_it_brings():
    first, second = map(plain, verdict(diagnoses.backlash()))
    assert first == 'The gap of 0.297 mm comes from backlash of elbow_joint (97 % sure).'
    assert 'shrinks to 0.035 mm on data not used for fitting' in second


def test_many_errors_are_told_by_family():
    first, _ = map(plain, verdict(diagnoses.calibration()))
    assert '26 errors together, mostly zero offset (6)' in first


def test_an_ambiguous_cause_is_never_told_as_one():
    first, _ = map(plain, verdict(diagnoses.ambiguous()))
    assert first == (
        'The gap of 0.563 mm comes from zero offset of joint_a1 or base pose error: these data do '
        'not tell which.'
    )


def test_what_is_settled_beside_an_open_question_is_told_apart():
    case = diagnoses.ambiguous()
    sure = Found(effect_from_mapping({'effect': 'time_delay', 'delay': 0.01}), {})
    sets = (*case.indistinguishable, (Site('time_delay', None),))
    first, _ = verdict(replace(case, effects=(*case.effects, sure), indistinguishable=sets))
    assert 'comes in part from clock delay, in part from zero offset of joint_a1 or' in first


def test_an_unknown_cause_is_told_by_what_it_depends_on():
    first, second = map(plain, verdict(diagnoses.unknown()))
    assert first == 'No effect in the library explains the gap of 0.693 mm.'
    assert second == (
        'What remains depends on the speed and acceleration of joint_1 and the place in the '
        'workspace.'
    )


def test_what_is_named_beside_a_cause_without_a_name_is_told_though_nothing_is_left():
    case = diagnoses.backlash()
    left = replace(case.unexplained, above_noise=False)
    first, second = verdict(
        replace(case, status='unknown', unexplained=left, reasons=('it has no name here',))
    )
    assert 'comes from backlash of elbow_joint; what else is at work has no name.' in plain(first)
    assert plain(second) == 'It has no name here.'


def test_what_is_certain_and_largest_is_to_be_done_first():
    case = diagnoses.ambiguous()
    sure = Found(effect_from_mapping({'effect': 'time_delay', 'delay': 0.01}), {})
    causes = [
        replace(case.causes[0], share=share, members=(k,)) for k, share in enumerate((0.1, 0.9))
    ]
    both = replace(
        case,
        effects=(*case.effects, sure),
        actions=(*case.actions, 'Set the clock right.'),
        causes=tuple(causes),
        contributions=None,
        model=replace(case.model, found=(*case.model.found, sure.effect)),
    )
    first, second, third = worth_doing(both)
    assert first == 'Set the clock right.'
    assert second.startswith('Find out whether') and third.startswith('Should it be')


def test_an_effect_that_was_not_to_be_tried_is_told_where_nothing_explains_the_gap():
    case = replace(
        diagnoses.unknown(), absent={'backlash': 'excluded by the user', 'drift': 'no time'}
    )
    first, _ = map(plain, verdict(case))
    assert first == (
        'No effect in the library (tried without backlash, as asked) explains the gap of 0.693 mm.'
    )


@pytest.mark.parametrize(('other', 'told'), [('base_pose', False), ('backlash', True)])
def test_a_measurement_that_leaves_the_open_question_open_says_so(other, told):
    case = diagnoses.ambiguous()
    zero = {'effect': 'joint_offset', 'joint': 'joint_a1'}
    site = {'effect': other, 'joint': None if other == 'base_pose' else 'joint_a1'}
    wanted = {'sentence': 'Run the path.', 'between': [[zero], [site]]}
    page = next_section(Answer(replace(case, next_experiment=wanted)))
    assert ('not made to tell whether it is zero offset of joint_a1 or base pose' in page) is told


def test_reasons_are_told_in_words():
    sites = [Site('backlash', 'j1'), Site('backlash', 'j10')]
    told = in_words('backlash of j10, backlash of j1 differ by nothing', sites)
    assert told == 'Backlash of j10, backlash of j1 differ by nothing.'
    assert in_words('base_pose is the same', [Site('base_pose', None)]) == (
        'Base pose error is the same.'
    )


def test_no_gap_is_told_against_the_noise():
    first, _ = map(plain, verdict(diagnoses.nothing()))
    assert first.startswith('There is no gap above the noise')


def test_the_orders_of_a_ripple_are_told_largest_first():
    ripple = effect_from_mapping(
        {
            'effect': 'transmission_ripple',
            'joint': 'j',
            'amplitude': [1e-4, 3e-4],
            'order': [1, 80],
            'phase': [0.5, -1.0],
        }
    )
    rows = parameter_rows(ripple, {'amplitude': [1e-5, 1e-5], 'phase': [0.1, 0.1]})
    assert [(name, plain(text)) for name, text in rows] == [
        ('order 80', '0.01719 ± 0.00057° (0.3 mrad) at -57.3 ± 5.7°'),
        ('order 1', '0.00573 ± 0.00057° (0.1 mrad) at 28.6 ± 5.7°'),
    ]


def test_a_vector_is_told_in_one_row():
    tool = effect_from_mapping({'effect': 'tool_pose', 'xyz': [1e-3, 0, -2e-3]})
    rows = parameter_rows(tool, {'xyz': [1e-5, 1e-5, 1e-5]})
    assert plain(rows[0][1]) == 'x 1.000 ± 0.010, y 0.000 ± 0.010, z -2.000 ± 0.010 mm'
    none = effect_from_mapping({'effect': 'tool_pose', 'xyz': [1e-6, 0, -2e-6]})
    assert (
        plain(parameter_rows(none, {'xyz': [1e-5] * 3})[0][1]) == '0.000 ± 0.010 mm in x, y and z'
    )


@pytest.mark.parametrize('name', list(diagnoses.ALL))
def test_the_terminal_tells_the_verdict(name):
    case, out = diagnoses.ALL[name](), StringIO()
    print_summary(case, Console(file=out, width=400))
    assert all(sentence in out.getvalue() for sentence in verdict(case))
    assert all(action.lower() in out.getvalue().lower() for action in case.actions)


def test_brackets_in_names_do_not_confuse_the_terminal():
    case, out = diagnoses.backlash(), StringIO()
    odd = Candidate(Site('backlash', '[red]axis[/]'), 0.1, 1e-4, 0.5)
    print_summary(replace(case, candidates=(odd, odd)), Console(file=out, width=200))
    assert '[red]axis[/]' in out.getvalue()


def test_what_only_turns_the_tool_is_told_in_angles():
    robot = diagnoses.load('ur5')
    turned = [{'effect': 'tool_pose', 'xyz': [0.0, 0.0, 0.0], 'rotvec': [0.0, 2e-3, 0.0]}]
    told = diagnoses.diagnosis('identified', robot, turned, turned, [diagnoses.moving(robot)])
    shrink = replace(
        told.shrink, ratio=1.0, rms_after_m=told.shrink.rms_before_m, orientation_rad=(2e-3, 5e-5)
    )
    first, second = map(plain, verdict(replace(told, shrink=shrink)))
    assert first.startswith(
        'The orientation gap of 0.023° (0.400 mrad) comes from tool pose error'
    )
    assert '0.115° (2.000 mrad) shrinks to 0.0029° (0.050 mrad)' in second
    assert 'stays as it is' in second


def test_no_probability_is_told_as_certain():
    assert plain(odds(1.0)) == '> 99 %'
    assert plain(odds(0.0)) == '< 1 %'
    assert plain(odds(0.6)) == '60 %'
