# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
import pytest

from weld_twin_msgs_py.messages.topics import BY_NAME, TOPICS, TopicNames

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


@pytest.mark.parametrize('name', [topic.name for topic in TOPICS])
def test_our_subscribers_receive_from_our_publishers(name):
    qos = pytest.importorskip('rclpy.qos')
    topic = BY_NAME[name]
    offered, requested = topic.offered.to_rclpy(), topic.requested.to_rclpy()
    verdict, reason = qos.qos_check_compatible(offered, requested)
    assert verdict == qos.QoSCompatibility.OK, reason


def _foreign(qos, reliability):
    return qos.QoSProfile(
        depth=5,
        reliability=reliability,
        durability=qos.DurabilityPolicy.VOLATILE,
        liveliness=qos.LivelinessPolicy.AUTOMATIC,
    )


@pytest.mark.parametrize('name', INPUTS)
@pytest.mark.parametrize('reliability', ['RELIABLE', 'BEST_EFFORT'])
def test_inputs_are_received_from_controllers_and_from_sensor_drivers(name, reliability):
    qos = pytest.importorskip('rclpy.qos')
    offered = _foreign(qos, qos.ReliabilityPolicy[reliability])
    verdict, reason = qos.qos_check_compatible(offered, BY_NAME[name].requested.to_rclpy())
    assert verdict == qos.QoSCompatibility.OK, reason


@pytest.mark.parametrize('name', [topic.name for topic in TOPICS])
@pytest.mark.parametrize('reliability', ['RELIABLE', 'BEST_EFFORT'])
def test_our_publishers_serve_reliable_and_best_effort_subscribers(name, reliability):
    qos = pytest.importorskip('rclpy.qos')
    requested = _foreign(qos, qos.ReliabilityPolicy[reliability])
    verdict, reason = qos.qos_check_compatible(BY_NAME[name].offered.to_rclpy(), requested)
    assert verdict == qos.QoSCompatibility.OK, reason


def test_message_classes_are_those_of_the_table():
    pytest.importorskip('rclpy')
    for topic in TOPICS:
        assert topic.message_class().__name__ == topic.type.rsplit('/', 1)[1]
