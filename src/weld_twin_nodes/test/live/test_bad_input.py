# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A node given nonsense warns, counts, publishes nothing wrong, and goes on."""

import json

import numpy as np
import pytest

from weld_twin_core import Twin, forward
from weld_twin_core.recording import Counted
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.topics import JOINT_STATES, MEASURED_POSE, TWIN_POSE
from weld_twin_nodes.harness import Cell
from weld_twin_nodes.live.deviation_analyzer import DeviationAnalyzer
from weld_twin_nodes.live.error_injector import ErrorInjector
from weld_twin_nodes.live.forward_kinematics_twin import ForwardKinematicsTwin

pytestmark = pytest.mark.cells

S = 1_000_000_000
Q = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
NAN, INF = float('nan'), float('inf')


def missing_joint(m):
    m.name = [*m.name[:5], 'gripper']


def too_few_positions(m):
    m.position = m.position[:4]


def named_twice(m):
    m.name, m.position = [*m.name, 'elbow_joint'], [*m.position, 0.0]


def no_stamp(m):
    m.header.stamp.sec = m.header.stamp.nanosec = 0


def stamp_goes_back(m):
    m.header.stamp.sec -= 1


def value(k, number, field='position'):
    def change(m):
        getattr(m, field)[k] = number

    return change


BAD_JOINT_STATES = {
    'missing joint': (missing_joint, "no joint 'wrist_3_joint'"),
    'too few positions': (too_few_positions, '6 names but 4 positions'),
    'a joint named twice': (named_twice, "names joint 'elbow_joint' twice"),
    'not a number': (value(2, NAN), "'elbow_joint' has the position nan"),
    'infinite velocity': (value(1, INF, 'velocity'), 'the velocity inf'),
    'degrees': (value(1, -90.0), 'this looks like degrees in a radian field'),
    'unset stamp': (no_stamp, 'header.stamp is 0 ns'),
    'stamp that goes back': (stamp_goes_back, 'not after the last one'),
}


@pytest.fixture(scope='module')
def cell(tmp_path_factory):
    with Cell(tmp_path_factory.mktemp('bad')) as cell:
        yield cell


class Bench:
    """A node in this process with what it says and a way to speak to it."""

    def __init__(self, cell, make, topics, output, **parameters):
        self.cell = cell
        self.node = cell.add(make, reliable_inputs=True, **parameters)
        self.said = []
        self.node.refuse = self._note(self.node.refuse)
        self.out = cell.collect(output)
        self.send = {topic.name: cell.publisher(topic).publish for topic in topics}
        cell.wait(lambda: cell.node.count_publishers(output) > 0, f'a publisher of {output}')
        self.stamp = S

    def _note(self, refuse):
        def noted(source, reason):
            self.said.append(reason)
            refuse(source, reason)

        return noted

    def next_stamp(self):
        self.stamp += S // 100
        return self.stamp

    def close(self):
        self.cell.remove(self.node)


@pytest.fixture(scope='module')
def twin(cell):
    bench = Bench(cell, ForwardKinematicsTwin, [JOINT_STATES], TWIN_POSE.name)
    yield bench
    bench.close()


def joint_state(bench, robot, ns=None):
    return bench.cell.messages.joint_state(
        ns or bench.next_stamp(), robot.joint_names, Q, np.zeros(6)
    )


@pytest.mark.parametrize('what', BAD_JOINT_STATES)
def test_a_bad_joint_state_costs_a_sentence_and_nothing_else(twin, robot, what):
    spoil, sentence = BAD_JOINT_STATES[what]
    good = [joint_state(twin, robot) for _ in range(3)]
    spoil(good[1])
    before, twin.said[:] = len(twin.out), []
    refused = twin.node.refused
    for message in good:
        twin.send['/joint_states'](message)
    twin.cell.wait(lambda: len(twin.out) == before + 2, 'the two good poses')
    stamps = [from_messages.stamp_ns(m) for m in (*twin.out.messages[-2:], good[0], good[2])]
    assert stamps[:2] == stamps[2:]
    assert twin.node.refused == refused + 1
    assert len(twin.said) == 1
    assert sentence in twin.said[0]
    assert '\n' not in twin.said[0]
    position, rotation = from_messages.pose(twin.out.last)
    expected = forward(robot, Q)
    np.testing.assert_allclose(position, expected[:3, 3], atol=1e-15)
    np.testing.assert_allclose(rotation, expected[:3, :3], atol=1e-15)


def test_the_analyzer_pairs_good_poses_around_bad_ones(cell, robot):
    bench = Bench(cell, DeviationAnalyzer, [MEASURED_POSE, TWIN_POSE], '/deviation')
    make, eye = cell.messages, np.eye(3)
    stamps = [bench.next_stamp() for _ in range(4)]
    for ns in stamps:
        bench.send[TWIN_POSE.name](make.pose(ns, np.zeros(3), eye))
    messages = [make.pose(ns, np.array([1e-3, 0.0, 0.0]), eye) for ns in stamps]
    messages[1].pose.position.y = NAN
    messages[2].pose.orientation.w = 0.0
    for message in messages:
        bench.send[MEASURED_POSE.name](message)
    cell.wait(lambda: len(bench.out) == 2 and bench.node.refused == 2, 'two deviations')
    np.testing.assert_array_equal(bench.out.stamps, [stamps[0], stamps[3]])
    np.testing.assert_array_equal(from_messages.vector3(bench.out.last), [1e-3, 0.0, 0.0])
    assert 'position of the pose' in bench.said[0]
    assert 'a rotation needs 1' in bench.said[1]
    bench.close()


