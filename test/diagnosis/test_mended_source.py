# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What --apply undid is undone again wherever its model meets the same source, and stands in the files.

The arm that is recorded is worked out row by row by the laboratory's plain arm, not by the twin.
"""

import json

import numpy as np
import pytest
from command_line import done
from diagnosis_cells import all_but

from weld_twin_core import JointMotion, Measurements, Recording, load
from weld_twin_lab.programs.plain import tool_pose
from weld_twin_msgs_py.bags import read_recording, write_recording
from weld_twin_msgs_py.messages.topics import TopicNames
from weld_twin_msgs_py.robots import read_robot_yaml, write_robot_yaml

ROBOT = load('kuka_kr6_r900')
OFF = np.array([0.0, 0.0, 1.4e-3, 0.0, 0.0, 0.0])
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
TOOL = np.array(ROBOT.T_flange_tool)
TOOL[:3, 3] = [0.05, -0.02, 0.21]
GIVEN = ROBOT.with_frames(tool=TOOL)


def diagnosed(words, out):
    others = ('--exclude-effect', *all_but('joint_offset', 'link_length', 'clock_offset'))
    done('diagnose', *words, '--apply', *others, '--out', out)


def true_points(q):
    return tool_pose(ROBOT, q, TOOL, OFF)[:, :3, 3]


def stations(seed, count=30):
    rng = np.random.default_rng(seed)
    home = np.array([0.1, -1.3, 1.6, 0.2, 0.9, 0.3])
    return rng, home + rng.uniform(-0.8, 0.8, (count, 6))


def still(q, points):
    t = 5.0 * np.arange(len(q))
    return Recording('still', JointMotion(t, q, static=True), Measurements(t, points))


def mixed(kind):
    """Return a recording with a mix-up, and the points that the instrument then reads."""
    rng, q = stations(5)
    points = true_points(q) + rng.normal(scale=2e-5, size=(len(q), 3))
    read = np.array(q)
    if kind == 'swap':
        read = read[:, [0, 1, 2, 4, 3, 5]]
    elif kind == 'zero':
        read[:, 4] -= np.pi / 2
    elif kind == 'turn':
        points = points @ TURN.T
    return still(read, points)


def late():
    """Return a motion whose measurements are stamped 0.4 s late."""
    rng = np.random.default_rng(8)
    t = np.arange(0.0, 8.0, 0.02)
    rates, phase = rng.uniform(0.6, 1.6, (2, 6)), rng.uniform(0.0, 6.0, (2, 6))
    q = 0.3 * np.sin(t[:, None, None] * rates + phase).sum(axis=1)
    q += [0.1, -1.3, 1.6, 0.2, 0.9, 0.3]
    points = true_points(q) + rng.normal(scale=2e-5, size=(len(q), 3))
    return Recording('run', JointMotion(t, q), Measurements(t + 0.4, points))


def apart(bag, source):
    """Return how far predicted poses are from what the instrument read at their stamps [m]."""
    made = read_recording(bag, GIVEN, TopicNames(pose='/twin/tool_pose'))
    given = read_recording(source, GIVEN)
    at = made.measured.t + (made.epoch_ns - given.epoch_ns) * 1e-9
    seen = given.measured
    inside = (at > seen.t[0] - 1e-6) & (at < seen.t[-1] + 1e-6)
    assert inside.sum() > 0.8 * at.size
    told = [np.interp(at[inside], seen.t, seen.position[:, k]) for k in range(3)]
    return np.median(np.linalg.norm(made.measured.position[inside] - np.transpose(told), axis=1))


@pytest.mark.parametrize('kind', ['zero', 'turn', 'late'])
def test_a_prediction_on_the_same_source_mends_it_as_the_diagnosis_did(kind, tmp_path):
    write_robot_yaml(tmp_path / 'robot.yaml', GIVEN)
    recording = late() if kind == 'late' else mixed(kind)
    write_recording(tmp_path / 'rec', recording, GIVEN)
    words = (tmp_path / 'rec', '--robot', tmp_path / 'robot.yaml')
    found = tmp_path / 'found'
    diagnosed(words, found)
    content = json.loads((found / 'diagnosis.json').read_text())
    assert content['unsound'][0]['applied'] and content['unsound'][0]['mend']['do']
    model = ('--model', found / 'diagnosis.json')
    said = done('simulate', *words, *model, '--out', tmp_path / 'out')
    assert float(said.split('RMS ')[1].split(' mm')[0]) < 0.06
    assert apart(tmp_path / 'out', tmp_path / 'rec') < 8e-5
    corrected = read_robot_yaml(found / 'robot.yaml')
    if kind in ('zero', 'turn'):
        # Zeros and the base are the arm's: the file takes the readings as they were recorded.
        q, points = recording.joints.q, recording.measured.position
        base = corrected.T_world_base
        own = (base @ tool_pose(corrected, q, TOOL))[:, :3, 3]
        assert np.median(np.linalg.norm(own - points, axis=1)) < 6e-5
    else:
        assert abs(corrected.theta[2] - ROBOT.theta[2] - OFF[2]) < 1e-4


@pytest.fixture(scope='module')
def swapped(tmp_path_factory):
    """Return a folder with a robot, a recording whose columns are swapped, and its diagnosis."""
    folder = tmp_path_factory.mktemp('swapped')
    write_robot_yaml(folder / 'robot.yaml', GIVEN)
    write_recording(folder / 'rec', mixed('swap'), GIVEN)
    words = (folder / 'rec', '--robot', folder / 'robot.yaml')
    diagnosed(words, folder / 'found')
    return folder


def test_a_source_that_was_put_right_meanwhile_is_left_as_it_is(swapped, tmp_path):
    _, q = stations(6, 12)
    write_recording(tmp_path / 'right', still(q, true_points(q)), GIVEN)
    words = ('--robot', swapped / 'robot.yaml', '--model', swapped / 'found' / 'diagnosis.json')
    said = done('simulate', tmp_path / 'right', *words, '--out', tmp_path / 'out')
    assert 'needs no mending any more' in said
    assert apart(tmp_path / 'out', tmp_path / 'right') < 6e-5


def test_commands_of_the_same_source_come_back_counted_as_they_came(swapped, tmp_path):
    order = [0, 1, 2, 4, 3, 5]
    _, q = stations(7, 12)
    commands = Recording('plan', JointMotion(5.0 * np.arange(12), q[:, order], static=True))
    write_recording(tmp_path / 'plan', commands, GIVEN)
    words = ('--robot', swapped / 'robot.yaml', '--model', swapped / 'found' / 'diagnosis.json')
    done('correct', tmp_path / 'plan', *words, '--out', tmp_path / 'better')
    better = read_recording(tmp_path / 'better', GIVEN).joints.q
    wanted = tool_pose(ROBOT, q, TOOL)[:, :3, 3]
    off = np.linalg.norm(true_points(better[:, order]) - wanted, axis=1)
    before = np.linalg.norm(true_points(q) - wanted, axis=1)
    assert np.median(off) < 6e-5 < 2e-4 < np.median(before)
