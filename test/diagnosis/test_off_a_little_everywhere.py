# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One error on any motion, and play beside a field of small errors."""

import csv
import json

import numpy as np
import pytest
from command_line import done
from diagnosis_cells import all_but, recorded

from weld_twin_core import JointMotion, Measurements, Recording, diagnose, load
from weld_twin_lab.blind.blind_cell import as_recording
from weld_twin_lab.plant.exponentials import Command
from weld_twin_lab.plant.plant import run
from weld_twin_lab.plant.tracker import Tracker
from weld_twin_lab.programs.plain import tool_pose
from weld_twin_msgs_py.bags import write_recording
from weld_twin_msgs_py.files.diagnosis_model import read_model
from weld_twin_msgs_py.robots import read_robot_yaml

LITTLE = 2e-5
"""What every joint of a good arm is off by [rad]; links as much at half a metre."""
LOST = ('backlash', 'friction', 'hysteresis', 'loaded_play', 'gear_ratio_by_direction')


def flaws(robot, play, joint, seed):
    """Return play in one gear, a wrong zero, a twisted link, and what each joint is off by."""
    causes = [
        {'effect': 'backlash', 'joint': joint, 'width': play},
        {'effect': 'joint_offset', 'joint': robot.joint_names[2], 'offset': 8e-4},
        {'effect': 'link_twist', 'joint': robot.joint_names[0], 'dalpha': 5e-4},
    ]
    rng = np.random.default_rng(seed)
    for joint in robot.joint_names:
        zero, twist, longer, *wheels = LITTLE * rng.normal(size=5)
        causes += [
            {'effect': 'joint_offset', 'joint': joint, 'offset': zero},
            {'effect': 'link_twist', 'joint': joint, 'dalpha': twist},
            {'effect': 'link_length', 'joint': joint, 'da': 0.5 * longer},
        ]
        for order, wheel in enumerate(wheels, 1):
            wave = {'amplitude': abs(wheel), 'order': order, 'phase': rng.uniform(-3.0, 3.0)}
            causes.append({'effect': 'transmission_ripple', 'joint': joint, **wave})
    return causes


def lost_motion(diagnosis, joint):
    """Return the names of what depends on direction at a joint."""
    told = [c for c in diagnosis.causes if c.dependence and c.dependence[0][0] == 'direction']
    (cause,) = [c for c in told if c.place[0][0] == joint and c.probability > 0.5]
    return {site.effect for site, _ in cause.name if site.joint == joint}


def test_play_is_named_where_a_field_of_small_errors_is_left_beside_it():
    robot = load('kuka_kr16_2')
    seen = recorded(robot, flaws(robot, 6e-4, 'joint_a4', 3), seed=3)
    found = diagnose([seen], robot, experiment=False)
    assert found.status in ('identified', 'ambiguous')
    assert lost_motion(found, 'joint_a4') == {'backlash'}


def test_play_is_among_the_names_where_friction_may_take_a_wrong_zero_along():
    """The joint never rests: what friction loses more of one way is a constant, as its zero is."""
    robot, rng = load('ur5'), np.random.default_rng(2)
    play, joint = rng.uniform(3e-4, 7e-4), robot.joint_names[0]
    t = np.arange(0.0, 10.0, 0.025)
    home = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
    pace, turn = rng.uniform(0.5, 1.3, 6), rng.uniform(0.0, 2.0 * np.pi, 6)
    command = Command(t, home + 0.6 * np.sin(np.outer(t, pace) + turn))
    made = run(
        robot.to_mapping(), flaws(robot, play, joint, 2), command, Tracker(sigma=2e-5), rng, 0.0
    )
    others = all_but(*LOST, 'joint_offset', 'link_twist', 'link_length', 'transmission_ripple')
    told = diagnose([as_recording('run', made)], robot, exclude=others, experiment=False)
    assert 'backlash' in lost_motion(told, joint)


ROBOT, ZERO, SCALE = load('abb_irb1600'), 8e-4, 1.5e-3
KINDS = ('joint_offset', 'axis_parallelism', 'gear_ratio', 'link_length', 'link_twist')


@pytest.fixture(scope='module')
def answer(tmp_path_factory):
    """Return what is left of a diagnosis, and what it prints; the arm is worked out row by row."""
    folder = tmp_path_factory.mktemp('zero')
    rng = np.random.default_rng(4)
    low, high = np.maximum(ROBOT.lower, -2.0), np.minimum(ROBOT.upper, 2.0)
    q = 0.5 * (low + high) + rng.uniform(-0.35, 0.35, (40, 6)) * (high - low)
    tool = np.eye(4)
    tool[:3, 3] = [0.03, 0.02, 0.25]
    off = q * [0.0, SCALE, 0.0, 0.0, 0.0, 0.0] + [0.0, 0.0, ZERO, 0.0, 0.0, 0.0]
    points = tool_pose(ROBOT, q, tool, off)[:, :3, 3]
    t = 5.0 * np.arange(40)
    seen = Measurements(t, points + rng.normal(scale=2e-5, size=points.shape))
    given = Recording('cell', JointMotion(t, q, static=True), seen)
    write_recording(folder / 'rec', given, ROBOT.with_frames(tool=tool))
    words = ('diagnose', folder / 'rec', '--robot', 'abb_irb1600', '--align', 'base,tool')
    done(*words, '--exclude-effect', *all_but(*KINDS), '--out', folder / 'found')
    return folder / 'found'


def test_files_hold_the_zero(answer):
    rows = {r['joint']: r for r in csv.DictReader((answer / 'joint_offsets.csv').open())}
    assert float(rows['joint_3']['offset']) == pytest.approx(ZERO, abs=4e-5)
    robot = read_robot_yaml(answer / 'robot.yaml')
    assert robot.theta[2] - ROBOT.theta[2] == pytest.approx(ZERO, abs=4e-5)
    assert np.abs(robot.beta - ROBOT.beta).max() == 0.0
    assert ('joint_offset', 'joint_3') in read_model(ROBOT, answer / 'diagnosis.json').named


def test_the_zero_is_named_with_the_other_beside_it_and_no_motion_is_asked_for(answer):
    content = json.loads((answer / 'diagnosis.json').read_text())
    tilt = {'effect': 'axis_parallelism', 'joint': 'joint_3'}
    zero = {'effect': 'joint_offset', 'joint': 'joint_3'}
    assert content['verdict']['same_on_any_motion'] == [[zero, tilt]]
    assert [zero, tilt] in content['verdict']['indistinguishable']
    assert 'joint_offset' in {item['effect'] for item in content['verdict']['effects']}
    page = (answer / 'report.html').read_text()
    assert 'record other postures' not in page and 'Should it be' not in page
    assert 'zero offset of joint_3 (on any motion the same as axis parallelism error of' in page
    assert 'no measurement tells them apart, and mending the one mends the other' in page