BAD_EFFECTS = {
    'unknown effect': ('[{effect: rust}]', "unknown effect 'rust'"),
    'malformed': ('[{effect: ', 'line 1'),
}


@pytest.fixture(scope='module')
def injector(cell, tmp_path_factory):
    file = tmp_path_factory.mktemp('effects') / 'effects.yaml'
    file.write_text('[]')
    bench = Bench(cell, ErrorInjector, [JOINT_STATES], MEASURED_POSE.name, model=str(file))
    bench.file = file
    yield bench
    bench.close()


def next_pose(bench, robot):
    before = len(bench.out)
    bench.send['/joint_states'](joint_state(bench, robot))
    bench.cell.wait(lambda: len(bench.out) == before + 1, 'the next pose')
    return from_messages.pose(bench.out.last)[0]


@pytest.mark.parametrize('what', BAD_EFFECTS)
def test_bad_effects_are_refused_with_a_sentence_and_the_old_ones_stay(injector, robot, what):
    text, sentence = BAD_EFFECTS[what]
    before = next_pose(injector, robot)
    result = injector.cell.set_parameter('error_injector', 'effects', text)
    assert not result.successful
    assert sentence in result.reason
    np.testing.assert_array_equal(next_pose(injector, robot), before)


def test_an_effect_changed_while_running_is_in_the_next_message_and_no_robot_is(injector, robot):
    assert not injector.cell.set_parameter('error_injector', 'robot', 'ur10').successful
    text = '[{effect: base_pose, xyz: [0.001, 0, 0], rotvec: [0, 0, 0]}]'
    before = next_pose(injector, robot)
    assert injector.cell.set_parameter('error_injector', 'effects', text).successful
    np.testing.assert_allclose(next_pose(injector, robot) - before, [1e-3, 0, 0], atol=1e-15)
    assert injector.cell.set_parameter('error_injector', 'effects', '').successful
    np.testing.assert_array_equal(next_pose(injector, robot), before)


def test_the_effects_file_is_read_again_on_request(injector, robot):
    before = next_pose(injector, robot)
    injector.file.write_text('[{effect: drift, xyz_rate: [0, 0, 0]}, {effect: payload, mass: -9')
    answer = injector.cell.trigger('/error_injector/reload')
    assert not answer.success
    assert 'line 1' in answer.message
    injector.file.write_text('- {effect: tool_pose, xyz: [0, 0, 0.002], rotvec: [0, 0, 0]}')
    assert injector.cell.trigger('/error_injector/reload').success
    moved = next_pose(injector, robot) - before
    np.testing.assert_allclose(moved, 0.002 * forward(robot, Q)[:3, 2], atol=1e-12)


def test_a_diagnosis_can_be_the_model_of_the_twin(cell, robot, tmp_path):
    file = tmp_path / 'diagnosis.json'
    file.write_text(
        '{"schema": "weld_twin/diagnosis/1", "verdict": {"effects": [{"effect": "joint_offset", '
        '"joint": "elbow_joint", "parameters": {"offset": 0.001}, "std": {"offset": 1e-5}}]}}'
    )
    bench = Bench(cell, ForwardKinematicsTwin, [JOINT_STATES], TWIN_POSE.name, model=str(file))
    moved = Q + [0.0, 0.0, 0.001, 0.0, 0.0, 0.0]
    assert isinstance(bench.node.stream.twin, Twin)
    bench.send['/joint_states'](joint_state(bench, robot))
    expected = forward(robot, moved)[:3, 3]
    cell.wait(
        lambda: any(
            np.allclose(from_messages.pose(m)[0], expected, rtol=0.0, atol=1e-14)
            for m in bench.out.messages
        ),
        'a pose with the diagnosed offset',
    )
    bench.close()


def test_what_a_model_has_otherwise_than_the_cell_is_told(cell, robot, tmp_path):
    file = tmp_path / 'diagnosis.json'
    model = {
        'tool': robot.T_flange_tool.tolist(),
        'bases': [np.eye(4).tolist()],
        'counted': Counted(np.tri(6), np.zeros(6)).as_mapping(),
        'found': [{'effect': 'drift', 'xyz_rate': [1e-3, 0.0, 0.0]}],
    }
    arm = tmp_path / 'robot.yaml'
    arm.write_text(json.dumps(robot.to_mapping()))
    inputs = [{'use': 'robot', 'path': 'robot.yaml', 'sha256': 'as it was'}]
    content = {'schema': 'weld_twin/diagnosis/1', 'model': model, 'inputs': inputs}
    file.write_text(json.dumps(content))
    node = cell.start('forward_kinematics_twin', robot=str(arm), model=str(file))
    cell.wait(lambda: 'joints as the controller shows them' in node.log, 'a sentence')
    assert 'is not as it was when the diagnosis was made' in node.log
    assert 'drift of the frame grew with the time while it was recorded' in node.log
