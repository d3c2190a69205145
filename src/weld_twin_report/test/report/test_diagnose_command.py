# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""diagnose, predict, export and compensate on a small simulated cell, from files to files."""

import csv
import hashlib
import json

import numpy as np
import pytest
import yaml
from command_line import done, refused
from scipy.stats import chi2

from weld_twin_core import JointMotion, Recording, Twin, load
from weld_twin_core.arm.known_arms import fingerprint
from weld_twin_core.effects import Backlash
from weld_twin_msgs_py.bags import BagReader, provenance, read_recording, write_recording
from weld_twin_msgs_py.files.diagnosis_model import load_model
from weld_twin_msgs_py.robots import read_robot_yaml, read_urdf
from weld_twin_nodes.cli.in_process import weld_twin

WIDTH, OFFSET, DELAY = 1.0e-3, 1.5e-3, 0.012
NOISE = np.sqrt(3) * 2e-5
FILES = {'diagnosis.json', 'report.html', 'effects.yaml', 'robot.yaml', 'robot.urdf'}
FILES |= {'joint_offsets.csv', 'robot_effects.yaml', '.weld_twin_files.json'}


@pytest.fixture(scope='module')
def cell(tmp_path_factory):
    """Two runs along a seam of an arm with play in its elbow."""
    folder = tmp_path_factory.mktemp('cell')
    (folder / 'true.yaml').write_text(
        f'- {{effect: backlash, joint: elbow_joint, width: {WIDTH}}}\n'
        '- {effect: measurement_noise, sigma: 2.0e-5}\n'
    )
    for name, path, seed in (('first', 'line', 4), ('second', 'arc', 2)):
        words = ('simulate', '--robot', 'ur5', '--effects', folder / 'true.yaml', '--path', path)
        words += ('--profile', 'aggressive', '--rate', 60, '--seed', seed)
        done(*words, '--out', folder / name)
    return folder


@pytest.fixture(scope='module')
def found(cell):
    """Return what diagnose leaves behind, judged on the other run; what it says lies beside it."""
    words = ('diagnose', cell / 'first', '--robot', 'ur5', '--holdout', cell / 'second')
    said = weld_twin(*words, '--out', cell / 'found')
    assert (said.code, said.err) == (0, '')
    (cell / 'said').write_text(said.out)
    return cell / 'found'


def digest_of(bag):
    parts = [f.name.encode() + b'\0' + f.read_bytes() for f in sorted(bag.iterdir())]
    return hashlib.sha256(b''.join(parts)).hexdigest()


def test_play_is_found_with_its_width_and_told_in_files_and_on_the_terminal(cell, found):
    data = json.loads((found / 'diagnosis.json').read_text())
    assert data['schema'] == 'weld_twin/diagnosis/2'
    verdict, shrink = data['verdict'], data['shrink']
    assert verdict['status'] == 'identified'
    assert [(e['effect'], e['joint']) for e in verdict['effects']] == [('backlash', 'elbow_joint')]
    assert verdict['effects'][0]['parameters']['width'] == pytest.approx(WIDTH, rel=0.05)
    assert (shrink['held_out'], shrink['ratio'] < 0.3) == ('second', True)
    assert shrink['rms_after_m'] == pytest.approx(NOISE, rel=0.15)
    assert shrink['ratio'] == pytest.approx(shrink['rms_after_m'] / shrink['rms_before_m'])
    assert shrink['ci95'][0] < shrink['ratio'] < shrink['ci95'][1] < 0.5
    assert {path.name for path in found.iterdir()} == FILES
    assert not [path for path in found.parent.iterdir() if path.name.startswith('.')]
    digest = digest_of(cell / 'first')
    assert [item['use'] for item in data['inputs']] == ['recording', 'held out']
    assert data['inputs'][0]['sha256'] == digest
    assert digest in (found / 'report.html').read_text()
    said = (cell / 'said').read_text()
    assert 'comes from backlash of elbow_joint' in ' '.join(said.split())
    assert str(found / 'report.html') in said.replace('\n', '')


