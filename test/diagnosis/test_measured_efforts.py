# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Springs by measured efforts, and where soft springs rest."""

import json
from dataclasses import replace

import numpy as np
import pytest
from command_line import done, refused
from diagnosis_cells import all_but

from weld_twin_core import JointMotion, Measurements, Recording, Twin, load
from weld_twin_core.arm.known_arms import fingerprint
from weld_twin_core.diagnosis.soundness.mending import Given, joints_as
from weld_twin_core.effects import JointCompliance, Payload, effects_from_list
from weld_twin_core.recording import JointSignal
from weld_twin_lab.plant.compliance import Compliant
from weld_twin_lab.plant.exponentials import Command, arm_from
from weld_twin_lab.plant.flaws import LIBRARY, causes_from
from weld_twin_lab.plant.plant import run
from weld_twin_lab.plant.tracker import Tracker
from weld_twin_msgs_py.bags import BagReader, read_recording, write_recording
from weld_twin_msgs_py.files.diagnosis_model import load_model
from weld_twin_msgs_py.messages.topics import TopicNames
from weld_twin_nodes.streams.twin_stream import JointStream

ROBOT = load('ur10e')
SOFT = {'shoulder_lift_joint': 6e-6, 'elbow_joint': 1e-5}
CAUSES = [
    {'effect': 'joint_compliance', 'joint': joint, 'compliance': value}
    for joint, value in SOFT.items()
]
KINDS = ('joint_compliance', 'joint_offset', 'gear_ratio', 'payload')
SIGMA = 2e-5
COUNT = 45


def by_effort(folder):
    """Return the command that diagnoses by measured efforts."""
    words = ('diagnose', folder / 'bag', '--robot', 'ur10e', '--align', 'base,tool')
    return *words, '--use-effort', '--exclude-effect', *all_but(*KINDS), '--out', folder / 'found'


