# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A robot on a track beside a positioner, from a table to the corrected files, at the command line.

The lab's plant moves the robot and the positioner each for itself; what the instrument on the table
sees is the one in the other.
"""

import csv
import json
import re

import numpy as np
import pytest
import yaml
from command_line import done, refused, weld_twin
from diagnosis_cells import all_but
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.robot import Robot
from weld_twin_lab.plant.exponentials import Command
from weld_twin_lab.plant.plant import run
from weld_twin_lab.plant.tracker import Tracker
from weld_twin_msgs_py.robots import read_urdf, write_urdf

QUARTER = 0.5 * np.pi
COUNT, SIGMA = 60, 2e-5
OTHERS = all_but('joint_offset', 'joint_compliance', 'gear_ratio', 'link_length', 'root_pose')
ROBOT = {
    'name': 'cell',
    'joints': [
        {'name': 'rail', 'type': 'prismatic', 'alpha': QUARTER, 'lower': -2.0, 'upper': 2.0},
        {'name': 's', 'a': 0.15, 'd': 0.45, 'alpha': -QUARTER},
        {'name': 'l', 'a': 0.6},
        {'name': 'u', 'a': 0.12, 'alpha': -QUARTER},
        {'name': 'r', 'd': 0.64, 'alpha': 1.1},
    ],
    'base': {'xyz': [0.0, 0.0, 0.3], 'quat_xyzw': [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]},
    'gravity': [0.0, 9.80665, 0.0],
    'tool': {'xyz': [0.05, 0.02, 0.3]},
}
TABLE = {
    'base': {'xyz': [1.4, 0.2, 0.7], 'quat_xyzw': [0.0, -(0.5**0.5), 0.0, 0.5**0.5]},
    'joints': [
        {'name': 'tilt', 'a': 0.1, 'd': 0.2, 'alpha': QUARTER},
        {'name': 'turn', 'd': -0.1, 'theta_offset': 0.3},
    ],
    'links': [{'mass': 90.0, 'com': [0.1, 0.0, 0.0]}, {'mass': 60.0, 'com': [0.0, 0.15, 0.1]}],
    'tool': {'xyz': [0.1, 0.05, 0.08], 'quat_xyzw': [0.0, 0.0, 0.6, 0.8]},
}
NAMES = ('turn', 'tilt', 'rail', 's', 'l', 'u', 'r')


def table_of(place, robot_errors, table_errors, seed):
    """Write a table of stations as a cell logs them: degrees, and the rail in mm."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-1.0, 1.0, (COUNT, 7)) * [3.0, 1.2, 1.5, 1.2, 0.6, 1.0, 2.5]
    q += [0.0, 0.0, 0.0, 0.0, -1.0, 0.8, 0.0]
    t, exact = 20.0 * np.arange(COUNT), Tracker()
    arm = run(ROBOT, robot_errors, Command(t, q[:, 2:], static=True), exact, rng)
    foot = Rotation.from_quat(TABLE['base']['quat_xyzw'])
    own = TABLE | {'gravity': foot.inv().apply([0.0, 0.0, -9.80665]).tolist()}
    plate = run(own, table_errors, Command(t, q[:, [1, 0]], static=True), exact, rng)
    torch, table = Rotation.from_quat(arm.quaternion), Rotation.from_quat(plate.quaternion)
    seen = table.inv().apply(arm.position - plate.position) + rng.normal(
        scale=SIGMA, size=(COUNT, 3)
    )
    turned = table.inv() * torch * Rotation.from_rotvec(rng.normal(scale=SIGMA, size=(COUNT, 3)))
    shown = np.where(np.array(NAMES) == 'rail', 1e3 * q, np.degrees(q))
    heads = [f'{name} [{"mm" if name == "rail" else "deg"}]' for name in NAMES]
    with (place / 'cell.csv').open('w', encoding='utf-8') as file:
        rows = csv.writer(file)
        rows.writerow(['time [s]', *heads, 'x [mm]', 'y [mm]', 'z [mm]', 'qx', 'qy', 'qz', 'qw'])
        rows.writerows(np.column_stack([t, shown, 1e3 * seen, turned.as_quat()]).tolist())
    return q


