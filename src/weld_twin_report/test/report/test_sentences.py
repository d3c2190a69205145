# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the report says in words and numbers: one figure for one thing, no unknown hidden."""

import re
from dataclasses import replace
from io import StringIO
from types import SimpleNamespace

import diagnoses
import numpy as np
import pytest
from rich.console import Console
from scipy.spatial.transform import Rotation

from weld_twin_core import Robot, effect_from_mapping, load
from weld_twin_core.diagnosis.result import Candidate, Cause, Site, Unexplained
from weld_twin_core.diagnosis.verdict.decision import UNEVEN
from weld_twin_core.effects import REGISTRY
from weld_twin_nodes.wording.quantities import (
    counted,
    in_short,
    millimetres,
    odds,
    parameter_rows,
    percent,
    short_rows,
    uncertain,
)
from weld_twin_nodes.wording.verdict import verdict
from weld_twin_nodes.wording.words import cause, in_words, listed
from weld_twin_report.report import print_summary
from weld_twin_report.report.answer import Answer
from weld_twin_report.report.charts import furthest
from weld_twin_report.report.controllers import correction
from weld_twin_report.report.diagnosis_page import _how_much
from weld_twin_report.report.page_data import components, sides_words
from weld_twin_report.report.to_do import warned


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


def test_of_many_errors_the_ones_that_do_most_of_the_gap_are_told_in_front():
    told = diagnoses.calibration()
    *others, last = told.causes
    largest = (*(replace(each, share=0.01) for each in others), replace(last, share=0.6))
    name = cause(told.effects[-1].effect.name, None)
    first = plain(verdict(replace(told, causes=largest))[0])
    assert f'mostly {name} (1) and ' in first and f'the largest is {name} (' in first


def test_what_may_be_the_instrument_or_the_robot_is_not_told_to_be_noise():
    told = diagnoses.nothing()
    assert verdict(told)[1] == 'As far as these data reach, the model is the robot.'
    gap = replace(told.gap, rms_m=0.964e-3, noise_floor_m=0.606e-3)
    first, second = verdict(replace(told, gap=gap, reasons=(UNEVEN,)))
    assert 'differ by 0.964 mm, of which no more than 0.606 mm passes for noise' in plain(first)
    assert second == 'Whether the rest is the robot or the instrument, these data do not tell.'


def test_an_effect_of_the_user_is_named_by_its_own_name():
    assert cause('tooth_wear', 'joint_2') == 'tooth wear of joint_2'


@pytest.mark.parametrize(
    ('names', 'text'),
    [([], ''), (['a'], 'a'), (['a', 'b'], 'a and b'), (['a', 'b', 'c'], 'a, b and c')],
)
def test_lists_read_as_prose(names, text):
    assert listed(names) == text


def test_reasons_are_told_in_words():
    sites = [Site('backlash', 'j1'), Site('backlash', 'j10')]
    told = in_words('backlash of j10, backlash of j1 differ by nothing', sites)
    assert told == 'Backlash of j10, backlash of j1 differ by nothing.'
    assert in_words('base_pose is the same', [Site('base_pose', None)]) == (
        'Base pose error is the same.'
    )


def test_a_vector_is_told_in_one_row():
    tool = effect_from_mapping({'effect': 'tool_pose', 'xyz': [1e-3, 0, -2e-3]})
    rows = parameter_rows(tool, {'xyz': [1e-5, 1e-5, 1e-5]})
    assert plain(rows[0][1]) == 'x 1.000 ± 0.010, y 0.000 ± 0.010, z -2.000 ± 0.010 mm'
    # The flange of this robot is turned by half a turn about x at the end of its rows.
    turned = parameter_rows(tool, {'xyz': [1e-5, 2e-5, 3e-5]}, load('kuka_kr6_r900'))
    assert plain(turned[0][1]) == 'x 1.000 ± 0.010, y 0.000 ± 0.020, z 2.000 ± 0.030 mm'
    none = effect_from_mapping({'effect': 'tool_pose', 'xyz': [1e-6, 0, -2e-6]})
    assert (
        plain(parameter_rows(none, {'xyz': [1e-5] * 3})[0][1]) == '0.000 ± 0.010 mm in x, y and z'
    )