def test_what_is_known_is_in_the_twin_from_the_start_and_what_is_excluded_never_is(cell, tmp_path):
    words = ('diagnose', cell / 'first', '--robot', 'ur5', '--effects-known', cell / 'true.yaml')
    done(*words, '--exclude-effect', 'servo_lag', '--out', tmp_path / 'rest')
    data = json.loads((tmp_path / 'rest' / 'diagnosis.json').read_text())
    assert data['gap']['rms_m'] == pytest.approx(NOISE, rel=0.1)
    assert (data['verdict']['status'], data['verdict']['effects']) == ('none', [])
    play = {'effect': 'backlash', 'joint': 'elbow_joint', 'width': WIDTH}
    assert data['model']['known'][0] == play
    named = {e['effect'] for e in data['verdict']['effects'] + data['candidates']}
    assert 'servo_lag' not in named
    assert data['not_considered']['servo_lag'] == 'excluded by the user'


@pytest.mark.parametrize(
    ('words', 'reason'),
    [
        (['--align', 'bas'], '--align takes base, tool or base,tool'),
        (['--exclude-effect', 'rust'], "no effect 'rust'"),
        (['--holdout', 'nowhere'], "no bag at 'nowhere'"),
        (['--effects-known', 'nowhere.json'], 'cannot be read'),
        (['--pose-topic', '/camera'], "no message on '/camera'"),
    ],
)
def test_wrong_use_is_one_line_and_leaves_nothing(cell, tmp_path, words, reason):
    out = tmp_path / 'd'
    assert reason in refused('diagnose', cell / 'first', '--robot', 'ur5', '--out', out, *words)
    assert list(tmp_path.iterdir()) == []


def twin_poses(bag):
    with BagReader(bag) as reader:
        told = [m.message for m in reader.messages(['/twin/tool_pose'])]
    return stamps(told), points(m.pose.position for m in told)


def stamps(told):
    return np.array([m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in told])


def points(places):
    return np.array([[p.x, p.y, p.z] for p in places])


@pytest.fixture(scope='module')
def predicted(cell, found):
    """The other run with what was found, and its table."""
    out = cell / 'predicted'
    words = ('--robot', 'ur5', '--model', found / 'diagnosis.json', '--table', cell / 'poses.csv')
    assert 'within' in done('simulate', cell / 'second', *words, '--out', out)
    return out


def test_predict_adds_what_was_found_at_every_joint_state(cell, found, predicted):
    ns, position = twin_poses(predicted)
    recording = read_recording(cell / 'second', load('ur5'))
    assert np.array_equal(ns - recording.epoch_ns, np.round(recording.joints.t * 1e9))
    twin = load_model(load('ur5'), found / 'diagnosis.json')
    wanted = twin.poses(recording, recording.joints.t).position
    assert np.abs(position - wanted).max() < 1e-12
    left = read_recording(predicted, load('ur5')).measured.position - wanted
    assert np.sqrt((left**2).sum(axis=1).mean()) < 5e-5


def write_model(path, effects, bases, tool=None, inputs=()):
    tool = (load('ur5').T_flange_tool if tool is None else tool).tolist()
    model = {'tool': tool, 'bases': [base.tolist() for base in bases], 'found': effects}
    content = {'schema': 'weld_twin/diagnosis/1', 'inputs': list(inputs), 'model': model}
    path.write_text(json.dumps(content))
    return path