@pytest.fixture
def robot_file(tmp_path):
    path = tmp_path / 'cell.yaml'
    path.write_text(yaml.safe_dump(ROBOT | {'workpiece': TABLE}), encoding='utf-8')
    return path


def diagnosed(place, robot, *more, without=OTHERS):
    bag, out = place / 'bag', place / 'found'
    done('import', place / 'cell.csv', '--robot', robot, *more, '--out', bag)
    words = ('--exclude-effect', *without) if without else ()
    said = done('diagnose', bag, '--robot', robot, *more, *words, '--out', out)
    return ' '.join(said.split()), json.loads((out / 'diagnosis.json').read_text('utf-8'))


def names(found):
    return [
        {(e['effect'], e['joint']) for e in one} for one in found['verdict']['indistinguishable']
    ]


def test_a_track_of_another_pitch_and_a_tilt_whose_zero_is_off(tmp_path, robot_file):
    """The tilt is one with a turn of the root; the track is told by name, in mm."""
    scale = {'effect': 'gear_ratio', 'joint': 'rail', 'scale': 4e-4}
    zero = {'effect': 'joint_offset', 'joint': 'tilt', 'offset': -6e-4}
    table_of(tmp_path, [scale], [zero], seed=11)
    said, found = diagnosed(tmp_path, robot_file, without=())
    sets = names(found)
    assert any({('joint_offset', 'tilt'), ('root_pose', None)} <= one for one in sets)
    assert any(('gear_ratio', 'rail') in one for one in sets)
    assert found['shrink']['ratio'] < 0.1
    page = (tmp_path / 'found' / 'report.html').read_text(encoding='utf-8')
    assert re.search(r'off by 0\.\d+ mm in every metre', page)
    assert 'mm further on every metre' in said
    assert 'measure where the positioner stands beside the robot' in said


def test_a_spring_of_the_tilt_is_told_and_the_urdf_is_given_back(tmp_path, robot_file):
    """Read from a URDF, up one branch and down the other; only the workpiece loads the tilt."""
    cell = Robot.from_mapping(yaml.safe_load(robot_file.read_text(encoding='utf-8')))
    write_urdf(tmp_path / 'cell.urdf', cell)
    spring = {'effect': 'joint_compliance', 'joint': 'tilt', 'compliance': 4e-6}
    zero = {'effect': 'joint_offset', 'joint': 'l', 'offset': 7e-4}
    table_of(tmp_path, [zero], [spring], seed=12)
    more = ('--base-link', 'world', '--tip-link', 'tool')
    _, found = diagnosed(tmp_path, tmp_path / 'cell.urdf', *more)
    told = {(e['effect'], e['joint']): e['parameters'] for e in found['verdict']['effects']}
    assert told['joint_compliance', 'tilt']['compliance'] == pytest.approx(4e-6, rel=0.1)
    assert told['joint_offset', 'l']['offset'] == pytest.approx(7e-4, rel=0.05)
    better = read_urdf(tmp_path / 'found' / 'robot.urdf', 'world', 'tool')
    assert better.joint_names == NAMES
    off = better.theta[4] - read_urdf(tmp_path / 'cell.urdf', 'world', 'tool').theta[4]
    assert off == pytest.approx(7e-4, rel=0.1)


def test_programs_without_external_axes_refuse_a_positioner_in_one_sentence(tmp_path, robot_file):
    (tmp_path / 'p.script').write_text('def p():\nend\n', encoding='utf-8')
    words = ('correct', tmp_path / 'p.script', '--robot', robot_file)
    said = refused(*words, '--out', tmp_path / 'o')
    assert said.startswith('weld-twin: external axes of urscript are not known here')
    assert '(turn, tilt)' in said
    assert not (tmp_path / 'o').exists()


MISTAKES = {
    'E1 in mm where m belong': ('units', 'rail'),
    'another fixture': ('wrong_fixture', 'base'),
}
FIXTURE = {'xyz': [-0.03, 0.12, 0.05], 'quat_xyzw': [0.0, 0.28, 0.0, 0.96]}
"""What the robot file has of the workpiece, while another one was on the table."""


