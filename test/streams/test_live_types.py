# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Running nodes beside trackers and controllers that publish other types, names and frames.

The others live in a participant of their own: real messages of `tf2_msgs` and `control_msgs`.
"""

import json
import time
from functools import partial
from importlib import import_module

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='needs ROS 2')

from participants import participant, placed
from rclpy.qos import DurabilityPolicy, QoSProfile
from scipy.spatial.transform import Rotation

from weld_twin_core import forward, load
from weld_twin_msgs_py.bags import BagReader
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.topics import TWIN_BASE, TWIN_POSE
from weld_twin_nodes.harness import Cell
from weld_twin_nodes.harness.cell import HealthListener
from weld_twin_nodes.live.deviation_analyzer import DeviationAnalyzer
from weld_twin_nodes.live.forward_kinematics_twin import ForwardKinematicsTwin

pytestmark = [pytest.mark.cells, pytest.mark.usefixtures('packages')]

ROBOT = load('ur5')
NAMES = ROBOT.joint_names
Q = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])
BEYOND = Q + [0.0, 0.0, 2e-3, 0.0, 0.0, 0.0]
OFF = np.array([1e-3, 2e-3, -3e-3])
S = 1_000_000_000
EXACT = 1e-9
BEAT = 0.02
"""Seconds between two measurements."""


@pytest.fixture
def cell(tmp_path):
    with Cell(tmp_path / 'cell') as cell:
        yield cell


@pytest.fixture
def other(cell):
    with participant('other', cell.domain) as node:
        yield node


def kind(name):
    package, message = name.split('/')
    return getattr(import_module(f'{package}.msg'), message)


def publisher(cell, other, name, topic, *, latched=False):
    """Return a publisher that the cell knows of."""
    durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
    out = other.create_publisher(kind(name), topic, QoSProfile(depth=10, durability=durability))
    cell.wait(lambda: cell.node.count_publishers(topic) > 0, topic)
    return out


def tf(*transforms):
    return kind('tf2_msgs/TFMessage')(transforms=list(transforms))


def pose(T):
    def make(stamp):
        out = kind('geometry_msgs/PoseWithCovarianceStamped')()
        each = placed(T, stamp, 'world', '')
        out.header = each.header
        p, where = out.pose.pose.position, each.transform
        p.x, p.y, p.z = T[:3, 3].tolist()
        out.pose.pose.orientation = where.rotation
        return out

    return make


def controller(reference, feedback, names=NAMES):
    def make(stamp):
        out = kind('control_msgs/JointTrajectoryControllerState')(joint_names=list(names))
        out.header.stamp.sec, out.header.stamp.nanosec = divmod(stamp, S)
        out.reference.positions, out.feedback.positions = list(reference), list(feedback)
        return out

    return make


def dynamic(q, names=NAMES):
    def make(stamp):
        value = kind('control_msgs/InterfaceValue')
        out = kind('control_msgs/DynamicJointState')(joint_names=list(names))
        out.header.stamp.sec, out.header.stamp.nanosec = divmod(stamp, S)
        out.interface_values = [
            value(interface_names=['effort', 'position'], values=[9.0, each]) for each in q
        ]
        return out

    return make


T = forward(ROBOT, Q)
SHIFTED = T.copy()
SHIFTED[:3, 3] += OFF
MEASURED = (
    (pose(SHIFTED), OFF),
    (lambda ns: placed(SHIFTED, ns, 'world', 'probe'), OFF),
    (lambda ns: tf(placed(np.eye(4), ns, 'a', 'b'), placed(SHIFTED, ns, 'world', 'probe')), OFF),
    (controller(Q, BEYOND), (forward(ROBOT, BEYOND) - T)[:3, 3]),
)
"""What is measured, in messages of four types, and the deviation; UR5 stands in the world as its base
does, so both axes are one."""
MIXED = [3, 1, 5, 0, 2, 4]


def test_the_twin_takes_what_a_controller_feeds_back_where_it_is_told_to(cell, other):
    make = controller(BEYOND, Q)
    theirs, stamp = other.create_publisher(type(make(S)), '/joint_states', 10), [S]
    cell.add(ForwardKinematicsTwin, joint_part='feedback')
    poses = cell.collect(TWIN_POSE.name)

    def step():
        stamp[0] += S // 100
        theirs.publish(make(stamp[0]))
        return len(poses) > 2

    cell.wait(step, 'poses')
    np.testing.assert_allclose(from_messages.pose(poses.last)[0], T[:3, 3], atol=1e-12)


def turned(x, angle):
    T = np.eye(4)
    T[:3, :3], T[0, 3] = Rotation.from_rotvec([0.0, 0.0, angle]).as_matrix(), x
    return T


T_WORLD_TRACKER = turned(2.0, 0.7)


class TrackedCell:
    """An analyzer in 'world', and a tracker that measures in a frame of its own."""

    def __init__(self, cell, other):
        self.cell, self.other = cell, other
        self.fixed = publisher(cell, other, 'tf2_msgs/TFMessage', '/tf_static', latched=True)
        self.moving = publisher(cell, other, 'tf2_msgs/TFMessage', '/tf')
        self.tracker = publisher(cell, other, 'geometry_msgs/PointStamped', '/measured/tool_point')
        cell.add(DeviationAnalyzer, measuring_frame='world')
        self.health, self.deviations = HealthListener(cell.node), cell.collect('/deviation')
        self.twin, self.base = cell.publisher(TWIN_POSE), cell.publisher(TWIN_BASE)
        self.base.publish(cell.messages.pose(S, np.zeros(3), np.eye(3), 'world'))
        self.stamp, self.due = S, 0.0

    def step(self, frame='tracker'):
        """Send the pose of the twin, and the same point with OFF as the tracker sees it, on a beat."""
        if time.monotonic() < self.due:
            return
        self.due = time.monotonic() + BEAT
        self.stamp += round(BEAT * S)
        self.twin.publish(self.cell.messages.pose(self.stamp, T[:3, 3], T[:3, :3], 'world'))
        out = kind('geometry_msgs/PointStamped')()
        out.header.stamp.sec, out.header.stamp.nanosec = divmod(self.stamp, S)
        out.header.frame_id = frame
        seen = np.linalg.inv(T_WORLD_TRACKER) @ [*(T[:3, 3] + OFF), 1.0]
        out.point.x, out.point.y, out.point.z = seen[:3].tolist()
        self.tracker.publish(out)

    def wait_told(self, sentence, also=lambda: None, **options):
        def told():
            self.step(**options)
            also()
            return any(
                sentence in text
                for name, entries in self.health.told.items()
                if name.startswith('/deviation_analyzer')
                for level, text in entries
                if level != 'ok'
            )

        self.cell.wait(told, f'{sentence!r} to be told')

    def assert_compared(self):
        self.deviations.messages.clear()

        def step():
            self.step()
            return len(self.deviations) > 2

        self.cell.wait(step, 'deviations')
        np.testing.assert_allclose(from_messages.vector3(self.deviations.last), OFF, atol=EXACT)


def test_measurements_are_carried_by_tf_and_what_is_wrong_with_it_is_told(cell, other):
    tracked = TrackedCell(cell, other)
    tracked.fixed.publish(tf(placed(T_WORLD_TRACKER, 0, 'world', 'tracker')))
    tracked.assert_compared()
    tracked.wait_told(
        "from 'camera' to 'world' is not known: 'camera' is not in /tf", frame='camera'
    )
    loop = tf(placed(np.eye(4), S, 'tracker', 'world'))
    tracked.wait_told(
        "makes a loop: 'world' in 'tracker'", also=lambda: tracked.moving.publish(loop)
    )
    tracked.assert_compared()


def test_a_frame_that_moves_and_then_falls_silent_is_told_and_nothing_is_made_up(cell, other):
    tracked = TrackedCell(cell, other)

    def moving():
        before = tracked.stamp
        tracked.step()
        if tracked.stamp > before:
            T = placed(T_WORLD_TRACKER, tracked.stamp, 'world', 'tracker')
            tracked.moving.publish(tf(T))
        return len(tracked.deviations) > 2

    cell.wait(moving, 'deviations')
    np.testing.assert_allclose(from_messages.vector3(tracked.deviations.last), OFF, atol=EXACT)
    tracked.wait_told("the last transform of 'tracker' in 'world' is ")
    tracked.deviations.messages.clear()
    last = tracked.stamp

    def again():
        moving()
        return len(tracked.deviations) > 0 and tracked.deviations.stamps[-1] > last

    cell.wait(again, 'deviations of after the silence')
    for message in tracked.deviations.messages:
        np.testing.assert_allclose(from_messages.vector3(message), OFF, atol=EXACT)


def test_the_base_is_taken_from_tf_and_told_when_it_moves(cell, other):
    fixed = publisher(cell, other, 'tf2_msgs/TFMessage', '/tf_static', latched=True)
    fixed.publish(tf(placed(turned(1.5, 0.4), 0, 'tracker', 'base_link')))
    frames = {'measuring_frame': 'tracker', 'base_frame': 'base_link', 'base_from_tf': True}
    cell.add(ForwardKinematicsTwin, **frames)
    bases, health = cell.collect(TWIN_BASE.name), HealthListener(cell.node)
    cell.wait(lambda: len(bases) > 0, 'the base')
    position, rotation = from_messages.pose(bases.last)
    np.testing.assert_allclose(position, turned(1.5, 0.4)[:3, 3], atol=1e-12)
    np.testing.assert_allclose(rotation, turned(1.5, 0.4)[:3, :3], atol=1e-12)
    fixed.publish(tf(placed(turned(1.504, 0.4), 0, 'tracker', 'base_link')))
    said = "'base_link' has moved in 'tracker' by 4 mm and 0 degrees since this node started"
    node = '/forward_kinematics_twin'
    cell.wait(lambda: any(said in text for _, text in health.told[node]), said)


def test_running_nodes_follow_publishers_of_one_type_after_the_other(cell, other):
    """Each publisher comes after the nodes, has the topic for itself, and goes."""
    remap = ['--ros-args', '-r', 'measured/tool_pose:=/tracker']
    module = 'weld_twin_nodes.live.deviation_analyzer'
    options = ['-p', 'measured_frame:=probe']
    nodes = [
        cell.start(['python', '-m', module, *remap, *options]),
        cell.start('forward_kinematics_twin'),
    ]
    deviations, poses = cell.collect('/deviation'), cell.collect(TWIN_POSE.name)
    base, stamp = cell.publisher(TWIN_BASE), [S]
    base.publish(cell.messages.pose(S, np.zeros(3), np.eye(3), 'world'))
    mixed = dynamic(Q[MIXED], [NAMES[k] for k in MIXED])
    plain = partial(cell.messages.joint_state, names=NAMES, q=Q)
    turns = zip(MEASURED, (mixed, controller(Q, BEYOND), plain, mixed), strict=True)
    for (measured, expected), state in turns:
        theirs = [
            (other.create_publisher(type(make(S)), topic, 10), make)
            for topic, make in (('/tracker', measured), ('/joint_states', state))
        ]

        def step(theirs=theirs, begun=stamp[0]):
            stamp[0] += S // 100
            for publisher, make in theirs:
                publisher.publish(make(stamp[0]))
            time.sleep(BEAT)
            new = begun + BEAT * S
            return all(len(tap) and tap.stamps[-1] > new for tap in (deviations, poses))

        types = ' and '.join(type(make(S)).__name__ for _, make in theirs)
        cell.wait(step, f'deviations by {types}')
        got = from_messages.vector3(deviations.last)
        np.testing.assert_allclose(got, expected, atol=1e-8, err_msg=types)
        got = from_messages.pose(poses.last)[0]
        np.testing.assert_allclose(got, T[:3, 3], atol=1e-12, err_msg=types)
        for publisher, _ in theirs:
            other.destroy_publisher(publisher)
    assert [node.stop() for node in nodes] == [0, 0]


def test_a_recorder_takes_the_type_of_a_publisher_that_comes_after_it(cell, other, tmp_path):
    out, topic = tmp_path / 'bag', '/measured/tool_pose'
    process = cell.start('recorder', out=str(out), topics=[topic])
    cell.wait(lambda: cell.node.count_subscribers(topic) == 1, 'the recorder')
    theirs = other.create_publisher(kind('geometry_msgs/TransformStamped'), topic, 10)
    stamp = [S]

    def step():
        stamp[0] += S // 100
        theirs.publish(placed(SHIFTED, stamp[0], 'world', 'probe'))
        return json.loads(cell.trigger('/recorder/counts').message)[topic] > 3

    cell.wait(step, 'some to be recorded')
    assert process.stop() == 0
    with BagReader(out) as bag:
        found = [each.message for each in bag.messages([topic])]
    assert len(found) > 3
    assert {each.child_frame_id for each in found} == {'probe'}


def test_measurements_beyond_those_that_may_wait_are_refused_and_counted(cell, other, monkeypatch):
    monkeypatch.setattr('weld_twin_nodes.live.robot_settings.MOST', 5)
    tracked = TrackedCell(cell, other)
    moving = tf(placed(T_WORLD_TRACKER, S, 'world', 'tracker'))
    tracked.wait_told(
        '5 measurements wait already for the transforms of their time',
        also=lambda: tracked.moving.publish(moving),
    )