def test_brackets_in_names_do_not_confuse_the_terminal():
    case, out = diagnoses.backlash(), StringIO()
    odd = Candidate(Site('backlash', '[red]axis[/]'), 0.1, 1e-4, 0.5)
    print_summary(replace(case, candidates=(odd, odd)), Console(file=out, width=200))
    assert '[red]axis[/]' in out.getvalue()


def test_no_probability_is_told_as_certain():
    assert plain(odds(1.0)) == '> 99 %'
    assert plain(odds(0.0)) == '< 1 %'
    assert plain(odds(0.6)) == '60 %'


def test_what_remains_beside_a_name_is_not_told_as_above_the_noise_that_is_in_it():
    case = diagnoses.backlash()
    gap = replace(case.gap, noise_floor_m=4.1e-5)
    remains = Unexplained(7.3e-5, above_noise=True)
    told, _ = verdict(replace(case, status='unknown', gap=gap, unexplained=remains))
    words = '0.073 mm remains that no effect in the library explains; measuring noise alone is 0.041 mm'
    assert words in plain(told)


@pytest.mark.parametrize(
    ('more', 'words', 'wide'),
    [
        ({}, 'Elsewhere in its reach the corrected robot may still be off by 0.3 mm', False),
        ({'recorded_m': 5e-5}, 'may still be off by 0.3 mm', True),
        ({'left_open': ('base z', 'tool z')}, 'may still be off by 0.3 mm', True),
        ({'anywhere_m': 1.0}, 'Of elsewhere in its reach these recordings tell nothing', True),
        ({'region': ('seam 1', 2e-4)}, "In the region 'seam 1' the corrected robot may still be", False),
    ],
)  # fmt: skip
def test_where_what_is_said_holds_is_told_with_how_wide_it_is_beyond(more, words, wide):
    usual = {'region': None, 'anywhere_m': 3e-4, 'recorded_m': 2e-4, 'left_open': ()}
    case, posterior = diagnoses.backlash(), SimpleNamespace(**{**usual, **more})
    holds = Answer(replace(case, posterior=posterior)).holds
    assert words in holds.elsewhere and holds.wide is wide and holds.file == ''
    assert holds.open == [] or '2 directions of the frames are left open' in holds.open[0]
    nothing = replace(diagnoses.nothing(), posterior=posterior)
    assert 'says nothing of elsewhere' in Answer(nothing).holds.elsewhere
    assert Answer(replace(case, posterior=None)).holds is None


def test_what_is_left_beside_a_name_is_told_with_its_place():
    case = diagnoses.backlash()
    assert 'Beside that' not in verdict(case)[1]
    rest = Cause((('base', 0.97),), (('time', 0.9),), (), 0.23, (0.2, 0.3), rest=True)
    said = plain(verdict(replace(case, causes=(*case.causes, rest)))[1])
    assert 'Beside that, 23 % of the squared gap has no name yet: ' in said and 'base' in said


def test_of_an_unknown_cause_is_told_what_it_depends_on_or_that_it_shows_nothing():
    case = replace(diagnoses.backlash(), status='unknown', effects=(), causes=())
    for structure, words in (
        ((), 'What remains is above the noise, but shows no simple dependence.'),
        (('speed',), 'What remains depends on speed.'),
        (('a', 'b', 'c', 'd'), 'What remains depends on a, b and c.'),
    ):
        remains = replace(case.unexplained, above_noise=True, structure=structure)
        first, second = verdict(replace(case, unexplained=remains, reasons=('too short',)))
        assert first.startswith('No effect in the library') and second == words
    still = replace(case.unexplained, above_noise=False, structure=())
    first, second = verdict(replace(case, unexplained=still, reasons=('too short',)))
    assert second == 'Too short.'
    named = replace(case, effects=diagnoses.backlash().effects, unexplained=still)
    first, second = verdict(replace(named, reasons=('too short',)))
    assert first.endswith('; what else is at work has no name.') and second == 'Too short.'


def test_a_share_is_told_of_what_it_is_a_share_of():
    """Frames fitted to other stretches may leave much more than the gap of all."""
    found = diagnoses.backlash()
    more = replace(found.shrink, rms_before_m=2.0 * found.gap.rms_m)
    assert 'of the RMS gap, on data' in _how_much(found)
    said = plain(_how_much(replace(found, shrink=more)))
    assert f'of the {plain(millimetres(2.0 * found.gap.rms_m))} there, on data' in said


