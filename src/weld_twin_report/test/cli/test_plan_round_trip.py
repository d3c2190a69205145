# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What `plan-measurement` says and writes; its table is read back for arms of every kind."""

import csv
import re

import numpy as np
import pytest
import yaml
from command_line import done, refused

from weld_twin_core import catalog, forward
from weld_twin_msgs_py.bags import read_recording
from weld_twin_msgs_py.files.joint_file import read_joint_motion, through_stations
from weld_twin_msgs_py.robots import load_robot, read_urdf, write_urdf

TURNS = [
    (0.0, -1.5708, 0.45),
    (0.55, 0.0, 0.0),
    (0.1, -1.5708, 0.0),
    (0.0, 1.5708, 0.6),
    (0.0, -1.5708, 0.0),
    (0.0, 0.0, 0.1),
]
"""a, alpha, d of an arm that turns."""
NAMES = {
    'a track': ['rail', 's1', 's2', 's3', 's4', 's5', 's6'],
    'a ram in the middle': ['j1', 'j2', 'j3', 'ram', 'j4', 'j5', 'j6'],
    'a slide at the end': ['a1', 'a2', 'a3', 'a4', 'a5', 'a6', 'z'],
    'names that end like units': ['axis_a', 'axis_m', 'axis_mm', 'axis_s', 'axis_deg', 'axis_x'],
    'names of Yaskawa': [f'joint_{k}_{c}' for k, c in enumerate('slurbt', 1)],
    'names like formulas': ['=1+1', '@a', '-b', '+c', 'd', 'e'],
}
SLIDES = {'a track': 0, 'a ram in the middle': 3, 'a slide at the end': 6}


def robot_file(path, kind):
    rows = [('revolute', *row, 2.9) for row in TURNS]
    if kind in SLIDES:
        rows.insert(
            SLIDES[kind], ('prismatic', 0.0, 1.5708 if SLIDES[kind] == 0 else 0.0, 0.0, 1.5)
        )
    keys = ('type', 'a', 'alpha', 'd', 'upper')
    joints = [
        {'name': name, **dict(zip(keys, row, strict=True)), 'lower': -row[-1], 'max_velocity': 1.0}
        for name, row in zip(NAMES[kind], rows, strict=True)
    ]
    tool = {'xyz': [0.05, 0.0, 0.2], 'rpy': [0.0, 0.5, 0.0]}
    base = {'xyz': [0.0, 0.0, 1.0], 'rpy': [0.0, 0.0, 0.0]}
    told = {'name': 'made', 'convention': 'standard', 'base': base, 'tool': tool, 'joints': joints}
    path.write_text(yaml.safe_dump(told))
    return path


@pytest.mark.parametrize('kind', NAMES)
def test_a_table_to_fill_in_comes_back_as_the_postures_planned(tmp_path, kind):
    file, out = robot_file(tmp_path / 'made.yaml', kind), tmp_path / 'plan'
    plan = ('investigate', '--robot', file, '--tolerance', 0.5, '--postures', 24)
    done(*plan, '--out', out)
    robot = load_robot(file)
    _, q, _ = read_joint_motion(out / 'stations.yaml', robot)
    assert len(q) == 24
    with open(out / 'measurements.csv', newline='') as table:
        head, *rows = csv.reader(table)
    assert not [cell for cell in head if cell[0] in '=+-@']
    seen = 1e3 * forward(robot, q)[:, :3, 3] + np.random.default_rng(2).normal(0.0, 0.03, (24, 3))
    with open(tmp_path / 'filled.csv', 'w', newline='') as table:
        write = csv.writer(table, delimiter=';')
        write.writerow(head)
        write.writerows([*row[:-3], *p.round(4)] for row, p in zip(rows, seen, strict=True))
    done('import', tmp_path / 'filled.csv', '--robot', file, '--out', tmp_path / 'b')
    back = read_recording(tmp_path / 'b', robot)
    np.testing.assert_allclose(back.joints.q, q, atol=2e-6)
    np.testing.assert_allclose(back.measured.position, 1e-3 * seen, atol=1e-6)


def test_no_program_is_written_for_an_axis_that_its_language_would_turn(tmp_path):
    file = robot_file(tmp_path / 'made.yaml', 'a track')
    plan = ('investigate', '--robot', file, '--tolerance', 0.5, '--postures', 24)
    result = refused(*plan, '--controller', 'rapid', '--out', tmp_path / 'plan')
    assert 'external axes of the controller the joints rail are' in result
    assert not (tmp_path / 'plan').exists()


@pytest.mark.parametrize(
    ('words', 'told'),
    [
        (('--postures', 8), '8 postures are asked for; a plan has 24 to 500'),
        (('--postures', 60, '--minutes', 3), '60 postures take '),
        ((), 'say with --minutes for how long there is time, or how many --postures'),
    ],
)
def test_a_number_of_postures_that_makes_no_plan_is_refused(words, told):
    assert told in refused('investigate', '--robot', 'ur5', '--tolerance', 0.3, *words)