def pulled(seed=3, payload=0.0):
    """Return stations of an arm that somebody pulls at its tool by up to 90 N; nobody records that."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-1.4, 1.4, (COUNT, 6)) + [0.0, -1.2, 1.0, 0.0, 0.0, 0.0]
    t = np.arange(float(COUNT))
    wrench = np.hstack([rng.uniform(-90.0, 90.0, (COUNT, 3)), np.zeros((COUNT, 3))])
    causes = [*CAUSES, {'effect': 'payload', 'mass': payload, 'com': [0.0, 0.0, 0.1]}]
    if payload:
        wrench *= 0.0
    robot = ROBOT.to_mapping()
    command = Command(t, q, static=True, wrench=wrench)
    seen = run(robot, causes, command, Tracker(sigma=SIGMA, orientation=False), rng, 0.0)
    arm = arm_from(robot)
    plant = Compliant(robot, arm, causes_from(causes, arm, LIBRARY), 0.0)
    torque = plant.torque(q + plant.sag(q, wrench), wrench)
    torque += rng.normal(scale=0.2, size=torque.shape)
    measured = Measurements(t, seen.position)
    return Recording(
        'pulled', JointMotion(t, q, static=True), measured, effort=JointSignal(t, -torque)
    )


@pytest.fixture(scope='module')
def cell(tmp_path_factory):
    """A bag with the efforts, its diagnosis by them, and what was told."""
    folder = tmp_path_factory.mktemp('efforts')
    write_recording(folder / 'bag', pulled(), ROBOT)
    done(*by_effort(folder))
    return folder


def read(path):
    return json.loads(path.read_text())


def test_springs_by_effort_explain_a_pull_that_nobody_recorded(cell):
    found = read(cell / 'found' / 'diagnosis.json')
    springs = {
        each['joint']: each
        for each in found['model']['found']
        if each['effect'] == 'joint_compliance'
    }
    assert found['model']['statics'] == 'effort'
    for joint, value in SOFT.items():
        assert springs[joint]['statics'] == 'effort'
        assert springs[joint]['compliance'] == pytest.approx(value, rel=0.1)
    assert found['shrink']['rms_after_m'] < 2.0 * SIGMA * 3**0.5
    assert found['efforts']['holds'] and found['efforts']['correlation'] > 0.5


def test_the_same_springs_by_statics_do_not():
    seen = pulled()
    springs = effects_from_list(CAUSES, ROBOT)
    off = seen.measured.position - Twin(ROBOT, springs).poses(seen).position
    assert np.median(np.linalg.norm(off, axis=1)) > 5.0 * SIGMA * 3**0.5


def test_a_model_by_effort_is_replayed_by_it_and_refuses_without(cell, tmp_path):
    words = ('--robot', 'ur10e', '--model', cell / 'found' / 'diagnosis.json')
    said = done('simulate', cell / 'bag', *words, '--out', tmp_path / 'twin')
    assert float(said.split('RMS ')[1].split(' mm')[0]) < 0.07
    bare = replace(read_recording(cell / 'bag', ROBOT), effort=None)
    write_recording(tmp_path / 'bare', bare, ROBOT)
    said = refused('simulate', tmp_path / 'bare', *words, '--out', tmp_path / 'none')
    assert 'the joint state tells no effort' in said
    assert not (tmp_path / 'none').exists()


def test_a_running_twin_takes_the_efforts_as_the_twin_over_the_bag_does(cell):
    twin = load_model(ROBOT, cell / 'found' / 'diagnosis.json')
    offline = twin.poses(read_recording(cell / 'bag', ROBOT, TopicNames(use_effort=True)))
    stream = JointStream(twin)
    with BagReader(cell / 'bag') as bag:
        live = [stream.step(message) for *_, message in bag.messages(['/joint_states'])]
    got = np.array([sample.poses.position for sample in live])
    np.testing.assert_allclose(got, offline.position, rtol=0.0, atol=1e-12)


def test_a_program_is_not_corrected_by_efforts_to_come(cell, tmp_path):
    program = tmp_path / 'joints.csv'
    program.write_text(','.join(ROBOT.joint_names) + '\n0,-1.2,1,0,0,0\n0.1,-1.2,1,0,0,0\n')
    words = ('--robot', 'ur10e', '--model', cell / 'found' / 'diagnosis.json')
    said = refused('correct', program, *words, '--out', tmp_path / 'better')
    assert 'a motion that is still to come has none' in said


def in_bag(tmp_path, effort, holds=True):
    recording = pulled(seed=4, payload=3.0)
    value = recording.effort.value * (1.0 if holds else -1.0)
    told = replace(recording, effort=JointSignal(recording.effort.t, effort(value)))
    write_recording(tmp_path / 'bag', told, ROBOT)
    return by_effort(tmp_path)


def test_a_payload_and_a_sign_show_in_the_efforts(tmp_path):
    done(*in_bag(tmp_path, lambda value: value, holds=False))
    found = read(tmp_path / 'found' / 'diagnosis.json')
    assert found['model']['statics'] == 'effort_reversed' and not found['efforts']['holds']
    first = found['efforts']['causes'][0]
    assert first['name'] == 'payload' and first['value'] == pytest.approx(3.0, abs=0.1)
    said = [check['sentence'] for check in found['checks'] if check['name'] == 'efforts']
    assert 'the load itself, not what holds it' in said[0] and '+3.0' in said[1]


@pytest.mark.parametrize(
    ('effort', 'said'),
    [
        (lambda value: 1e3 * value, 'N mm in the place of N m'),
        (np.zeros_like, 'never change, so nothing measured them'),
        (lambda value: 100.0 * value / (330.0, 330.0, 5.0, 54.0, 54.0, 54.0), 'per cent'),
    ],
)
def test_efforts_that_are_none_are_refused_in_one_sentence(tmp_path, effort, said):
    assert said in refused(*in_bag(tmp_path, effort))
    assert not (tmp_path / 'found').exists()


def test_efforts_go_with_joints_that_are_put_right():
    recording = pulled(seed=6)
    matrix = np.eye(6)[[0, 2, 1, 3, 4, 5]]
    matrix[4, 4], matrix[5, 5] = -1.0, np.pi / 180.0
    given = joints_as(Given((recording,), ROBOT), matrix, np.zeros(6))
    got, was = given.recordings[0].effort.value, recording.effort.value
    np.testing.assert_allclose(got, was[:, [0, 2, 1, 3, 4, 5]] * (1, 1, 1, 1, -1, 1))


ARM = load('ur10')
SPRINGS = dict(zip(ARM.joint_names[1:5], (4e-5, 6e-5, 2e-4, 2e-4), strict=True))


@pytest.fixture
def stations():
    rng = np.random.default_rng(5)
    q = rng.uniform(-1.5, 1.5, (30, 6)) + [0.0, -1.2, 1.0, 0.0, 0.0, 0.0]
    return Recording('stations', JointMotion(np.arange(30.0), q, static=True))


def test_twin_and_plant_agree_on_where_soft_springs_rest(stations):
    causes = [
        {'effect': 'joint_compliance', 'joint': joint, 'compliance': value}
        for joint, value in SPRINGS.items()
    ]
    causes.append({'effect': 'payload', 'mass': 4.0, 'com': [0.02, 0.0, 0.1]})
    command = Command(stations.joints.t, stations.joints.q, static=True)
    plant = run(ARM.to_mapping(), causes, command, Tracker(), np.random.default_rng(0), 0.0)
    springs = [JointCompliance(joint, value) for joint, value in SPRINGS.items()]
    effects = [*springs, Payload(4.0, (0.02, 0.0, 0.1))]
    rigid = Twin(ARM).poses(stations).position
    sag = np.linalg.norm(plant.position - rigid, axis=1)
    left = np.linalg.norm(plant.position - Twin(ARM, effects).poses(stations).position, axis=1)
    assert sag.max() > 5e-3
    assert left.max() < 2e-8  # the plant's springs stop after four rounds
    plain = [
        JointCompliance(joint, value, statics='first_order') for joint, value in SPRINGS.items()
    ]
    left = plant.position - Twin(ARM, [*plain, effects[-1]]).poses(stations).position
    assert np.linalg.norm(left, axis=1).max() > 1e-5


@pytest.mark.parametrize('statics', [None, 'equilibrium'])
def test_a_diagnosis_is_replayed_with_the_springs_it_was_made_with(stations, tmp_path, statics):
    frame = np.eye(4).tolist()
    found = [{'effect': 'joint_compliance', 'joint': 'elbow_joint', 'compliance': 6e-5}]
    model = {'kinematics': fingerprint(ARM), 'tool': frame, 'bases': [frame], 'found': found}
    if statics:
        model['statics'] = statics
    path = tmp_path / 'diagnosis.json'
    path.write_text(json.dumps({'schema': 'weld_twin/diagnosis/1', 'model': model}))
    spring = JointCompliance('elbow_joint', 6e-5, statics=statics or 'first_order')
    bare = ARM.with_frames(base=np.eye(4), tool=np.eye(4))
    expected = Twin(bare, [spring]).poses(stations).position
    got = load_model(ARM, path).poses(stations).position
    assert np.abs(got - expected).max() < 1e-12