PLAY = diagnoses.backlash()


def unmarked(text):
    return re.sub(r'\s+', ' ', re.sub('<[^>]+>', ' ', text))


def test_one_is_no_plural():
    assert [counted(k, 'cell') for k in (0, 1, 2)] == ['0 cells', '1 cell', '2 cells']
    assert counted(1, 'diagnosis', 'diagnoses') == '1 diagnosis'


def test_where_the_arm_stands_along_is_where_it_goes_next():
    traces = PLAY.traces
    path = traces.measured[0] - traces.before[0]
    path[:12] = path[12]
    still = replace(traces, measured=(path + traces.before[0], *traces.measured[1:]))
    way = (path[13] - path[12]) / np.linalg.norm(path[13] - path[12])
    parts = components(replace(PLAY, traces=still), 0, np.tile(2e-4 * way, (len(path), 1)))
    assert unmarked(sides_words(parts[3])).startswith('0.200 mm ahead')


ORDERS = {'kuka': ('ZYX', False), 'fanuc': ('xyz', False), 'abb': (None, True)}
"""Angles as the makers write them, and whether positions are in metres."""


def frame_in(text, brand):
    """Return the frame that the numbers of a maker stand for."""
    order, metres = ORDERS[brand]
    text = re.sub(r'q1 to q4', '', text)
    numbers = [float(v) for v in re.findall(r'-?\d+\.\d+', text)]
    out = np.eye(4)
    if order is None:
        turn = Rotation.from_quat([*numbers[4:], numbers[3]])
    else:
        turn = Rotation.from_euler(order, numbers[3:], degrees=True)
    out[:3, :3], out[:3, 3] = turn.as_matrix(), np.array(numbers[:3]) * (1.0 if metres else 1e-3)
    return out


@pytest.mark.parametrize('brand', ORDERS)
def test_a_positioner_that_stands_elsewhere_is_told_as_its_controller_takes_it(brand):
    """Old and new value, and what to do where the controller has the root at another place."""
    turn = Rotation.from_euler('xyz', [20.0, -35.0, 110.0], degrees=True)
    foot = {'xyz': [1.4, 0.2, 0.7], 'quat_xyzw': turn.as_quat().tolist()}
    high = Rotation.from_euler('z', 90.0, degrees=True)
    data = load('kuka_kr16_2').to_mapping() | {'name': 'cell'}
    data['base'] = {'xyz': [0.0, 0.0, 0.5], 'quat_xyzw': high.as_quat().tolist()}
    data['controller'] = {'base': {'xyz': [0.0, 0.0, 0.1], 'quat_xyzw': [1.0, 0.0, 0.0, 0.0]}}
    data['workpiece'] = {'base': foot, 'joints': [{'name': 'tilt', 'a': 0.1}]}
    error = {'effect': 'root_pose', 'xyz': [2e-3, -1e-3, 3e-3], 'rotvec': [1e-3, 2e-3, -3e-3]}
    told = correction(effect_from_mapping(error), brand, Robot.from_mapping(data))

    def placed(xyz, rotation):
        out = np.eye(4)
        out[:3, :3], out[:3, 3] = rotation.as_matrix(), xyz
        return out

    base = placed([0.0, 0.0, 0.5], high)
    mine = base @ placed([0.0, 0.0, 0.1], Rotation.from_quat([1.0, 0.0, 0.0, 0.0]))
    moved = Rotation.from_rotvec(high.apply(error['rotvec']))
    real = placed(foot['xyz'] + high.apply(error['xyz']), moved * turn)
    parts = re.split('Old value |; new value |\\. The origin ', told)
    old, new = (frame_in(part, brand) for part in parts[1:3])
    np.testing.assert_allclose(old, np.linalg.inv(mine) @ placed(foot['xyz'], turn), atol=2e-6)
    np.testing.assert_allclose(new, np.linalg.inv(mine) @ real, atol=2e-6)
    other = placed([0.3, -0.2, 0.4], Rotation.from_rotvec([0.2, 0.1, 1.0]))
    step = frame_in(parts[3].split('new value is ')[1].split('old value')[0], brand)
    step[:3, 3] *= 1e-3 if brand == 'abb' else 1.0  # PoseMult is in mm
    np.testing.assert_allclose(step @ old @ other, new @ other, atol=4e-6)
    if brand == 'abb':  # as a program of it is written
        assert re.search(r'\[\[(-?\d+\.\d{3},?){3}\],\[(-?\d\.\d{7},?){4}\]\]', told)


