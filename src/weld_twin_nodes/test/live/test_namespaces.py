# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Two robots on one domain, and topics under other names, over DDS."""

import numpy as np
import pytest
from geometry_msgs.msg import PoseArray, PoseStamped, Vector3Stamped
from participants import participant
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

from weld_twin_core import JointMotion, forward, load
from weld_twin_msgs_py.bags import BagReader, read_recording
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.topics import (
    DIAGNOSTICS,
    JOINT_STATES,
    MEASURED_POSE,
    ROBOT_DESCRIPTION,
    TopicNames,
)
from weld_twin_msgs_py.robots import write_urdf
from weld_twin_nodes.cli.main import main
from weld_twin_nodes.harness.cell import HealthListener
from weld_twin_nodes.live.deviation_analyzer import DeviationAnalyzer
from weld_twin_nodes.live.error_injector import ErrorInjector
from weld_twin_nodes.live.forward_kinematics_twin import ForwardKinematicsTwin
from weld_twin_nodes.live.recorder import Recorder

pytestmark = pytest.mark.cells

S = 1_000_000_000
ROBOTS = {'left': 'ur5', 'right': 'ur10'}
OFFSETS = {'left': 1e-3, 'right': -2e-3}


def motion(seconds=1.0, rate=50.0):
    t = np.arange(0.0, seconds, 1.0 / rate)
    rest = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
    return JointMotion(t, rest + 0.2 * np.sin(np.outer(t, np.arange(1.0, 7.0))))


def spaced(name):
    return ['--ros-args', '-r', f'__ns:=/{name}']


def publishers(cell, topic):
    return {
        name: cell.node.create_publisher(
            topic.message_class(), f'/{name}{topic.name}', topic.offered.to_rclpy()
        )
        for name in ROBOTS
    }


@pytest.fixture
def two(cell, tmp_path):
    """Run injector, twin, analyzer and recorder of either robot in a namespace of its own."""
    recorders = []
    for name, robot in ROBOTS.items():
        offset = f'[{{effect: joint_offset, joint: elbow_joint, offset: {OFFSETS[name]}}}]'
        common = {'robot': robot, 'reliable_inputs': True, 'cli_args': spaced(name)}
        cell.add(ErrorInjector, effects=offset, **common)
        cell.add(ForwardKinematicsTwin, **common)
        cell.add(DeviationAnalyzer, **common)
        recorders.append(cell.add(Recorder, out=str(tmp_path / name), cli_args=spaced(name)))
    return cell, recorders


def test_two_robots_in_namespaces_are_recorded_and_told_apart(two, tmp_path, capsys):
    two, recorders = two
    heard = two.collect(DIAGNOSTICS.name)
    deviations = {name: two.collect(f'/{name}/deviation', Vector3Stamped) for name in ROBOTS}
    states = publishers(two, JOINT_STATES)
    two.wait(
        lambda: all(p.get_subscription_count() >= 3 for p in states.values()), 'the listeners'
    )
    two.wait(
        lambda: all(two.node.count_subscribers(f'/{n}/deviation') > 1 for n in ROBOTS), 'taps'
    )
    run = motion()
    for k, t in enumerate(run.t):
        for name, publisher in states.items():
            stamp = S + round(t * 1e9)
            publisher.publish(
                two.messages.joint_state(stamp, load(ROBOTS[name]).joint_names, run.q[k])
            )
        two.wait(
            lambda k=k: all(len(tap) > k - 5 for tap in deviations.values()), 'the deviations'
        )
    two.wait(lambda: all(len(tap) == run.t.size for tap in deviations.values()), 'all deviations')
    for name, tap in deviations.items():
        robot = load(ROBOTS[name])
        moved = run.q + OFFSETS[name] * np.eye(6)[2]
        expected = forward(robot, moved)[:, :3, 3] - forward(robot, run.q)[:, :3, 3]
        got = np.stack([from_messages.vector3(message) for message in tap.messages])
        np.testing.assert_allclose(got, expected, rtol=0.0, atol=1e-9)
    for name, robot in ROBOTS.items():
        node = f'/{name}/forward_kinematics_twin'
        wanted = {(part, f'{name}/{robot}') for part in (node, f'{node}: /{name}/joint_states')}
        two.wait(lambda wanted=wanted: wanted <= told_of(heard), f'the health of {node}')
    for node in recorders:
        two.remove(node)
    told_apart_in_bags(tmp_path, run, capsys)


def told_of(heard):
    """Return names and robots of all statuses heard."""
    return {(s.name, s.hardware_id) for message in heard.messages for s in message.status}


def told_apart_in_bags(tmp_path, run, capsys):
    for name, robot in ROBOTS.items():
        with BagReader(tmp_path / name) as bag:
            spaces = {topic.split('/')[1] for topic, (_, count) in bag.topics.items() if count}
        assert spaces - {'diagnostics'} == {name}
        assert main(['bag', str(tmp_path / name), '--namespace', name]) == 0
        assert f'/{name}/measured/tool_pose' in capsys.readouterr().out
        back = read_recording(tmp_path / name, load(robot), TopicNames.within(name))
        assert (back.joints.t.size, back.measured.t.size) == (run.t.size, run.t.size)