@pytest.mark.parametrize('mistake', MISTAKES)
def test_a_mistake_of_a_cell_has_its_name(tmp_path, mistake):
    zero = {'effect': 'joint_offset', 'joint': 'u', 'offset': -8e-4}
    table_of(tmp_path, [zero], [], seed=41)
    table, cell = tmp_path / 'cell.csv', ROBOT | {'workpiece': TABLE}
    if mistake == 'another fixture':
        cell['workpiece'] = TABLE | {'tool': FIXTURE}
    if mistake == 'E1 in mm where m belong':
        table.write_text(table.read_text('utf-8').replace('rail [mm]', 'rail [m]'), 'utf-8')
    robot, bag, out = tmp_path / 'cell.yaml', tmp_path / 'bag', tmp_path / 'found'
    robot.write_text(yaml.safe_dump(cell), encoding='utf-8')
    done('import', table, '--robot', robot, '--out', bag)
    assert weld_twin('diagnose', bag, '--robot', robot, '--out', out).code == 3
    (told,) = json.loads((out / 'diagnosis.json').read_text(encoding='utf-8'))['unsound']
    assert (told['kind'], told['at']) == (MISTAKES[mistake][0], [MISTAKES[mistake][1]])
    if mistake == 'another fixture':
        numbers = re.findall(r'-?\d+\.\d+', told['remedy'])
        wanted = TABLE['tool']['xyz'] + TABLE['tool']['quat_xyzw']
        np.testing.assert_allclose([float(v) for v in numbers], wanted, atol=3e-3)


def test_a_positioner_that_stands_centimetres_elsewhere_is_no_other_robot(tmp_path, robot_file):
    table_of(tmp_path, [], [], seed=42)
    table = TABLE | {'base': TABLE['base'] | {'xyz': [1.43, 0.18, 0.71]}}
    robot_file.write_text(yaml.safe_dump(ROBOT | {'workpiece': table}), encoding='utf-8')
    _, found = diagnosed(tmp_path, robot_file)
    assert ('root_pose', None) in set().union(*names(found))
    (root,) = [e for e in found['verdict']['effects'] if e['effect'] == 'root_pose']
    rows = Rotation.from_quat(ROBOT['base']['quat_xyzw']).inv()
    wanted = rows.apply([-0.03, 0.02, -0.01])
    np.testing.assert_allclose(root['parameters']['xyz'], wanted, atol=3e-4)


def test_zeros_on_both_sides_are_not_told_as_a_root_for_sure(tmp_path, robot_file):
    """A track and a tilt whose zeros are off look together like a positioner that stands elsewhere."""
    slid = {'effect': 'joint_offset', 'joint': 'rail', 'offset': 4e-4}
    zero = {'effect': 'joint_offset', 'joint': 'tilt', 'offset': 6e-4}
    table_of(tmp_path, [slid], [zero], seed=43)
    _, found = diagnosed(tmp_path, robot_file)
    told = set().union(*names(found))
    assert {('joint_offset', 'rail'), ('joint_offset', 'tilt')} <= told
    assert found['verdict']['status'] == 'ambiguous'


def arm(prefix, base):
    """Return an arm of four joints that turn, under names of its own."""
    joints = [joint | {'name': f'{prefix}{k}'} for k, joint in enumerate(ROBOT['joints'][1:], 1)]
    return {'base': base, 'joints': joints, 'tool': ROBOT['tool']}


ARMS = {
    'left': arm('left_', {'xyz': [1.5, 0.1, 0.0], 'quat_xyzw': [0.0, 0.0, 1.0, 0.0]}),
    'right': arm('right_', {'xyz': [0.0, 0.0, 0.0], 'quat_xyzw': [0.0, 0.0, 0.0, 1.0]}),
}


