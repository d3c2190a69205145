# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Bags played into nodes, and an experiment that is recorded while they run."""

import sys
from pathlib import Path

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.errors import DataError, TwinError
from weld_twin_msgs_py.bags import BagReader, read_recording
from weld_twin_msgs_py.files.joint_file import write_joint_motion
from weld_twin_msgs_py.messages import from_messages
from weld_twin_nodes.harness import Cell
from weld_twin_nodes.harness.cell import HealthListener
from weld_twin_nodes.harness.recorded_experiment import recorded_experiment
from weld_twin_nodes.live.bag_player import Playing, play
from weld_twin_nodes.live.deviation_analyzer import DeviationAnalyzer
from weld_twin_nodes.live.error_injector import ErrorInjector
from weld_twin_nodes.live.forward_kinematics_twin import ForwardKinematicsTwin

pytestmark = pytest.mark.cells

BAG = Path(__file__).parents[4] / 'bags/elbow_play'
EFFECTS = (
    '[{effect: backlash, joint: elbow_joint, width: 5e-4},'
    ' {effect: measurement_noise, sigma: 1e-5}]'
)
READ = {
    '/twin/tool_pose': lambda m: [*from_messages.pose(m)[0], *from_messages.pose(m)[1].flat],
    '/measured/tool_pose': lambda m: [*from_messages.pose(m)[0], *from_messages.pose(m)[1].flat],
    '/deviation': from_messages.vector3,
}


@pytest.fixture(scope='module')
def recorded():
    out = {topic: [] for topic in READ}
    with BagReader(BAG) as reader:
        for topic, _, _, message in reader.messages(list(READ)):
            out[topic].append((from_messages.stamp_ns(message), READ[topic](message)))
    return out


def same(messages, recorded, topic):
    assert [from_messages.stamp_ns(m) for m in messages] == [ns for ns, _ in recorded[topic]]
    np.testing.assert_allclose(
        [READ[topic](m) for m in messages],
        [v for _, v in recorded[topic]],
        rtol=1e-10,
        atol=1e-12,
        err_msg=topic,
    )


def player(cell, *topics, options=()):
    words = ['bag', 'play', str(BAG), '--rate', '6', '--wait', '60', '--clock', *options]
    return cell.start([sys.executable, '-m', 'weld_twin_nodes', *words, '--topics', *topics])


SIM = {'use_sim_time': True, 'reliable_inputs': True}


def test_every_node_does_the_same_from_a_played_bag_as_it_did_live(cell, recorded):
    taps = {topic: cell.collect(topic) for topic in READ}
    cell.add(DeviationAnalyzer, **SIM)
    cell.add(ForwardKinematicsTwin, **SIM)
    cell.add(ErrorInjector, effects=EFFECTS, seed=7, **SIM)
    player(cell, '/joint_states', options=('--subscribers', '2'))
    count = len(recorded['/deviation'])
    cell.wait(lambda: all(len(tap) >= count for tap in taps.values()), 'all of the bag')
    for topic, tap in taps.items():
        same(tap.messages, recorded, topic)


def test_a_bag_in_a_loop_begins_anew_each_time_and_says_so_once(cell, recorded):
    deviations, health = cell.collect('/deviation'), HealthListener(cell.node)
    cell.add(DeviationAnalyzer, **SIM)
    cell.add(ForwardKinematicsTwin, **SIM)
    player(cell, '/joint_states', '/measured/tool_pose', options=('--loop', '2'))
    count, (end, _) = len(recorded['/deviation']), recorded['/deviation'][-1]

    def ended_again():
        return len(deviations) > count and from_messages.stamp_ns(deviations.last) == end

    cell.wait(ended_again, 'both rounds')
    (first,) = np.flatnonzero(np.diff(deviations.stamps) < 0) + 1
    same(deviations.messages[first:], recorded, '/deviation')
    # What a busy machine had not paired before the clock jumped is dropped, and only that.
    assert first > 0
    same(deviations.messages[:first], {'/deviation': recorded['/deviation'][:first]}, '/deviation')

    def told(node):
        # By how much is less where the last of the clock's messages came too late.
        return [text for _, text in health.told[f'/{node}'] if text.startswith('time went back')]

    for node in ('deviation_analyzer', 'forward_kinematics_twin'):
        cell.wait(lambda node=node: told(node) != [], f'{node} to say so')
        assert len(told(node)) == 1


@pytest.mark.parametrize(
    ('how', 'sentence'),
    [
        (Playing(rate=0.0), 'the rate must be positive, got 0'),
        (Playing(rate=float('nan')), 'the rate must be positive'),
        (Playing(topics=['/torch']), "no topic '/torch'; it has /"),
    ],
)
def test_what_cannot_be_played_is_said_in_a_sentence(cell, how, sentence):
    with pytest.raises(DataError, match=sentence):
        play(BAG, how, print)


OFFSET = '[{effect: joint_offset, joint: elbow_joint, offset: 0.01}]'


@pytest.fixture
def asked(tmp_path):
    """A motion of two seconds as an experiment is written, and its joints."""
    robot = wt.load('ur5')
    t = np.linspace(0.0, 2.0, 21)
    q = np.array([0.2, -1.3, 1.5, -1.8, -1.5, 0.1]) + 0.2 * np.sin(np.pi * t / 2.0)[:, None] ** 2
    names = list(robot.joint_names)
    motion = {'static': False, 'joint_names': names, 't': t.tolist(), 'q': q.tolist()}
    write_joint_motion(tmp_path / 'experiment.yaml', motion, 'Run the path.')
    return tmp_path / 'experiment.yaml', robot


def test_the_recording_holds_the_motion_and_what_the_cell_measured(asked, tmp_path):
    experiment, robot = asked
    with Cell(tmp_path / 'cell') as cell:
        # The motion waits for recorder and injector, and the injector's first pose for the recorder.
        injector = {'robot': 'ur5', 'effects': OFFSET, 'wait_for_subscribers': 1}
        cell.start('error_injector', reliable_inputs=True, **injector)
        moving = {'rate': 25.0, 'wait_for_subscribers': 2}
        bag = recorded_experiment(experiment, 'ur5', 2.0, tmp_path / 'bag', **moving)
        with pytest.raises(DataError, match='exists already'):
            recorded_experiment(experiment, 'ur5', 2.0, tmp_path / 'bag')
    recording = read_recording(bag, robot)
    assert recording.joints.t.size == 51 and recording.measured.t.size >= 50
    bent = wt.Twin(robot, [wt.effects.JointOffset('elbow_joint', offset=0.01)])
    seen = bent.poses(recording, recording.measured.t)
    assert np.allclose(recording.measured.position, seen.position, atol=1e-6)


def test_a_generator_that_cannot_run_it_is_heard(tmp_path):
    with Cell(tmp_path / 'cell'), pytest.raises(TwinError, match=r'the generator failed.*nothing'):
        recorded_experiment(tmp_path / 'nothing.yaml', 'ur5', 2.0, tmp_path / 'bag')