def test_predicted_poses_are_those_of_the_instrument_at_the_same_stamp(cell, tmp_path):
    """A clock that is late by d shows at t where the arm was at t - d, in the fitted frames."""
    robot = load('ur5')
    base, tool = np.eye(4), np.eye(4)
    base[:3, 3], tool[:3, 3] = [0.5, -0.2, 1.0], [0.0, 0.01, 0.15]
    late = [{'effect': 'time_delay', 'delay': DELAY}]
    model = write_model(tmp_path / 'm.json', late, [base], tool)
    out = tmp_path / 'p'
    done('simulate', cell / 'first', '--robot', 'ur5', '--model', model, '--out', out)
    _, position = twin_poses(out)
    motion = read_recording(cell / 'first', robot).joints
    nominal = Twin(robot.with_frames(tool=tool))
    late = nominal.poses(Recording('r', motion), motion.t - DELAY).position + base[:3, 3]
    assert np.abs(position - late).max() < 1e-12
    now = nominal.poses(Recording('r', motion)).position + base[:3, 3]
    assert np.abs(position - now).max() > 1e-4


def test_with_several_set_ups_the_bag_tells_which_is_meant(cell, tmp_path):
    bases = [np.eye(4), np.eye(4)]
    bases[1][0, 3] = 1.0
    hashes = [
        {'use': 'recording', 'path': name, 'sha256': digest_of(cell / name)}
        for name in ('first', 'second')
    ]
    own = write_model(tmp_path / 'own.json', [], bases, inputs=hashes)
    other = write_model(tmp_path / 'other.json', [], bases, inputs=hashes[:1])
    predict = ('simulate', cell / 'second', '--robot', 'ur5')
    done(*predict, '--model', own, '--out', tmp_path / 'a')
    assert '--setup 1 to 2' in refused(*predict, '--model', other, '--out', tmp_path / 'b')
    done(*predict, '--model', other, '--setup', 1, '--out', tmp_path / 'c')
    apart = twin_poses(tmp_path / 'a')[1] - twin_poses(tmp_path / 'c')[1]
    assert apart == pytest.approx(np.tile([1.0, 0.0, 0.0], (len(apart), 1)))


def test_exports_carry_the_correction_and_leave_the_rest_as_effects(tmp_path):
    effects = [
        {'effect': 'joint_offset', 'joint': 'elbow_joint', 'offset': OFFSET},
        {'effect': 'backlash', 'joint': 'wrist_1_joint', 'width': WIDTH},
    ]
    words = ('export', write_model(tmp_path / 'm.json', effects, [np.eye(4)]), '--robot', 'ur5')
    forms = {'r.yaml': 'yaml', 'r.urdf': 'urdf', 'o.csv': 'offsets', 'l.yaml': 'left-over'}
    for name, form in {**forms, 'e.yaml': 'effects'}.items():
        done(*words, '--format', form, '--out', tmp_path / name)
    q = np.array([[0.1, -1.0, 1.2, 0.3, -0.5, 0.2]])
    shifted = q + OFFSET * np.eye(6)[2]

    def places(robot, q):
        return Twin(robot).poses(Recording('r', JointMotion(np.zeros(1), q))).position

    wanted = places(load('ur5'), shifted)
    for robot in (read_robot_yaml(tmp_path / 'r.yaml'), read_urdf(tmp_path / 'r.urdf')):
        assert np.allclose(places(robot, q), wanted, atol=1e-9)
    rows = {row['joint']: row for row in csv.DictReader((tmp_path / 'o.csv').open())}
    assert float(rows['elbow_joint']['offset']) == OFFSET and rows['elbow_joint']['unit'] == 'rad'
    assert [e['effect'] for e in yaml.safe_load((tmp_path / 'l.yaml').read_text())] == ['backlash']
    assert len(yaml.safe_load((tmp_path / 'e.yaml').read_text())) == 2


def test_compensated_commands_put_the_tool_where_it_was_wanted(cell, tmp_path):
    zero = [{'effect': 'joint_offset', 'joint': 'elbow_joint', 'offset': OFFSET}]
    model = write_model(tmp_path / 'm.json', zero, [np.eye(4)])
    out = tmp_path / 'commands'
    said = done('correct', cell / 'first', '--robot', 'ur5', '--model', model, '--out', out)
    nominal = read_recording(cell / 'first', load('ur5')).joints
    commands = read_recording(out, load('ur5')).joints
    assert np.abs(commands.q - (nominal.q - OFFSET * np.eye(6)[2])).max() < 1e-9
    assert provenance(out)['compensated_with'][0]['effect'] == 'joint_offset'
    assert 'and 0.0000 mm with these' in said


