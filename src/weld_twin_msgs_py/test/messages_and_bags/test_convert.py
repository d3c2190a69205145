# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages to arrays and back, and the public table of topics."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.goals import corrected_trajectory, read_goal
from weld_twin_msgs_py.messages.to_messages import bag_messages, ros_messages
from weld_twin_msgs_py.messages.topics import BY_NAME, TOPICS, TopicNames
from weld_twin_msgs_py.messages.typestore import decode

NS = 1_700_000_000_987_654_321


@pytest.fixture(params=['rclpy', 'rosbags'])
def make(request):
    if request.param == 'rclpy':
        pytest.importorskip('rclpy')
        return ros_messages()
    return bag_messages()


@pytest.fixture
def joints(make):
    q = np.array([3.0, 1.0, 2.0])
    return make.joint_state(NS, ['c', 'a', 'b'], q, 0.1 * q)


def test_joints_are_matched_by_name_in_any_order_and_extras_left_out(joints):
    np.testing.assert_array_equal(from_messages.joint_positions(joints, ('a', 'c')), [1.0, 3.0])
    back = from_messages.joint_velocities(joints, ('b', 'a'))
    np.testing.assert_allclose(back, [0.2, 0.1], rtol=1e-15)


def joint_b(value, rate=None):
    """Return what makes a message in which joint b is there, and where it has a rate."""
    rates = None if rate is None else np.array([rate, 0.0])
    return lambda make: make.joint_state(NS, ['b', 'a'], np.array([*value, 0.0]), rates)


def unturned(make):
    message = make.pose(NS, np.zeros(3), np.eye(3))
    message.pose.orientation.w = 0.0
    return message


def joints_of(read, *names):
    return lambda message: read(message, names)


POSITIONS, RATES = from_messages.joint_positions, from_messages.joint_velocities
REFUSED = [
    (joint_b([1.0]), joints_of(POSITIONS, 'a', 'd'), "^the joint state has no joint 'd'; it has b, a$"),
    (joint_b([np.nan]), joints_of(POSITIONS, 'a', 'b'), "^joint 'b' has the position nan; it must be"),
    (joint_b([np.inf]), joints_of(POSITIONS, 'a', 'b'), "^joint 'b' has the position inf; it must be"),
    (joint_b([]), joints_of(POSITIONS, 'a'), '2 names but 1 positions'),
    (joint_b([0.0], np.inf), joints_of(RATES, 'b'), 'velocity inf'),
    (lambda make: make.point(0, np.zeros(3)), from_messages.stamp_ns,
     r'header\.stamp is 0 ns: the publisher left it unset'),
    (unturned, from_messages.pose, 'orientation of the pose 0 has length 0'),
    (lambda make: make.point(NS, np.array([0.0, np.nan, 0.0])), from_messages.point, 'the point is'),
    *((lambda make, celsius=celsius: make.temperature(NS, celsius), from_messages.temperature, words)
      for celsius, words in ((np.nan, 'no temperature'), (-300.0, 'no temperature'),
                             (296.0, 'looks like kelvin'))),
    (lambda make: make.diagnostics(NS, 'deviation', {'rms_m': 'many'}), from_messages.metrics,
     "metrics 'deviation'"),
]  # fmt: skip


@pytest.mark.parametrize(('made', 'read', 'words'), REFUSED, ids=[row[2] for row in REFUSED])
def test_what_a_message_cannot_mean_is_refused(make, made, read, words):
    with pytest.raises(DataError, match=words):
        read(made(make))


def test_a_joint_that_is_not_asked_for_may_be_no_number(make):
    assert POSITIONS(joint_b([np.nan])(make), ('a',)) == [0.0]


@pytest.mark.parametrize('qd', [None, np.array([0.1, np.nan])])
def test_velocity_that_is_absent_or_nan_is_unknown(make, qd):
    message = make.joint_state(NS, ['a', 'b'], np.zeros(2), qd)
    assert from_messages.joint_velocities(message, ('a', 'b')) is None


