# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Nodes fed from a played bag give what the bag recorded live, and begin anew when it loops."""

import sys
from pathlib import Path

import numpy as np
import pytest

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.bags import BagReader
from weld_twin_msgs_py.messages import from_messages
from weld_twin_nodes.harness.cell import HealthListener
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
    count = len(recorded['/deviation'])

    def turns():
        return np.flatnonzero(np.diff(deviations.stamps) < 0) + 1

    cell.wait(lambda: turns().size == 1 and len(deviations) >= turns()[0] + count, 'both rounds')
    first = int(turns()[0])
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
