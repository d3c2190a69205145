# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A recording is whole, or says what is missing: on the terminal, in the bag, in its health."""

import json
import re
import signal
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from recorder_words import heard_of

pytest.importorskip('rclpy', reason='needs ROS 2')

from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64MultiArray, String

from weld_twin_core.arm import catalog
from weld_twin_msgs_py.bags import BagReader, bag_info, provenance
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.topics import JOINT_STATES, message_class
from weld_twin_msgs_py.robots import write_urdf
from weld_twin_nodes.harness.cell import HealthListener
from weld_twin_nodes.live.bag_player import Playing, play
from weld_twin_nodes.live.cell_node import CellNode

pytestmark = pytest.mark.cells

BAG = Path(__file__).parents[4] / 'bags/elbow_play'
ROBOT = catalog.load('ur5')
FIRST = 1_000_000_000


class Speaker(CellNode):
    """A node of the project that sends numbered joint states when it is told to."""

    def __init__(self, **kwargs):
        super().__init__('speaker', **kwargs)
        self._joints = self.offer(JOINT_STATES)
        self.number = 0

    def speak(self, count):
        for _ in range(count):
            stamp = FIRST + 1_000_000 * self.number
            q = np.full(ROBOT.n, self.number * 1e-3)
            self._joints.publish(self.messages.joint_state(stamp, ROBOT.joint_names, q))
            self.number += 1


def recorder(cell, tmp_path, **parameters):
    process = cell.start('recorder', out=str(tmp_path / 'bag'), **parameters)
    cell.trigger('/recorder/counts')
    return process


def listened(cell, topic, count=1):
    cell.wait(lambda: cell.node.count_subscribers(topic) >= count, f'a listener of {topic}')
    cell.meet()


def heard_by(cell, speaker):
    """Wait until a speaker reaches the recorder and knows that it lives, as it waits for it then."""
    cell.wait(lambda: speaker.listeners()[JOINT_STATES.name] > 0, 'the recorder')
    cell.wait(lambda: '/recorder' in speaker.neighbours.alive(), 'word of the recorder')


def finish(cell, process):
    """End the recorder; the nodes of this process are served meanwhile, as if they lived on."""
    process.interrupt()
    cell.wait(lambda: process.code is not None, 'the recorder to end')
    return process.code


def ended(cell, process):
    """Return how long a node takes to end [s]."""
    begun = time.monotonic()
    assert finish(cell, process) == 0
    return time.monotonic() - begun


