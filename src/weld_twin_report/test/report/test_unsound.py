# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Data and set-up that are wrong: what diagnose says, leaves behind and mends."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from command_line import done, refused

from weld_twin_core.arm.catalog import load
from weld_twin_core.diagnosis import diagnose
from weld_twin_core.effects import REGISTRY, effects_from_list
from weld_twin_core.errors import ModelError
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_core.twin.twin import Twin
from weld_twin_msgs_py.bags import write_recording
from weld_twin_nodes.cli.in_process import weld_twin

OFFSET = 2e-3
OTHERS = ('--exclude-effect', *(REGISTRY.keys() - {'joint_offset'}))
"""Kinds that need not be tried where it is about data that are wrong: the fewer, the sooner."""
MODEL_FILES = ('effects.yaml', 'robot.yaml', 'robot.urdf', 'joint_offsets.csv')


def measured(seed, seconds=9.0, rate=30.0):
    """Return a motion of a UR5 whose elbow zero is off, with its measured points."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, seconds, 1.0 / rate)
    rates = rng.uniform(0.5, 1.6, (2, 6))
    phase = rng.uniform(0.0, 6.0, (2, 6))
    waves = np.sin(t[:, None, None] * rates + phase)
    q = 0.3 * waves.sum(axis=1) + [0.2, -1.2, 1.4, -1.0, -1.5, 0.4]
    effects = effects_from_list(
        [{'effect': 'joint_offset', 'joint': 'elbow_joint', 'offset': OFFSET}], load('ur5')
    )
    motion = JointMotion(t, q)
    at = t[2:-2]
    poses = Twin(load('ur5'), effects).poses(Recording('run', motion), at)
    seen = Measurements(at, poses.position + rng.normal(size=poses.position.shape) * 2e-5)
    return Recording('run', motion, seen)


def swapped(recording):
    q = recording.joints.q[:, [0, 1, 2, 5, 4, 3]]
    return replace(recording, joints=replace(recording.joints, q=q))


@pytest.fixture(scope='module')
def bags(tmp_path_factory):
    folder = tmp_path_factory.mktemp('unsound')
    sound = measured(1)
    write_recording(folder / 'sound', sound, load('ur5'))
    write_recording(folder / 'copy', replace(sound, name='another name'), load('ur5'))
    write_recording(folder / 'swapped', swapped(sound), load('ur5'))
    return folder


@pytest.fixture(scope='module')
def found(bags):
    words = ('diagnose', bags / 'sound', '--robot', 'ur5', *OTHERS)
    done(*words, '--out', bags / 'found')
    return bags / 'found'


def content(place):
    return json.loads((place / 'diagnosis.json').read_text())


@pytest.fixture(scope='module')
def unsound(bags, found):
    """What is left of a diagnosis, and said, after one of a recording with two joints swapped."""
    out = bags / 'unsound'
    shutil.copytree(found, out)
    assert all((out / name).exists() for name in MODEL_FILES)
    said = weld_twin('diagnose', bags / 'swapped', '--robot', 'ur5', '--out', out)
    assert said.code == 3
    return out, said.out


def test_a_mistake_is_the_whole_answer_and_leaves_no_model(unsound):
    out, told = unsound
    first = told.split('\n\n')[0]
    assert first.startswith('Unsound data') and 'swapped' in first
    ours = ['.weld_twin_files.json', 'diagnosis.json', 'report.html']
    assert sorted(path.name for path in out.iterdir()) == ours
    said = content(out)
    assert said['verdict']['status'] == 'unsound'
    assert said['verdict']['effects'] == [] and said['verdict']['confidence'] is None
    assert said['gap'] is said['candidates'] is said['shrink'] is said['model'] is None
    (item,) = said['unsound']
    assert item['kind'] == 'joints_swapped' and item['applied'] is False
    assert sorted(item['at']) == ['wrist_1_joint', 'wrist_3_joint']
    page = (out / 'report.html').read_text()
    heading = page.split('<h1>')[1].split('</h1>')[0]
    assert 'swapped' in heading and 'sure' not in heading
    assert 'What to do' not in page and 'What to measure next' not in page


def test_apply_mends_it_and_every_output_says_so(bags, found, tmp_path):
    out = tmp_path / 'd'
    words = ('diagnose', bags / 'swapped', '--robot', 'ur5', '--apply', *OTHERS)
    assert 'mended before the diagnosis' in ' '.join(done(*words, '--out', out).split())
    said, sound = content(out), content(found)
    assert [item['applied'] for item in said['unsound']] == [True] and sound['unsound'] == []
    assert said['verdict']['effects'] == sound['verdict']['effects']
    assert 'Mended before the diagnosis' in (out / 'report.html').read_text()
    for name in MODEL_FILES:
        assert 'swapped' in (out / name).read_text(), name
        assert 'swapped' not in (found / name).read_text(), name
    again = tmp_path / 'exported.yaml'
    done('export', out / 'diagnosis.json', '--robot', 'ur5', '--out', again)
    assert 'swapped' in again.read_text()


def test_a_zero_of_a_joint_that_was_recorded_the_other_way_says_whose_sign_it_has(found, tmp_path):
    sound = measured(1)
    turned = sound.joints.q * [1.0, 1.0, -1.0, 1.0, 1.0, 1.0]
    away = replace(sound, joints=replace(sound.joints, q=turned))
    write_recording(tmp_path / 'bag', away, load('ur5'))
    out = tmp_path / 'd'
    words = ('diagnose', tmp_path / 'bag', '--robot', 'ur5', '--apply', *OTHERS)
    done(*words, '--out', out)
    (action,) = content(out)['verdict']['actions']
    assert 'elbow_joint stands at X + 0.11' in action
    needed = 'as it was recorded needs the opposite sign'
    for told in (
        action,
        *((out / name).read_text() for name in ('joint_offsets.csv', 'report.html')),
    ):
        assert needed in told
    assert needed not in (found / 'joint_offsets.csv').read_text() + str(content(found))


JOINT_MOVE = 'def p():\n  movej([0.1, -1.3, 1.5, -1.8, -1.5, 0.0])\nend\n'


def test_a_table_of_a_joint_that_its_controller_counts_the_other_way_is_remembered(tmp_path):
    recording = measured(1)
    points, robot = recording.measured, load('ur5')
    q = recording.joints.at(points.t)[0] * [1.0, 1.0, -1.0, 1.0, 1.0, 1.0]
    rows = np.column_stack([points.t, q, points.position])
    head = ','.join(['time [s]', *(f'{name} [rad]' for name in robot.joint_names), 'x', 'y', 'z'])
    np.savetxt(tmp_path / 'shown.csv', rows, delimiter=',', header=head, comments='')
    words = ('import', tmp_path / 'shown.csv', '--robot', 'ur5', '--joint-signs', '1,1,-1,1,1,1')
    done(*words, '--length-unit', 'm', '--out', tmp_path / 'bag')
    out = tmp_path / 'd'
    done('diagnose', tmp_path / 'bag', '--robot', 'ur5', *OTHERS, '--out', out)
    (action,) = content(out)['verdict']['actions']
    assert 'elbow_joint stands at X + 0.1' in action
    for told in (action, (out / 'joint_offsets.csv').read_text()):
        assert 'as it was recorded needs the opposite sign' in told
    program = tmp_path / 'p.script'
    program.write_text(JOINT_MOVE)
    words = ('correct', program, '--robot', 'ur5', '--model', out / 'diagnosis.json')
    said = refused(*words, '--out', tmp_path / 'better')
    assert 'line 2: the controller counts elbow_joint otherwise' in said
    words = ('investigate', tmp_path / 'plan', '--robot', 'ur5', '--model', out / 'diagnosis.json')
    words = (*words, '--tolerance', '0.3', '--postures', '3', '--minutes', '9')
    said = refused(*words, '--controller', 'urscript')
    assert 'the controller counts elbow_joint otherwise' in said
    done(*words)


def test_nothing_is_predicted_from_unsound_data(bags, unsound, tmp_path):
    model = unsound[0] / 'diagnosis.json'
    words = ('simulate', bags / 'sound', '--robot', 'ur5', '--model', model)
    said = refused(*words, '--out', tmp_path / 'p')
    assert 'its data were unsound' in said and 'swapped' in said


@pytest.mark.parametrize('command', ['simulate', 'correct', 'export'])
def test_the_model_of_another_robot_is_refused(found, bags, tmp_path, command):
    model = found / 'diagnosis.json'
    words = {
        'simulate': ('simulate', bags / 'sound', '--model', model),
        'correct': ('correct', bags / 'sound', '--model', model),
        'export': ('export', model),
    }[command]
    said = refused(*words, '--robot', 'ur10', '--out', tmp_path / 'x')
    assert "of the robot 'ur5', not of 'ur10'" in said
    assert not (tmp_path / 'x').exists()


def test_a_sibling_under_the_same_name_is_refused(found, tmp_path):
    done('export', found / 'diagnosis.json', '--robot', 'ur5', '--out', tmp_path / 'own.yaml')
    text = (tmp_path / 'own.yaml').read_text().replace('-0.39225', '-0.41')
    (tmp_path / 'sibling.yaml').write_text(text)
    words = ('export', found / 'diagnosis.json', '--robot', tmp_path / 'sibling.yaml')
    assert 'kinematics differ' in refused(*words, '--out', tmp_path / 'x')


def test_a_file_that_says_nothing_of_its_robot_is_taken_as_before(found, tmp_path):
    said = content(found)
    del said['model']['robot'], said['model']['kinematics']
    (tmp_path / 'diagnosis.json').write_text(json.dumps(said))
    words = ('export', tmp_path / 'diagnosis.json', '--robot', 'ur5')
    done(*words, '--out', tmp_path / 'x')


def test_a_recording_is_not_held_out_from_itself_under_any_name(bags, tmp_path):
    words = ('diagnose', bags / 'sound', '--robot', 'ur5', '--out', tmp_path / 'd')
    assert 'in common with' in refused(*words, '--holdout', bags / 'copy')
    assert not (tmp_path / 'd').exists()


def test_a_frame_to_align_that_is_none_is_one_sentence():
    with pytest.raises(ModelError, match="'flange' is neither"):
        diagnose([measured(3, seconds=6.0)], load('ur5'), align='flange')
