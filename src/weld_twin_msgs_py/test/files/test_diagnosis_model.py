# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a file of a diagnosis or an instrument may say."""

import json

import numpy as np
import pytest

from weld_twin_core import DataError, JointMotion, Measurements, ModelError, Recording, catalog
from weld_twin_msgs_py.files.diagnosis_model import read_diagnosis, read_model
from weld_twin_msgs_py.files.instruments import instrument, measured_by

ELBOW = {'effect': 'joint_offset', 'joint': 'elbow_joint'}
NAMED = {**ELBOW, 'parameters': {'offset': 2e-3}, 'std': {'offset': 1e-5}}


@pytest.mark.parametrize(
    'effects',
    [
        [{**NAMED, 'parameters': {'offset': -2e-3}}],
        [{**NAMED, 'joint': 'wrist_1_joint'}],
        [NAMED, {**NAMED, 'joint': 'wrist_1_joint'}],
        [],
    ],
    ids=['sign', 'joint', 'one more', 'taken out'],
)
def test_a_verdict_that_is_not_what_the_model_has_is_refused(tmp_path, effects):
    file = tmp_path / 'diagnosis.json'
    frame = np.eye(4).tolist()
    model = {'tool': frame, 'bases': [frame], 'found': [{**ELBOW, 'offset': 2e-3}]}
    verdict = {'effects': [NAMED], 'causes': [{'effect': 0}, {'effect': None}]}
    content = {'schema': 'weld_twin/diagnosis/2', 'model': model, 'verdict': verdict}
    robot = catalog.load('ur5')
    file.write_text(json.dumps(content))
    assert read_model(robot, file).named == (('joint_offset', 'elbow_joint'),)
    verdict['effects'] = effects
    file.write_text(json.dumps(content))
    with pytest.raises(ModelError, match='effects was changed by hand') as told:
        read_model(robot, file)
    assert str(file) in str(told.value)


@pytest.mark.parametrize('moved', [0.0, 1e-3], ids=['one base', 'bases of their own'])
def test_the_arm_of_a_later_recording_has_what_changed(tmp_path, moved):
    file, robot = tmp_path / 'diagnosis.json', catalog.load('ur5')
    first, second = np.eye(4), np.eye(4)
    second[0, 3] = moved
    model = {'tool': np.eye(4).tolist(), 'bases': [first.tolist(), second.tolist()], 'found': []}
    pose = {'xyz': [moved, 0.0, 0.0], 'rotvec': [0.0, 0.0, 0.0]}
    changed = [
        {'recording': 1, **ELBOW, 'value': 5e-4, 'std': 1e-5},
        {'recording': 1, 'effect': 'tool_pose', 'joint': None, 'value': pose, 'std': pose},
        {'recording': 1, 'effect': 'base_pose', 'joint': None, 'value': pose, 'std': pose},
    ]
    content = {'schema': 'weld_twin/diagnosis/2', 'model': model, 'changed': changed}
    file.write_text(json.dumps(content))
    read = read_model(robot, file)
    assert read.twin(0).effects == ()
    # A base of its own already stands where that recording had it.
    names = ['joint_offset', 'tool_pose'] + ['base_pose'] * (moved == 0.0)
    offset, tool, *_ = effects = read.twin(1).effects
    assert [effect.name for effect in effects] == names
    assert offset.offset == 5e-4 and list(tool.xyz) == pose['xyz']


@pytest.mark.parametrize(
    ('key', 'value', 'said'),
    [
        ('verdict', [], 'verdict needs a mapping, and has []'),
        ('verdict', {'indistinguishable': [None]}, 'verdict.indistinguishable[0] needs a list'),
        ('verdict', {'indistinguishable': [[{}]]}, 'indistinguishable[0][0].effect needs a text'),
        ('verdict', {'effects': [{'effect': 'wear'}]}, 'effects[0].parameters needs a mapping'),
        ('verdict', {'sure': 1}, 'verdict.sure needs true or false, and has 1'),
        ('gap', {'rms_m': True}, 'gap.rms_m needs a number, and has true'),
        ('unsound', [None], 'unsound[0] needs a mapping, and has null'),
        ('model', {'epochs_ns': [0.5]}, 'model.epochs_ns[0] needs a whole number, and has 0.5'),
        ('inputs', [{'use': 'robot', 'path': 'a' * 99}], 'inputs[0].sha256 needs a text'),
    ],
)
def test_a_value_of_another_type_is_refused_where_the_file_is_read(tmp_path, key, value, said):
    file = tmp_path / 'diagnosis.json'
    file.write_text(json.dumps({'schema': 'weld_twin/diagnosis/2', key: value}))
    with pytest.raises(ModelError, match='take the file as weld-twin diagnose wrote it') as told:
        read_diagnosis(file)
    assert said in str(told.value) and str(file) in str(told.value)


POINTS = np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 2.0]])
"""Five and two metres away."""


def recording():
    t = np.arange(2.0)
    return Recording(
        'cell', JointMotion(t, np.zeros((2, 6)), static=True), Measurements(t, POINTS)
    )


@pytest.mark.parametrize(
    ('told', 'sigma'),
    [
        # Half of 15 um and 6 um for every metre.
        ('at960', [22.5e-6, 13.5e-6]),
        ('AT960@3', [16.5e-6, 16.5e-6]),
        ('0.015+0.006/m', [22.5e-6, 13.5e-6]),
        ('0.1+0.02/m@1', [60e-6, 60e-6]),
        ('0.05', [25e-6, 25e-6]),
    ],
)
def test_a_standard_deviation_is_half_of_what_is_permitted(told, sigma):
    seen = measured_by(recording(), instrument(told), own_frame=True).measured
    np.testing.assert_allclose(seen.sigma, sigma, rtol=1e-12)
    np.testing.assert_array_equal(seen.position, POINTS)


@pytest.mark.parametrize('told', ['at96', '', '0.015+', '-0.1', '0', '1..2', '20', 'at960@x'])
def test_what_is_no_instrument_is_refused_in_a_sentence(told):
    with pytest.raises(DataError, match='such as 0') as said:
        instrument(told)
    assert '\n' not in str(said.value)


def test_a_distance_is_asked_for_where_the_frame_is_not_the_instruments():
    with pytest.raises(DataError, match='at960@3'):
        measured_by(recording(), instrument('at960'), own_frame=False)
    plain = measured_by(recording(), instrument('0.06'), own_frame=False)
    assert plain.measured.sigma is not None