def test_a_frame_on_the_workpiece_is_told_where_it_is_on_the_positioner():
    """Of a cell poses are measured there, and no bolt of the robot's foot is to blame."""
    data = load('kuka_kr16_2').to_mapping() | {'name': 'cell'}
    tool = {'xyz': [0.1, 0.05, 0.08], 'quat_xyzw': [0.0, 0.0, 0.6, 0.8]}
    data['workpiece'] = {'joints': [{'name': 'turn'}], 'tool': tool}
    turn, moved = Rotation.from_quat(tool['quat_xyzw']), np.array([0.012, -0.02, 0.004])
    # What the measuring frame sees of the positioner is displaced by the error.
    off = {'effect': 'base_pose', 'xyz': (-turn.inv().apply(moved)).tolist(), 'rotvec': [0.0] * 3}
    told = effect_from_mapping(off).remedy(Robot.from_mapping(data))
    assert 'at x, y, z = (112.000, 30.000, 84.000) mm' in told
    assert 'in place of x, y, z = (100.000, 50.000, 80.000) mm' in told
    assert 'fixture' in told and 'bolts' not in told


def test_a_flat_curve_is_the_same_everywhere():
    flat = {'effect': 'joint_curve', 'joint': 'j', 'over': 'direction', 'knots': [-1.0, 1.0]}
    told = [furthest(effect_from_mapping({**flat, 'values': values}))
            for values in ([-5e-4, -4.99e-4], [-5e-4, 1e-4])]  # fmt: skip
    assert told == ['-0.0286° everywhere', 'up to 0.0286° going backward']


@pytest.mark.parametrize(
    ('value', 'std', 'told'),
    [
        (0.028651, 0.00025, '0.0287 ± 0.0003°'),
        (0.063025, 0.000081, '0.0630 ± 0.0001°'),
        (0.5, 0.2, '0.500 ± 0.200°'),
        (-12.345, None, '\N{MINUS SIGN}12.3°'),
    ],
)
def test_a_value_has_the_digits_of_the_action_beside_it(value, std, told):
    assert in_short(value, std, 1.0, '°') == told


def test_of_a_frame_only_the_axes_that_count_are_told():
    base = effect_from_mapping({'effect': 'base_pose', 'xyz': [0, 0, 0], 'rotvec': [0, 0, 6e-4]})
    assert short_rows(base, {'xyz': [5e-6] * 3, 'rotvec': [2e-6] * 3}) == [
        ('rotvec', 'z 0.0344 ± 0.0001°')
    ]


def test_without_a_maker_it_is_told_what_takes_the_correction():
    zero = effect_from_mapping({'effect': 'joint_offset', 'joint': 'j', 'offset': 1e-3})
    gear = effect_from_mapping({'effect': 'gear_ratio', 'joint': 'j', 'scale': 1e-3})
    assert correction(zero, None).startswith('As the zero of this axis')
    assert 'correct the points of the program' in correction(gear, None)


def test_what_not_to_do_stands_out():
    told = ''.join(map(str, warned('Turn 0.5 deg. Do not correct programs by its curve: 0.1 mm.')))
    assert told == ('Turn 0.5°. <strong>Do not correct programs by its curve: 0.1 mm.</strong>')
    assert warned('Turn.') == ['Turn.']


@pytest.fixture(scope='module', params=[diagnoses.backlash, diagnoses.unknown])
def made(request):
    return request.param()


@pytest.mark.parametrize('width', [40, 80, 140])
def test_no_word_is_broken(made, width, capsys):
    wide, narrow = (Console(highlight=False, width=w) for w in (400, width))
    print_summary(made, wide)
    whole = set(capsys.readouterr().out.split())
    print_summary(made, narrow)
    shown = capsys.readouterr().out
    assert max(map(len, shown.splitlines())) <= width
    heads = {f'{word}:' for word in whole} | {'error:'}
    assert [word for word in shown.split() if word not in whole | heads] == []