ROBOT = catalog.load('kuka_kr6_r900')
WORDS = ('investigate', '--robot', 'kuka_kr6_r900', '--tolerance', 0.3)


def test_it_writes_stations_a_table_and_a_program_of_the_same_postures(tmp_path):
    out = tmp_path / 'plan'
    result = done(*WORDS, '--minutes', 9, '--controller', 'krl', '--out', out)
    count = int(re.search(r'^(\d+) poses, \d+ minutes', result, re.M)[1])
    _, q, stations = read_joint_motion(out / 'stations.yaml', ROBOT)
    assert stations and len(q) == count
    with open(out / 'measurements.csv', newline='') as file:
        rows = list(csv.reader(file))
    assert rows[0][-3:] == ['x [mm]', 'y [mm]', 'z [mm]']
    shown = np.array([[float(cell) for cell in row[1:7]] for row in rows[1:]])
    np.testing.assert_allclose(np.radians(shown), q, atol=1e-6)
    axes = re.findall(r'PTP \{A1 ([-\d.]+),', (out / 'measure.src').read_text())
    np.testing.assert_allclose(np.array(axes, float), shown[:, 0], atol=1e-4)


def test_a_urdf_that_leaves_limits_out_is_told_where_moves_are_planned_or_written(tmp_path):
    urdf, program = tmp_path / 'robot.urdf', tmp_path / 'stations.src'
    write_urdf(urdf, ROBOT)
    limits = re.findall('<limit .*?/>', urdf.read_text())
    bare = urdf.read_text().replace(limits[1], '').replace(limits[3], '<limit velocity="6.5"/>')
    one, other = ROBOT.joint_names[1], ROBOT.joint_names[3]
    position = f'the robot file has no limit of position for {one}, {other}, so none is kept'
    speed = f'no limit of speed for {one}, so motions are planned for 1.3 rad/s'
    words = ('investigate', '--tolerance', 0.3, '--postures', 24, '--out', tmp_path / 'plan')
    assert 'no limit' not in done(*words, '--robot', urdf, '--force')
    urdf.write_text(bare)
    result = done(*words, '--robot', urdf, '--force')
    assert position in result and speed in result
    stations = tmp_path / 'plan/stations.yaml'
    words = ('export', 'program', stations, '--robot', urdf, '--controller')
    assert position in done(*words, 'krl', '--out', program)
    assert position in (tmp_path / 'stations.src.md').read_text()
    assert speed in done(*words, 'urscript', '--out', tmp_path / 'stations.script')
    rates = re.findall(r'v=([^,]+)', (tmp_path / 'stations.script').read_text())
    assert rates and all(0.0 < float(rate) < 1.3 for rate in rates)
    robot = read_urdf(urdf)
    t, q, _ = read_joint_motion(stations, robot)
    speeds = np.abs(through_stations(robot, t, q, 50.0).velocity).max(axis=0)
    assert speeds[1] < 1.3 and speeds.max() > 0.2


def test_a_table_that_was_filled_in_outlives_another_plan(tmp_path):
    plan = (*WORDS, '--minutes', 9, '--out', tmp_path / 'plan')
    done(*plan)
    table, kept = tmp_path / 'plan/measurements.csv', tmp_path / 'plan/measurements.kept-1.csv'
    filled = table.read_text().replace(',,,\n', ',1,2,3\n')
    table.write_text(filled)
    said = refused(*plan)
    assert f"'{table}' was changed after weld-twin wrote it" in said
    assert "--force, which keeps it as 'measurements.kept-1.csv'" in said
    assert table.read_text() == filled
    done(*plan, '--force')
    assert kept.read_text() == filled and ',,,\n' in table.read_text()


def test_a_tolerance_out_of_reach_is_told():
    result = done(*WORDS[:3], '--tolerance', 0.02, '--minutes', 6, '--noise', 0.1)
    assert re.search(r'all \d+ poses that fit into the time keep 0.02 mm at \d+%', result)


@pytest.mark.parametrize(
    ('words', 'said'),
    [
        (('--minutes', 2), '24 are the fewest; give more time or shorter stations'),
        (('--minutes', 9, '--controller', 'krl'), 'say with --out where'),
        (('--minutes', 9, '--controller', 'basic'), "there is no language 'basic'; known are"),
        (('--minutes', 9, '--noise', -1), 'a tolerance, a noise and a spread above zero'),
        (('--minutes', 20_000), '--minutes at most 10000'),
    ],
)
def test_what_cannot_be_planned_is_one_sentence(words, said):
    assert said in refused(*WORDS, *words)