def numbers(bag):
    with BagReader(bag) as reader:
        found = reader.messages([JOINT_STATES.name])
        return [(from_messages.stamp_ns(m.message) - FIRST) // 1_000_000 for m in found]


def test_what_reached_a_recorder_that_stood_still_is_in_the_bag(cell, tmp_path):
    speaker = cell.add(Speaker)
    process = recorder(cell, tmp_path)
    listened(cell, JOINT_STATES.name)
    speaker.speak(10)
    cell.wait_recorded({JOINT_STATES.name: 10})
    heard_of(cell, process)
    process.signal(signal.SIGSTOP)
    speaker.speak(2500)  # more than the way holds, and than was kept once
    process.signal(signal.SIGINT)
    process.signal(signal.SIGCONT)
    assert finish(cell, process) == 0
    assert numbers(tmp_path / 'bag') == list(range(2510))
    told = provenance(tmp_path / 'bag')['completeness'][JOINT_STATES.name]
    assert told == {'sent': 2510, 'recorded': 2510, 'missing': 0}
    assert bag_info(tmp_path / 'bag').incomplete == ()
    assert 'that were sent are in the bag' in process.log


def test_what_was_sent_before_the_recorder_came_is_missing_at_the_start(cell, tmp_path):
    speaker = cell.add(Speaker)
    speaker.speak(40)
    health = HealthListener(cell.node)
    process = recorder(cell, tmp_path)
    listened(cell, JOINT_STATES.name)
    speaker.speak(60)
    cell.wait_recorded({JOINT_STATES.name: 60})
    heard_of(cell, process)
    assert finish(cell, process) == 0
    sentence = (
        "'/joint_states' is incomplete: 60 of 100 messages sent are in the bag, "
        '40 are missing at the start'
    )
    assert sentence in process.log
    told = provenance(tmp_path / 'bag')['completeness'][JOINT_STATES.name]
    assert told == {'sent': 100, 'recorded': 60, 'missing': 40, 'where': 'at the start'}
    assert "'/joint_states' lacks 40 of the 100 messages sent, at the start" in (
        bag_info(tmp_path / 'bag').incomplete
    )
    cell.wait(lambda: any(sentence in text for _, text in health.of('recorder')), 'its health')


def test_a_node_that_missed_what_it_listens_to_is_named(cell, tmp_path):
    speaker = cell.add(Speaker)
    process = recorder(cell, tmp_path)
    listened(cell, JOINT_STATES.name)
    speaker.speak(50)
    cell.start('forward_kinematics_twin', robot='ur5')

    def answered():
        # Whoever is new hears nothing until both sides have met, and only it knows when that is.
        speaker.speak(1)
        time.sleep(0.02)
        return json.loads(cell.trigger('/recorder/counts').message).get('/twin/tool_pose', 0)

    cell.wait(answered, 'the twin to hear')
    speaker.speak(5)
    cell.wait_recorded({JOINT_STATES.name: speaker.number, '/twin/tool_pose': 6})
    heard_of(cell, process)
    assert finish(cell, process) == 0
    heard = provenance(tmp_path / 'bag')['completeness']['/twin/tool_pose']['sent']
    assert 6 <= heard <= speaker.number - 50
    told = re.search(
        rf"/forward_kinematics_twin has received {heard} of (\d+) messages on '/joint_states': "
        'what it publishes lacks the others',
        process.log,
    )
    # Held against what it has heard of is what the speaker had told half a second before.
    assert told and heard < int(told[1]) <= speaker.number


def longer_for_neighbours(cell, out):
    """Return how much longer [s] a recorder ends by neighbours that stand still, and if it names one."""
    out.mkdir()
    process = recorder(cell, out)
    twin, analyzer = (
        cell.start(node, robot='ur5') for node in ('forward_kinematics_twin', 'deviation_analyzer')
    )
    listened(cell, '/twin/tool_pose', 2)
    heard_of(cell, process)
    twin.signal(signal.SIGSTOP)
    analyzer.signal(signal.SIGSTOP)
    # Who answers has taken in what both told before they stood still: it is no word since the end.
    for _ in range(2):
        cell.trigger('/recorder/counts')
    try:
        spent = ended(cell, process)
    finally:
        twin.signal(signal.SIGCONT)
        analyzer.signal(signal.SIGCONT)
    told = '/forward_kinematics_twin has not told what it sent' in process.log
    assert bag_info(out / 'bag') is not None
    twin.stop()
    # How long a node takes to end with nobody in its way is the machine's own, and its load's.
    return spent - ended(cell, analyzer), told


def test_a_recorder_ends_soon_though_its_neighbours_stand_still(cell, tmp_path):
    # A busy machine makes an end longer, and none shorter; a word of the twin that was on its way as
    # it stood still comes late by chance, and the recorder has no reason to name it then.
    for trial in range(10):
        longer, told = longer_for_neighbours(cell, tmp_path / f'{trial}')
        if told and longer < 2.7:
            break
    assert told
    assert longer < 2.7


def test_publishers_that_ended_have_told_what_they_sent_and_each_counts_anew(cell, tmp_path):
    process = recorder(cell, tmp_path)
    for _ in range(2):
        speaker = cell.add(Speaker)
        heard_by(cell, speaker)
        speaker.speak(350)
        cell.remove(speaker)
    assert finish(cell, process) == 0
    assert numbers(tmp_path / 'bag') == 2 * list(range(350))
    told = provenance(tmp_path / 'bag')['completeness'][JOINT_STATES.name]
    assert told == {'sent': 700, 'recorded': 700, 'missing': 0}


def test_the_generator_meets_a_recorder_that_is_started_with_it(cell, tmp_path):
    generator = cell.start(
        'trajectory_generator', profile='aggressive', playback=20.0, exit_when_done=True
    )
    process = cell.start('recorder', out=str(tmp_path / 'bag'))
    assert cell.wait(lambda: generator.code is not None, 'the motion to end') is None
    assert finish(cell, process) == 0
    told = provenance(tmp_path / 'bag')['completeness'][JOINT_STATES.name]
    assert told['missing'] == 0
    assert told['sent'] > 100
    assert 'beginning: 1 subscribers of /joint_states' in generator.log


def test_a_generator_that_nobody_listens_to_says_so_and_begins(cell):
    generator = cell.start(
        'trajectory_generator', meet_within=0.5, playback=100.0, exit_when_done=True
    )
    assert generator.end() == 0
    said = 'waited 0.5 s for somebody to listen to /joint_states; beginning without'
    assert said in generator.log


def test_topics_of_any_type_and_best_effort_are_recorded_with_what_they_are(cell, tmp_path):
    process = recorder(cell, tmp_path, topics=['joint_states', '/chatter', '/gauge', '/nothing'])
    fast = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
    chatter = cell.node.create_publisher(String, '/chatter', 10)
    gauge = cell.node.create_publisher(Float64MultiArray, '/gauge', fast)
    joints = cell.node.create_publisher(JOINT_STATES.message_class(), '/joint_states', fast)
    for publisher in (chatter, gauge, joints):
        cell.wait(lambda p=publisher: p.get_subscription_count() > 0, publisher.topic_name)
    cell.meet()
    for k in range(5):
        chatter.publish(String(data=f'{k}'))
        gauge.publish(Float64MultiArray(data=[float(k)]))
        joints.publish(cell.messages.joint_state(FIRST + k, ROBOT.joint_names, np.zeros(6)))
    cell.wait_recorded({'/chatter': 5, '/gauge': 5, '/joint_states': 5})
    hashes = {
        info.topic_type: str(info.topic_type_hash)
        for topic in ('/chatter', '/gauge', '/joint_states')
        for info in cell.node.get_publishers_info_by_topic(topic)
    }
    assert finish(cell, process) == 0
    assert '/nothing: nobody published this topic' in process.log
    with next((tmp_path / 'bag').glob('*.mcap')).open('rb') as stream:
        summary = make_reader(stream).get_summary()
    for channel in summary.channels.values():
        kind = summary.schemas[channel.schema_id].name
        assert channel.metadata['topic_type_hash'] == hashes[kind]
        best_effort = channel.topic != '/chatter'
        asked = channel.metadata['offered_qos_profiles']
        assert ('reliability: best_effort' in asked or 'reliability: 2' in asked) == best_effort


def test_a_type_that_is_not_installed_is_named_with_its_package():
    with pytest.raises(ImportError, match='their_msgs/msg/Arc is not installed here; install'):
        message_class('their_msgs/msg/Arc')


def test_a_played_bag_is_recorded_whole_and_counted(cell, tmp_path):
    process = recorder(cell, tmp_path)
    words = [str(BAG), '--rate', '8', '--wait', '60', '--topics', '/joint_states', '/deviation']
    player = cell.start([sys.executable, '-m', 'weld_twin_nodes', 'bag', 'play', *words])
    cell.wait(lambda: player.code is not None, 'the bag to be played', limit=120.0)
    assert finish(cell, process) == 0
    told = provenance(tmp_path / 'bag')['completeness']
    with BagReader(BAG) as reader:
        for topic in ('/joint_states', '/deviation'):
            count = reader.topics[topic][1]
            assert told[topic] == {'sent': count, 'recorded': count, 'missing': 0}


def test_a_player_says_whom_nobody_listens_to(cell):
    said = []
    play(BAG, Playing(rate=100.0, topics=['/deviation'], wait=0.5), said.append)
    told = 'waited 0.5 s for 1 subscribers of /deviation; playing without'
    assert any(told in line for line in said), said


MOTION = ('/joint_states', '/actual/joint_states', '/measured/tool_pose', '/twin/tool_pose')
"""Topics with one message for every sample of the motion."""
SUBSCRIBERS = dict(zip(MOTION, (3, 1, 2, 2), strict=True))
"""The recorder, and the nodes that take each of them in."""


def test_a_cell_started_by_hand_is_recorded_from_the_first_to_the_last_message(cell, tmp_path):
    """One that is launched is so in `test_four_processes`."""

    def heard(topic):
        return cell.node.count_subscribers(topic) == SUBSCRIBERS[topic]

    process = cell.start('recorder', out=str(tmp_path / 'bag'))
    for name in ('deviation_analyzer', 'forward_kinematics_twin', 'error_injector'):
        cell.start(name)
    cell.wait(lambda: all(map(heard, SUBSCRIBERS)), 'the nodes that listen')
    motion = {'profile': 'aggressive', 'playback': 4.0, 'exit_when_done': True}
    cell.start('trajectory_generator', **motion)
    generator = cell.processes[-1]
    cell.wait(lambda: generator.code is not None, 'the motion to end', limit=120.0)
    assert finish(cell, process) == 0
    told = provenance(tmp_path / 'bag')['completeness']
    with BagReader(tmp_path / 'bag') as reader:
        held = {topic: reader.topics.get(topic, ('', 0))[1] for topic in MOTION}
    sent = held['/joint_states']
    assert sent > 100
    assert held == dict.fromkeys(MOTION, sent), process.log
    # What a node told of itself before it went; each word of it must be borne out by the bag.
    for topic in set(MOTION) & set(told):
        assert told[topic] == {'sent': sent, 'recorded': sent, 'missing': 0}, process.log


def test_the_description_of_the_cell_is_recorded_and_tells_the_robot(cell, tmp_path):
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    description = cell.node.create_publisher(String, '/robot_description', latched)
    write_urdf(tmp_path / 'arm.urdf', ROBOT)
    description.publish(String(data=(tmp_path / 'arm.urdf').read_text()))
    process = recorder(cell, tmp_path)
    cell.wait_recorded({'/robot_description': 1})
    assert finish(cell, process) == 0
    noted = provenance(tmp_path / 'bag')['robot']
    assert tuple(joint['name'] for joint in noted['joints']) == ROBOT.joint_names