def test_commands_put_the_middle_of_the_models_allowed_where_the_tool_was_wanted(
    cell, found, tmp_path
):
    """What is named is a few causes; a recorded arm has a little of every other error besides."""
    model, out, robot = found / 'diagnosis.json', tmp_path / 'commands', load('ur5')
    done('correct', cell / 'first', '--robot', 'ur5', '--model', model, '--out', out)
    frames = json.loads(model.read_text())['model']
    arm = robot.with_frames(base=np.array(frames['bases'][0]), tool=np.array(frames['tool']))
    motion = read_recording(cell / 'first', robot).joints
    wanted = Twin(arm).poses(Recording('r', motion)).position
    apart = np.linalg.norm(covariances(out)[1] - wanted, axis=1)
    assert np.median(apart) < 2e-7


def test_commands_for_the_arm_of_a_later_recording_are_corrected_by_what_changed(cell, tmp_path):
    model = write_model(tmp_path / 'm.json', [], [np.eye(4), np.eye(4)])
    slipped = {'effect': 'joint_offset', 'joint': 'elbow_joint', 'value': OFFSET, 'std': 1e-5}
    content = json.loads(model.read_text()) | {'schema': 'weld_twin/diagnosis/2'}
    model.write_text(json.dumps(content | {'changed': [{**slipped, 'recording': 1}]}))
    nominal = read_recording(cell / 'first', load('ur5')).joints
    for setup, moved in ((1, 0.0), (2, -OFFSET)):
        words = ('--model', model, '--setup', setup, '--out', tmp_path / f'for_{setup}')
        done('correct', cell / 'first', '--robot', 'ur5', *words)
        commands = read_recording(tmp_path / f'for_{setup}', load('ur5')).joints
        assert np.abs(commands.q - (nominal.q + moved * np.eye(6)[2])).max() < 1e-9
    words = ('--robot', 'ur5', '--model', model, '--setup', 3, '--out', tmp_path / 'for_3')
    assert 'there is no number 3' in refused('correct', cell / 'first', *words)


@pytest.mark.parametrize(
    ('content', 'reason'),
    [
        ('[]', 'is no diagnosis'),
        ('{"schema": "other/1"}', 'is no diagnosis'),
        ('{', 'is not JSON'),
        ('{"schema": "weld_twin/diagnosis/1"}', 'holds no model'),
        ('{"schema": "weld_twin/diagnosis/1", "model": {TOOL, "bases": []}}', 'model.tool'),
        ('{"schema": "weld_twin/diagnosis/1", "model": {"bases": []}}', "lacks 'tool'"),
    ],
)
def test_a_file_that_is_no_diagnosis_is_told_in_one_line(tmp_path, content, reason):
    path = tmp_path / 'm.json'
    path.write_text(content.replace('TOOL', '"tool": [[1]]'))
    assert reason in refused('export', path, '--robot', 'ur5')


def test_a_diagnosis_has_at_most_64_megabytes(tmp_path):
    for size, reason in ((60_000_000, 'is not JSON'), (65_000_000, 'larger than any')):
        with open(tmp_path / 'm.json', 'wb') as file:
            file.truncate(size)
        assert reason in refused('export', tmp_path / 'm.json', '--robot', 'ur5')


def covariances(bag):
    """Stamps, positions and covariances of the poses that a bag says it is sure of."""
    with BagReader(bag) as reader:
        told = [m.message for m in reader.messages(['/twin/tool_pose_with_covariance'])]
    covariance = np.array([m.pose.covariance for m in told]).reshape(-1, 6, 6)
    return stamps(told), points(m.pose.pose.position for m in told), covariance


