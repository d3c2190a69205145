# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""`simulate`, `info` and what every subcommand does with bad input, and with a robot in a folder."""

import subprocess
import sys

import numpy as np
import pytest
from command_line import done, refused, weld_twin

from weld_twin_core import catalog, forward
from weld_twin_msgs_py.bags import BagReader, provenance, read_recording
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.robots import load_robot, write_robot_yaml

ROBOT = catalog.load('ur5')


def rows(path, topic):
    with BagReader(path) as bag:
        return [message for _, _, _, message in bag.messages([topic])]


@pytest.fixture
def effects(tmp_path):
    file = tmp_path / 'effects.yaml'
    file.write_text('- {effect: joint_offset, joint: elbow_joint, offset: 5e-4}\n')
    return file


@pytest.mark.parametrize(('known', 'profile'), [(False, 'constant'), (True, 'aggressive')])
def test_without_effects_or_with_a_model_of_them_the_deviation_vanishes(
    tmp_path, effects, known, profile
):
    """Without, it is the paper's baseline scenario: line, constant speed, no error."""
    more = ('--effects', effects, '--model', effects) if known else ()
    words = ('--robot', 'ur5', '--path', 'line', '--profile', profile, *more)
    done('simulate', *words, '--out', tmp_path / 'bag')
    last = from_messages.metrics(rows(tmp_path / 'bag', '/deviation/metrics')[-1])
    assert last['max'] < 1e-12 and last['D_norm'] < 1e-12
    assert last['samples'] > 100
    assert last['dropped'] == last['waiting'] == 0


@pytest.mark.parametrize('profile', ['smooth', 'aggressive'])
def test_a_joint_offset_moves_the_tool_as_the_arm_turned_by_it(tmp_path, effects, profile):
    out = tmp_path / 'bag'
    result = done(
        *('simulate', '--robot', 'ur5', '--effects', effects, '--rate', 40, '--path', 'weave'),
        *('--profile', profile, '--out', out),
    )
    recording = read_recording(out, ROBOT)
    assert ('slowed down' in result) == (profile == 'aggressive')
    turned = recording.joints.q + [0, 0, 5e-4, 0, 0, 0]
    np.testing.assert_allclose(
        recording.measured.position, forward(ROBOT, turned)[:, :3, 3], rtol=0.0, atol=1e-12
    )
    vectors = np.array([from_messages.vector3(m) for m in rows(out, '/deviation')])
    nominal = forward(ROBOT, recording.joints.q)[:, :3, 3]
    np.testing.assert_allclose(
        vectors, recording.measured.position - nominal, rtol=0.0, atol=1e-12
    )


def test_the_same_command_writes_the_same_messages(tmp_path, effects):
    effects.write_text('[{effect: measurement_noise, sigma: 1e-5}]')
    words = ('simulate', '--robot', 'ur5', '--effects', effects, '--profile', 'aggressive')
    for name, seed in (('a', 1), ('b', 1), ('c', 2)):
        done(*words, '--seed', seed, '--out', tmp_path / name)
    a, b, c = (read_recording(tmp_path / name, ROBOT).measured.position for name in 'abc')
    np.testing.assert_array_equal(a, b)
    assert abs(a - c).max() > 1e-6
    assert provenance(tmp_path / 'a')['seed'] == 1


def test_a_path_file_with_torch_angles_is_followed(tmp_path):
    file, out = tmp_path / 'seam.yaml', tmp_path / 'bag'
    file.write_text(
        'kind: line\nstart: [0.4, -0.1, 0.1]\nend: [0.4, 0.1, 0.1]\n'
        'torch: {travel: 0.2, work: -0.1}\n'
    )
    done('simulate', '--robot', 'ur5', '--path', file, '--speed', 0.05, '--rate', 50, '--out', out)
    position = read_recording(out, ROBOT).measured.position
    np.testing.assert_allclose(position[0], [0.4, -0.1, 0.1], atol=1e-8)
    np.testing.assert_allclose(position[-1], [0.4, 0.1, 0.1], atol=1e-8)


def test_taught_points_from_a_table_are_visited(tmp_path):
    file, out = tmp_path / 'points.csv', tmp_path / 'bag'
    points = np.array([[0.4, -0.1, 0.1], [0.42, 0.0, 0.11], [0.4, 0.1, 0.1]])
    np.savetxt(file, points, delimiter=',', header='x,y,z', comments='')
    done('simulate', '--robot', 'ur5', '--path', file, '--out', out)
    position = read_recording(out, ROBOT).measured.position
    for point in points:
        assert np.linalg.norm(position - point, axis=1).min() < 3e-4


def test_a_bag_that_was_cut_short_is_named(tmp_path):
    out = tmp_path / 'bag'
    weld_twin('simulate', '--robot', 'ur5', '--profile', 'aggressive', '--out', out)
    file = out / 'bag.mcap'
    file.write_bytes(file.read_bytes()[:-4000])
    result = weld_twin('bag', out)
    assert (result.code, result.out) == (2, '')
    assert 'cut short' in result.err


BAD = {
    'unknown robot': (('--robot', 'ur99'), "'ur99' is neither"),
    'missing effects file': (('--effects', None), 'No such file'),
    'bad effects': (('--effects', '[{effect: rust}]'), "unknown effect 'rust'"),
    'unknown profile': (('--profile', 'hasty'), "no profile is called 'hasty'"),
    'unreachable seam': (('--path', 'kind: line\nstart: [3, 0, 0]\nend: [3, 1, 0]'), 'reach'),
    'too fast': (('--speed', '9', '--profile', 'constant'), 'its limit is'),
    'unknown kind of seam': (('--path', 'kind: heart'), "'heart'"),
    'no samples': (('--rate', '0'), 'rate must be positive'),
    'negative seed': (('--seed', '-1'), '--seed'),
}


