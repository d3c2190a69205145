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