def test_predict_says_how_sure_it_is_at_every_pose(predicted):
    ns, position = twin_poses(predicted)
    sure_ns, sure_position, covariance = covariances(predicted)
    assert np.array_equal(ns, sure_ns)
    # What is promised is gone to as far as the recording bears out: not far from the twin's pose.
    assert np.linalg.norm(position - sure_position, axis=1).max() < 1e-4
    np.testing.assert_allclose(covariance, np.swapaxes(covariance, 1, 2), rtol=1e-9)
    assert np.linalg.eigvalsh(covariance).min() > -1e-18
    # The true pose is that of the cell without the instrument's noise of 0.02 mm per axis.
    measured = read_recording(predicted, load('ur5')).measured.position
    off = measured - sure_position
    whole = covariance[:, :3, :3] + 2e-5**2 * np.eye(3)
    squared = np.einsum('mi,mi->m', off, np.linalg.solve(whole, off[..., None])[..., 0])
    assert np.mean(squared < 6.2514) >= 0.85


def test_where_it_was_measured_the_twin_is_sure_within_the_noise(cell, found, tmp_path):
    out = tmp_path / 'predicted'
    model = found / 'diagnosis.json'
    done('simulate', cell / 'first', '--robot', 'ur5', '--model', model, '--out', out)
    covariance = covariances(out)[2][:, :3, :3]
    assert np.sqrt(np.linalg.eigvalsh(covariance)[:, -1]).max() < 1e-4
    assert json.loads((out / 'prediction.json').read_text()) == {'outside': []}


def test_the_table_of_a_prediction_has_columns_for_sigma(cell, predicted):
    rows = list(csv.DictReader((cell / 'poses.csv').open()))
    _, position, covariance = covariances(predicted)
    got = np.array([[float(row[f'{axis}_m']) for axis in 'xyz'] for row in rows])
    np.testing.assert_allclose(got, position, atol=1e-8)
    sigma = np.array([[float(row[f'sigma_{axis}_m']) for axis in 'xyz'] for row in rows])
    np.testing.assert_allclose(sigma**2, covariance[:, range(3), range(3)], rtol=1e-6)
    assert {row['outside'] for row in rows} <= {'0', '1'}


def wrist_goes_on(cell, bag, start=None):
    """Write and return a motion whose wrist turns 0.96 rad in its last 2 s, maybe from a start."""
    robot, t = load('ur5'), np.linspace(0.0, 4.0, 401)
    q = np.tile(read_recording(cell / 'first', robot).joints.q[0], (401, 1))
    q[:, 3] = (q[:, 3] if start is None else start) + np.clip(t - 2.0, 0.0, 0.96)
    moved = Recording('far', JointMotion(t, q))
    write_recording(bag, moved, robot)
    return moved


def test_a_joint_taken_beyond_what_was_recorded_is_told_with_its_time(cell, found, tmp_path):
    data = json.loads((found / 'diagnosis.json').read_text())
    high = data['posterior']['recorded']['joints'][3]['measured'][-1][1]
    moved = wrist_goes_on(cell, tmp_path / 'far', high)
    out = tmp_path / 'predicted'
    model = found / 'diagnosis.json'
    done('simulate', tmp_path / 'far', '--robot', 'ur5', '--model', model, '--out', out)
    outside = json.loads((out / 'prediction.json').read_text())['outside']
    mine = [item for item in outside if 'beyond' in item['why']]
    assert [item['why'] for item in mine] == ['wrist_1_joint is 0.96 rad beyond what was recorded']
    margin = data['posterior']['recorded']['joints'][3]['margin']
    assert mine[0]['t_start'] == pytest.approx(2.0 + margin, abs=0.02)
    assert mine[0]['t_end'] == pytest.approx(4.0)
    _, predicted, covariance = covariances(out)
    real = Twin(load('ur5'), [Backlash('elbow_joint', WIDTH)]).poses(moved)
    for k in (0, -1):
        off = predicted[k] - real.position[k]
        assert off @ np.linalg.solve(covariance[k][:3, :3], off) < chi2.ppf(0.999, 3)