def test_stamps_are_exact_to_the_nanosecond(joints):
    assert from_messages.stamp_ns(joints) == NS


def test_a_quarter_turn_about_z_takes_x_to_y(make):
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    message = make.pose(NS, np.array([1.0, 2.0, 3.0]), turn)
    q = message.pose.orientation
    np.testing.assert_allclose([q.x, q.y, q.z, q.w], [0, 0, np.sqrt(0.5), np.sqrt(0.5)])
    position, rotation = from_messages.pose(message)
    np.testing.assert_array_equal(position, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(rotation, turn, atol=1e-15)


def test_rotations_survive_the_message(make):
    halves = [np.diag(d) for d in ([1.0, -1, -1], [-1.0, 1, -1], [-1.0, -1, 1])]
    for matrix in [*Rotation.random(200, random_state=3).as_matrix(), np.eye(3), *halves]:
        _, back = from_messages.pose(make.pose(NS, np.zeros(3), matrix))
        np.testing.assert_allclose(back, matrix, atol=1e-15)


def test_vectors_and_metrics_come_back_as_they_went(make):
    six = np.arange(1.0, 7.0)
    np.testing.assert_array_equal(from_messages.point(make.point(NS, six[:3])), six[:3])
    np.testing.assert_array_equal(from_messages.vector3(make.vector3(NS, six[:3])), six[:3])
    message = make.wrench(NS, six)
    assert (message.wrench.force.x, message.wrench.torque.z) == (1.0, 6.0)
    np.testing.assert_array_equal(from_messages.wrench(message), six)
    message = make.diagnostics(NS, 'deviation', {'rms_m': 0.1 + 0.2, 'samples': 12}, level=1)
    assert from_messages.metrics(message) == {'rms_m': 0.1 + 0.2, 'samples': 12.0}
    assert from_messages.diagnostics(message)['deviation']['samples'] == '12'


def test_ros_messages_serialise_to_what_rosbags_reads():
    serialization = pytest.importorskip('rclpy.serialization')
    q, qd = np.array([0.1, 0.2]), np.array([1.0, 2.0])
    # a frame and joint names of these lengths leave four bytes after the empty effort
    message = ros_messages().joint_state(NS, ['a', 'b'], q, qd, 'ba')
    data = serialization.serialize_message(message)
    theirs = decode(data, 'sensor_msgs/msg/JointState')
    assert from_messages.stamp_ns(theirs) == NS
    np.testing.assert_array_equal(from_messages.joint_positions(theirs, ('b', 'a')), [0.2, 0.1])


def trajectory(names=('track', 'left_b', 'left_a'), velocities=(), count=3):
    """Return two points, a second apart, of a track and two joints in another order."""
    points = [
        SimpleNamespace(
            positions=[0.5 + k, 0.1 + k, 0.2 + k][:count],
            velocities=list(velocities),
            accelerations=[],
            time_from_start=SimpleNamespace(sec=k, nanosec=900_000_000),
        )
        for k in range(2)
    ]
    return SimpleNamespace(joint_names=list(names), points=points)


@pytest.mark.parametrize('velocities', [(), (7.0, 8.0, 9.0)])
def test_corrected_joints_go_where_they_came_from_and_all_else_stays(velocities):
    given = trajectory(velocities=velocities)
    goal, columns = read_goal(given, ('a', 'b'))
    np.testing.assert_array_equal(goal.q, [[0.2, 0.1], [1.2, 1.1]])
    np.testing.assert_array_equal(goal.t, [0.9, 1.9])
    rates = np.array([[9.0, 8.0]] * 2) if velocities else None
    assert (goal.qd is None) is (rates is None) and goal.qdd is None
    moved = goal._replace(q=goal.q + [10.0, 20.0], qd=None if rates is None else rates + 1.0)
    made = corrected_trajectory(given, columns, moved, 0.25)
    assert [point.positions for point in made.points] == [[0.5, 20.1, 10.2], [1.5, 21.1, 11.2]]
    fast = [7.0, 9.0, 10.0] if velocities else []
    assert [(point.velocities, point.accelerations) for point in made.points] == [(fast, [])] * 2
    since = [(point.time_from_start.sec, point.time_from_start.nanosec) for point in made.points]
    assert since == [(1, 150_000_000), (2, 150_000_000)]
    assert given.points[0].positions == [0.5, 0.1, 0.2]


@pytest.mark.parametrize(
    ('given', 'said'),
    [
        (trajectory(count=2), 'every point of the goal must have 3 positions'),
        (trajectory(velocities=(1.0,)), 'has 3 velocities, or none has any'),
        (trajectory(('track', 'a', 'a')), "names joint 'a' twice"),
        (trajectory(('track', 'a', 'c')), "has no joint 'b'; it has track, a, c"),
        (trajectory(('l/a', 'l/b', 'r/a', 'r/b')), 'several robots, with the prefixes l/, r/'),
    ],
)
def test_goals_that_cannot_be_corrected_are_refused(given, said):
    with pytest.raises(DataError, match=said):
        read_goal(given, ('a', 'b'))


INPUTS = ('/joint_states', '/measured/tool_pose', '/measured/tool_point', '/tool_wrench')


def test_names_and_types_are_those_of_the_public_interface():
    assert {topic.name: topic.type.replace('/msg/', '/') for topic in TOPICS} == {
        '/joint_states': 'sensor_msgs/JointState',
        '/actual/joint_states': 'sensor_msgs/JointState',
        '/measured/tool_pose': 'geometry_msgs/PoseStamped',
        '/measured/tool_point': 'geometry_msgs/PointStamped',
        '/measured/sigma': 'geometry_msgs/Vector3Stamped',
        '/twin/tool_pose': 'geometry_msgs/PoseStamped',
        '/twin/tool_pose_with_covariance': 'geometry_msgs/PoseWithCovarianceStamped',
        '/deviation': 'geometry_msgs/Vector3Stamped',
        '/deviation/metrics': 'diagnostic_msgs/DiagnosticArray',
        '/diagnosis': 'diagnostic_msgs/DiagnosticArray',
        '/tool_wrench': 'geometry_msgs/WrenchStamped',
        '/temperature': 'sensor_msgs/Temperature',
        '/contact': 'sensor_msgs/Range',
        '/measured/image_points': 'sensor_msgs/PointCloud2',
    }


def test_names_given_without_a_slash_get_one():
    assert TopicNames(joints='cell/joints').joints == '/cell/joints'


@pytest.mark.parametrize('name', BY_NAME)
def test_who_sends_and_who_hears_match_whoever_made_them(name):
    """Drivers of sensors send best effort, controllers reliably; so do others ask for ours."""
    qos = pytest.importorskip('rclpy.qos')
    theirs = [
        qos.QoSProfile(
            depth=5,
            reliability=reliability,
            durability=qos.DurabilityPolicy.VOLATILE,
            liveliness=qos.LivelinessPolicy.AUTOMATIC,
        )
        for reliability in (qos.ReliabilityPolicy.RELIABLE, qos.ReliabilityPolicy.BEST_EFFORT)
    ]
    offered, asked = BY_NAME[name].offered.to_rclpy(), BY_NAME[name].requested.to_rclpy()
    pairs = [(offered, asked), *((offered, other) for other in theirs)]
    pairs += [(other, asked) for other in theirs if name in INPUTS]
    for pair in pairs:
        verdict, reason = qos.qos_check_compatible(*pair)
        assert verdict == qos.QoSCompatibility.OK, reason


def test_message_classes_are_those_of_the_table():
    pytest.importorskip('rclpy')
    for topic in TOPICS:
        assert topic.message_class().__name__ == topic.type.rsplit('/', 1)[1]
