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
from scipy.spatial.transform import Rotation

from weld_twin_core.arm.robot import Robot
from weld_twin_lab.plant.plant import run
from weld_twin_lab.plant.plant_recording import Command
from weld_twin_lab.plant.tracker import Tracker
from weld_twin_msgs_py.robots import read_urdf, write_urdf
from weld_twin_nodes.cli import main

QUARTER = 0.5 * np.pi
COUNT, SIGMA = 60, 2e-5
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


def commanded(*words):
    return main([str(word) for word in words])


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


def diagnosed(place, robot, *more):
    bag, out = place / 'bag', place / 'found'
    assert commanded('import', place / 'cell.csv', '--robot', robot, *more, '--out', bag) == 0
    assert commanded('diagnose', bag, '--robot', robot, *more, '--out', out) == 0
    return json.loads((out / 'diagnosis.json').read_text(encoding='utf-8'))


def names(found):
    return [
        {(e['effect'], e['joint']) for e in one} for one in found['verdict']['indistinguishable']
    ]


def test_a_track_of_another_pitch_and_a_tilt_whose_zero_is_off(tmp_path, robot_file, capfd):
    """The tilt is one with a turn of the root; the track is told by name, in mm."""
    scale = {'effect': 'gear_ratio', 'joint': 'rail', 'scale': 6e-4}
    zero = {'effect': 'joint_offset', 'joint': 'tilt', 'offset': -1.2e-3}
    table_of(tmp_path, [scale], [zero], seed=11)
    found = diagnosed(tmp_path, robot_file)
    sets = names(found)
    assert any({('joint_offset', 'tilt'), ('root_pose', None)} <= one for one in sets)
    assert any(('gear_ratio', 'rail') in one for one in sets)
    assert found['shrink']['ratio'] < 0.1
    said = ' '.join(capfd.readouterr().out.split())
    page = (tmp_path / 'found' / 'report.html').read_text(encoding='utf-8')
    assert re.search(r'off by 0\.\d+ mm in every metre', page)
    assert 'mm further on every metre' in said
    assert 'measure where the positioner stands beside the robot' in said


def test_a_spring_of_the_tilt_is_told_and_the_urdf_is_given_back(tmp_path, robot_file):
    """Read from a URDF, up one branch and down the other; only the workpiece loads the tilt."""
    cell = Robot.from_mapping(yaml.safe_load(robot_file.read_text(encoding='utf-8')))
    write_urdf(tmp_path / 'cell.urdf', cell)
    spring = {'effect': 'joint_compliance', 'joint': 'tilt', 'compliance': 4e-6}
    zero = {'effect': 'joint_offset', 'joint': 'l', 'offset': 1.5e-3}
    table_of(tmp_path, [zero], [spring], seed=12)
    more = ('--base-link', 'world', '--tip-link', 'tool')
    found = diagnosed(tmp_path, tmp_path / 'cell.urdf', *more)
    told = {(e['effect'], e['joint']): e['parameters'] for e in found['verdict']['effects']}
    assert told['joint_compliance', 'tilt']['compliance'] == pytest.approx(4e-6, rel=0.1)
    assert told['joint_offset', 'l']['offset'] == pytest.approx(1.5e-3, rel=0.05)
    better = read_urdf(tmp_path / 'found' / 'robot.urdf', 'world', 'tool')
    assert better.joint_names == NAMES
    off = better.theta[4] - read_urdf(tmp_path / 'cell.urdf', 'world', 'tool').theta[4]
    assert off == pytest.approx(1.5e-3, rel=0.1)


def test_programs_refuse_a_positioner_in_one_sentence(tmp_path, robot_file, capfd):
    (tmp_path / 'p.script').write_text('def p():\nend\n', encoding='utf-8')
    words = ('correct', tmp_path / 'p.script', '--robot', robot_file)
    assert commanded(*words, '--out', tmp_path / 'o') == 2
    said = capfd.readouterr().err
    assert said.startswith('weld-twin: a corrected program is not there yet for a workpiece that')
    assert '(turn, tilt)' in said
    assert said.count('\n') == 1
    assert not (tmp_path / 'o').exists()