def hand(one, q, off):
    """Return where an arm's tool is, from plain matrices, shape (N, 4, 4)."""

    def placed(xyz, turn):
        out = np.zeros((*turn.as_matrix().shape[:-2], 4, 4))
        out[..., :3, :3], out[..., :3, 3], out[..., 3, 3] = turn.as_matrix(), xyz, 1.0
        return out

    pose = placed(one['base']['xyz'], Rotation.from_quat(one['base']['quat_xyzw']))
    for row, value in zip(one['joints'], q.T, strict=True):
        about = (value + off.get(row['name'], 0.0))[:, None] * [0.0, 0.0, 1.0]
        turned = placed([0.0, 0.0, row.get('d', 0.0)], Rotation.from_rotvec(about))
        twist = Rotation.from_rotvec([row.get('alpha', 0.0), 0.0, 0.0])
        pose = pose @ turned @ placed([row.get('a', 0.0), 0.0, 0.0], twist)
    return pose @ placed(one['tool']['xyz'], Rotation.identity())


def joined(goal, off, rng):
    """Return postures in which the real ball of the right arm is at a place in the left hand."""
    middle, wide = np.array([0.0, -0.8, 0.9, 0.0] * 2), [0.8, 0.4, 0.5, 1.5] * 2
    q = middle + rng.uniform(-1.0, 1.0, (len(goal), 8)) * wide

    def away(q):
        left, right = hand(ARMS['left'], q[:, :4], off), hand(ARMS['right'], q[:, 4:], off)
        return np.einsum('nji,nj->ni', left[:, :3, :3], right[:, :3, 3] - left[:, :3, 3]) - goal

    for _ in range(30):
        slope = np.stack([(away(q + 1e-6 * e) - away(q)) / 1e-6 for e in np.eye(8)], axis=-1)
        step = np.einsum('nij,nj->ni', np.linalg.pinv(slope), -away(q))
        q = q + step * np.minimum(1.0, 0.3 / np.abs(step).max(axis=1, keepdims=True).clip(1e-9))
    return q[np.abs(away(q)).max(axis=1) < 1e-9]


def test_two_arms_calibrate_each_other_by_a_ball_in_sockets(tmp_path):
    rng = np.random.default_rng(51)
    off = {'right_3': 1.3e-3, 'left_2': -9e-4}
    places = {'one': [0.0, 0.0, 0.12], 'two': [0.06, 0.0, 0.12], 'three': [0.0, 0.07, 0.14]}
    rows = []
    for label, place in places.items():
        q = joined(np.tile(place, (60, 1)), off, rng)[:24]
        rows += [[*np.degrees(one + rng.normal(scale=1e-5, size=8)), label] for one in q]
    heads = [f'{joint["name"]} [deg]' for one in ARMS.values() for joint in one['joints']]
    with (tmp_path / 'touches.csv').open('w', encoding='utf-8') as file:
        csv.writer(file).writerows([[*heads, 'contact'], *rows])
    artefact, robot = tmp_path / 'sockets.yaml', tmp_path / 'pair.yaml'
    ties = [{'between': ['one', 'two'], 'value': 0.06, 'sigma': 5e-5}]
    sockets = {label: {'kind': 'point'} for label in places}
    artefact.write_text(yaml.safe_dump({'contacts': sockets, 'distances': ties}))
    robot.write_text(json.dumps(ARMS['right'] | {'workpiece': ARMS['left']}))
    words = ('import', tmp_path / 'touches.csv', '--contacts', artefact, '--robot', robot)
    done(*words, '--out', tmp_path / 'bag')
    words = ('diagnose', tmp_path / 'bag', '--robot', robot, '--align', 'tool')
    words += ('--exclude-effect', *OTHERS)
    done(*words, '--out', tmp_path / 'found')
    found = json.loads((tmp_path / 'found' / 'diagnosis.json').read_text(encoding='utf-8'))
    for joint, offset in off.items():
        assert any(('joint_offset', joint) in one for one in names(found))
        told = [e for e in found['verdict']['effects'] if e['joint'] == joint]
        assert [e['parameters']['offset'] for e in told] == [pytest.approx(offset, rel=0.1)]
    assert len(found['verdict']['effects']) == len(off)