@pytest.mark.parametrize('what', BAD)
def test_bad_input_costs_one_line_and_leaves_nothing(tmp_path, what):
    words, sentence = BAD[what]
    if words[0] in ('--effects', '--path'):
        file = tmp_path / 'input.yaml'
        if words[1] is not None:
            file.write_text(words[1])
        words = (words[0], file)
    before = set(tmp_path.iterdir())
    assert sentence in refused('simulate', '--robot', 'ur5', '--out', tmp_path / 'bag', *words)
    assert set(tmp_path.iterdir()) == before


def test_an_existing_bag_is_not_overwritten(tmp_path):
    (tmp_path / 'bag').mkdir()
    (tmp_path / 'bag' / 'precious').touch()
    assert 'exists already' in refused('simulate', '--robot', 'ur5', '--out', tmp_path / 'bag')
    assert (tmp_path / 'bag' / 'precious').exists()


@pytest.mark.parametrize('words', [(), ('dance',), ('simulate',), ('bag',), ('bag', 'info')])
def test_wrong_usage_exits_with_2(words):
    result = weld_twin(*words)
    assert result.code == 2 and result.err


def test_help_is_quick_because_it_imports_little():
    code = (
        'import sys\n'
        'from weld_twin_nodes.cli import main\n'
        'for words in (["--help"], ["simulate", "--help"], ["import", "--help"],\n'
        '    ["bag", "--help"], ["diagnose", "--help-all"]):\n'
        '    try: main(words)\n'
        '    except SystemExit as stop: assert stop.code == 0\n'
        'slow = {"numpy", "scipy", "rclpy", "matplotlib", "rosbags"} & set(sys.modules)\n'
        'assert not slow, slow\n'
    )
    subprocess.run([sys.executable, '-c', code], check=True, capture_output=True)


def simulated_with(folder, effect, *more):
    """Return what the command says of a short motion with one effect."""
    (folder / 'e.yaml').write_text(f'- {effect}\n')
    words = ('--effects', folder / 'e.yaml', '--rate', 20, '--out', folder / 'bag', *more)
    return weld_twin('simulate', '--robot', 'ur5', *words)


@pytest.mark.parametrize(
    ('effect', 'said'),
    [
        ('{effect: joint_offset, ELBOW, offset: 0.5}', 'no machine is known beyond 0.13'),
        ('{effect: time_delay, delay: 0.6}', 'no machine is known beyond 0.5'),
        ('{effect: joint_compliance, ELBOW, compliance: -8e-6}', 'of elbow_joint is below zero'),
        (
            '\n- '.join(['{effect: link_length, ELBOW, da: 2e-4}'] * 2),
            'is there 2 times, and all count',
        ),
    ],
)
def test_a_value_that_no_machine_has_is_doubted_in_a_sentence(tmp_path, effect, said):
    result = simulated_with(tmp_path, effect.replace('ELBOW', 'joint: elbow_joint'))
    assert result.code == 0
    assert said in result.err


def test_a_value_that_no_machine_comes_near_is_refused_unless_it_is_meant(tmp_path):
    effect = '{effect: joint_offset, joint: elbow_joint, offset: 5}'
    result = simulated_with(tmp_path, effect)
    assert result.code == 2
    assert "e.yaml': offset of joint_offset of elbow_joint is 5; no machine" in result.err
    assert not (tmp_path / 'bag').exists()
    assert simulated_with(tmp_path, effect, '--allow-implausible').code == 0


def test_a_delay_beyond_the_motion_leaves_a_sentence_and_no_bag(tmp_path):
    effect = '{effect: time_delay, delay: 200}'
    result = simulated_with(tmp_path, effect, '--allow-implausible')
    assert result.code == 2
    assert 'no measurement meets a pose of the twin' in result.err
    assert not (tmp_path / 'bag').exists()


@pytest.fixture
def cell7(tmp_path, monkeypatch):
    """Return the file of a robot of one's own: an arm on a plinth."""
    monkeypatch.setenv('WELD_TWIN_ROBOTS', str(tmp_path / 'robots'))
    raised = catalog.load('kuka_kr16_2')
    base = raised.T_world_base.copy()
    base[2, 3] = 0.75
    (tmp_path / 'robots').mkdir()
    file = tmp_path / 'robots/cell7.yaml'
    write_robot_yaml(file, raised.with_frames(base=base))
    return file


def test_commands_take_it_and_info_lists_it(cell7, tmp_path):
    heights = {}
    for robot in ('cell7', 'kuka_kr16_2'):
        words = ('--robot', robot, '--path', 'line', '--rate', 20, '--out', tmp_path / robot)
        done('simulate', *words)
        bag = read_recording(tmp_path / robot, load_robot(robot))
        heights[robot] = bag.measured.position[:, 2].mean()
    assert heights['cell7'] - heights['kuka_kr16_2'] == pytest.approx(0.75, abs=1e-9)
    listed = weld_twin('bag', '--robots').out
    assert all(name in listed for name in catalog.names())
    assert listed.splitlines()[-1].split() == ['cell7', 'your', 'own', str(cell7)]
