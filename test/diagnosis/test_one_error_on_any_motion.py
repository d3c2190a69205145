# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A zero that is a tilt of axes on any motion is told as the zero, which a person can set."""

import csv
import json

import numpy as np
import pytest
from command_line import done
from diagnosis_cells import all_but

from weld_twin_core.arm.catalog import load
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_lab.programs.plain import tool_pose
from weld_twin_msgs_py.bags import write_recording
from weld_twin_msgs_py.files.diagnosis_model import read_model
from weld_twin_msgs_py.robots import read_robot_yaml

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