def test_a_model_written_without_a_posterior_still_predicts_and_says_so(cell, found, tmp_path):
    data = json.loads((found / 'diagnosis.json').read_text())
    del data['posterior']
    (tmp_path / 'old.json').write_text(json.dumps(data))
    out = tmp_path / 'predicted'
    words = ('--robot', 'ur5', '--model', tmp_path / 'old.json', '--out', out)
    assert 'has no posterior' in done('simulate', cell / 'second', *words)
    assert covariances(out)[0].size == 0
    assert not (out / 'prediction.json').exists()


@pytest.mark.parametrize(
    ('command', 'spoil', 'reason'),
    [
        ('simulate', lambda d: d['posterior'].pop('covariance'), "lacks 'covariance'"),
        ('simulate', lambda d: d['posterior']['covariance'].pop(), 'lower triangle'),
        ('simulate', lambda d: joints(d).reverse(), 'it was made for joints'),
        ('simulate', lambda d: discrepancy(d, -1.0), 'must be a size'),
        ('simulate', lambda d: discrepancy(d, 0.0), 'was changed after it was written'),
        ('simulate', lambda d: joints(d)[0]['measured'].pop(), 'was changed after'),
        ('verify', lambda d: d['verdict'].update(causes=[7]), 'verdict.causes[0] needs a mapping'),
        (
            'verify',
            lambda d: d['model']['alone'].update(whole_recorded_m=None),
            'the model of diagnosis',
        ),
        ('verify', lambda d: d.update(inputs=[{'path': 'x'}]), 'inputs[0].use needs a text'),
        ('verify', lambda d: d['model'].update(counted=[]), 'needs a mapping, and has []'),
        ('verify', lambda d: d.update(shrink=None), 'shrink of the diagnosis means nothing'),
        ('verify', lambda d: d['gap'].pop('noise_floor_m'), 'shrink of the diagnosis means'),
    ],
)
def test_a_part_that_somebody_changed_is_one_line(cell, found, tmp_path, command, spoil, reason):
    data = json.loads((found / 'diagnosis.json').read_text())
    spoil(data)
    (tmp_path / 'spoilt.json').write_text(json.dumps(data))
    words = ('--robot', 'ur5', '--model', tmp_path / 'spoilt.json', '--out', tmp_path / 'p')
    assert reason in refused(command, cell / 'second', *words)


def joints(data):
    return data['posterior']['recorded']['joints']


def discrepancy(data, size):
    data['posterior']['discrepancy'].update(position_m=size)


def test_a_diagnosis_of_the_first_version_is_still_held_against_a_recording(cell, found, tmp_path):
    data = json.loads((found / 'diagnosis.json').read_text())
    data['schema'], data['inputs'] = 'weld_twin/diagnosis/1', None
    del data['model']['robot'], data['model']['kinematics'], data['posterior']
    (tmp_path / 'old.json').write_text(json.dumps(data))
    more = ('--model', tmp_path / 'old.json', '--robot', 'ur5', '--out')
    done('simulate', cell / 'second', *more, tmp_path / 'predicted')
    weld_twin('verify', cell / 'second', *more, tmp_path / 'out')
    written = json.loads((tmp_path / 'out' / 'verification.json').read_text())
    assert (written['robot'], written['kinematics']) == ('ur5', fingerprint(load('ur5')))


def test_compensate_holds_back_where_the_model_knows_little(cell, found, tmp_path):
    out, _ = tmp_path / 'commands', wrist_goes_on(cell, tmp_path / 'far')
    words = ('--robot', 'ur5', '--model', found / 'diagnosis.json', '--out', out)
    assert 'outside what was recorded' in done('correct', tmp_path / 'far', *words)
    outside = json.loads((out / 'prediction.json').read_text())['outside']
    assert 'wrist_1_joint' in outside[0]['why']
    ns, _, covariance = covariances(out)
    assert ns.size == 401
    assert covariance[-1].trace() > covariance[0].trace()