def test_the_description_of_a_namespace_is_its_own(cell, tmp_path):
    row = ROBOT_DESCRIPTION
    for name, robot in ROBOTS.items():
        write_urdf(tmp_path / f'{name}.urdf', load(robot))
        text = (tmp_path / f'{name}.urdf').read_text()
        latched = cell.node.create_publisher(
            row.message_class(), f'/{name}{row.name}', row.offered.to_rclpy()
        )
        latched.publish(row.message_class()(data=text))
    q = motion().q[0]
    for name, robot in ROBOTS.items():
        node = cell.add(ForwardKinematicsTwin, robot='topic', cli_args=spaced(name))
        np.testing.assert_allclose(forward(node.robot, q), forward(load(robot), q), atol=1e-9)


def told(health, node):
    return '; '.join(text for _, text in health.of(node))


def test_publishers_are_counted_under_the_remapped_name(cell):
    remapped = ['--ros-args', '-r', 'joint_states:=/cell/arm/states']
    cell.add(ForwardKinematicsTwin, cli_args=remapped)
    health = HealthListener(cell.node)
    publisher = cell.node.create_publisher(JointState, '/cell/arm/states', 10)
    key = '/forward_kinematics_twin: /cell/arm/states'
    cell.wait(lambda: health.values.get(key, {}).get('publishers') == '1', 'the publisher')
    cell.node.destroy_publisher(publisher)
    cell.wait(lambda: health.values[key]['publishers'] == '0', 'its end')


@pytest.fixture
def tracker(cell):
    with participant('tracker', cell.domain, 'cell') as node:
        yield node


def test_a_publisher_of_another_type_is_told_of_by_name_and_for_as_long(cell, tracker):
    remapped = ['--ros-args', '-r', 'measured/tool_pose:=/tracker/pose']
    cell.add(DeviationAnalyzer, cli_args=remapped)
    health = HealthListener(cell.node)
    publisher = tracker.create_publisher(PoseArray, '/tracker/pose', 10)
    sentence = (
        '/tracker/pose: /cell/tracker sends geometry_msgs/msg/PoseArray, this node '
        'needs geometry_msgs/msg/PoseStamped or '
    )
    cell.wait(lambda: sentence in told(health, 'deviation_analyzer'), 'the type to be told')
    tracker.destroy_publisher(publisher)
    health.clear()
    own = '/deviation_analyzer'
    cell.wait(lambda: ('ok', 'running') in health.told[own], 'the node to be ok again')


def test_a_quality_of_service_that_does_not_match_is_told_of_under_the_remapped_name(cell):
    remapped = ['--ros-args', '-r', 'measured/tool_pose:=/tracker/pose']
    cell.add(DeviationAnalyzer, reliable_inputs=True, cli_args=remapped)
    health = HealthListener(cell.node)
    hasty = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
    cell.node.create_publisher(PoseStamped, '/tracker/pose', hasty)
    cell.node.create_subscription(PoseStamped, MEASURED_POSE.name, lambda _: None, 10)
    sentence = 'reliability: best_effort is offered, reliable asked for'
    cell.wait(lambda: sentence in told(health, 'deviation_analyzer'), 'the mismatch to be told')
    assert '/tracker/pose: /harness does not match' in told(health, 'deviation_analyzer')


def test_joint_states_in_another_namespace_are_told_with_what_to_do(cell, tracker):
    cell.add(ForwardKinematicsTwin)
    health = HealthListener(cell.node)
    tracker.create_publisher(
        JointState, '/actual/joint_states', 10
    )  # an injector's, and no namespace
    astray = tracker.create_publisher(JointState, '/left/joint_states', 10)
    sentence = (
        '/joint_states has no publisher, but /cell/tracker publishes /left/joint_states: start '
        'this node in the namespace /left, or remap the topic'
    )
    cell.wait(lambda: sentence in told(health, 'forward_kinematics_twin'), 'the other namespace')
    tracker.destroy_publisher(astray)
    found = tracker.create_publisher(JointState, '/joint_states', 10)
    cell.wait(lambda: found.get_subscription_count() > 0, 'the node to listen to it')
    cell.wait(lambda: cell.node.count_publishers('/joint_states') > 0, 'the publisher')
    health.clear()
    own = '/forward_kinematics_twin'
    cell.wait(lambda: ('ok', 'running') in health.told[own], 'the node to be ok again')


def test_another_publisher_that_takes_over_is_told_by_its_name(cell, tracker):
    before = tracker.create_publisher(JointState, '/joint_states', 10)
    cell.wait(lambda: cell.node.count_publishers('/joint_states') > 0, 'the first publisher')
    cell.add(ForwardKinematicsTwin)
    health = HealthListener(cell.node)
    own = '/forward_kinematics_twin'
    cell.wait(lambda: len(health.told[own]) > 1, 'two looks at the first one')
    cell.node.create_publisher(JointState, '/joint_states', 10)
    tracker.destroy_publisher(before)
    sentence = '/joint_states comes from /harness now, it came from /cell/tracker'
    cell.wait(lambda: sentence in told(health, 'forward_kinematics_twin'), 'the new publisher')
