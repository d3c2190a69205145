# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the sheet says holds together: one figure for one thing, no unknown hidden, no word broken."""

import re
from dataclasses import replace

import diagnoses
import numpy as np
import pytest
from rich.console import Console
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.robot import Robot
from weld_twin_core.effects import effect_from_mapping
from weld_twin_nodes.wording.quantities import counted, in_short, short_rows
from weld_twin_report.report import print_summary
from weld_twin_report.report.charts import furthest
from weld_twin_report.report.controllers import correction
from weld_twin_report.report.page_data import components, sides_words
from weld_twin_report.report.to_do import warned

PLAY = diagnoses.backlash()


def plain(text):
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
    assert plain(sides_words(parts[3])).startswith('0.200 mm ahead')


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
