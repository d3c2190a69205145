# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Springs of twin and plant settle at one place, and diagnoses of older versions stay as they are."""

import json

import numpy as np
import pytest

from weld_twin_core import JointMotion, Recording, Twin, load
from weld_twin_core.arm.known_arms import fingerprint
from weld_twin_core.effects import JointCompliance, Payload
from weld_twin_lab.plant.exponentials import Command
from weld_twin_lab.plant.plant import run
from weld_twin_lab.plant.tracker import Tracker
from weld_twin_msgs_py.files.diagnosis_model import load_model

ROBOT = load('ur10')
SOFT = dict(zip(ROBOT.joint_names[1:5], (4e-5, 6e-5, 2e-4, 2e-4), strict=True))


@pytest.fixture
def stations():
    rng = np.random.default_rng(5)
    q = rng.uniform(-1.5, 1.5, (30, 6)) + [0.0, -1.2, 1.0, 0.0, 0.0, 0.0]
    return Recording('stations', JointMotion(np.arange(30.0), q, static=True))


def test_twin_and_plant_agree_on_where_soft_springs_rest(stations):
    causes = [
        {'effect': 'joint_compliance', 'joint': joint, 'compliance': value}
        for joint, value in SOFT.items()
    ]
    causes.append({'effect': 'payload', 'mass': 4.0, 'com': [0.02, 0.0, 0.1]})
    command = Command(stations.joints.t, stations.joints.q, static=True)
    plant = run(ROBOT.to_mapping(), causes, command, Tracker(), np.random.default_rng(0), 0.0)
    springs = [JointCompliance(joint, value) for joint, value in SOFT.items()]
    effects = [*springs, Payload(4.0, (0.02, 0.0, 0.1))]
    rigid = Twin(ROBOT).poses(stations).position
    sag = np.linalg.norm(plant.position - rigid, axis=1)
    left = np.linalg.norm(plant.position - Twin(ROBOT, effects).poses(stations).position, axis=1)
    assert sag.max() > 5e-3
    assert left.max() < 2e-8  # the plant's springs stop after four rounds
    plain = [JointCompliance(joint, value, statics='first_order') for joint, value in SOFT.items()]
    left = plant.position - Twin(ROBOT, [*plain, effects[-1]]).poses(stations).position
    assert np.linalg.norm(left, axis=1).max() > 1e-5


@pytest.mark.parametrize('statics', [None, 'equilibrium'])
def test_a_diagnosis_is_replayed_with_the_springs_it_was_made_with(stations, tmp_path, statics):
    frame = np.eye(4).tolist()
    found = [{'effect': 'joint_compliance', 'joint': 'elbow_joint', 'compliance': 6e-5}]
    model = {'kinematics': fingerprint(ROBOT), 'tool': frame, 'bases': [frame], 'found': found}
    if statics:
        model['statics'] = statics
    path = tmp_path / 'diagnosis.json'
    path.write_text(json.dumps({'schema': 'weld_twin/diagnosis/1', 'model': model}))
    spring = JointCompliance('elbow_joint', 6e-5, statics=statics or 'first_order')
    bare = ROBOT.with_frames(base=np.eye(4), tool=np.eye(4))
    expected = Twin(bare, [spring]).poses(stations).position
    got = load_model(ROBOT, path).poses(stations).position
    assert np.abs(got - expected).max() < 1e-12
