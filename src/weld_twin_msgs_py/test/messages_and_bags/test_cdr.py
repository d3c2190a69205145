# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Serialised messages read and written here, against the serialiser of rosbags."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from weld_twin_core.errors import DataError
from weld_twin_core.recording import JointMotion
from weld_twin_msgs_py.messages import from_messages
from weld_twin_msgs_py.messages.cdr import (
    READERS,
    JointStateDecoder,
    JointStateEncoder,
    PoseCovarianceEncoder,
    PoseEncoder,
    Vector3Encoder,
    decoder,
)
from weld_twin_msgs_py.messages.to_messages import bag_messages
from weld_twin_msgs_py.messages.typestore import TYPES, decode

MAKE = bag_messages()
NS = 1_700_000_000_123_456_789
TURN = Rotation.from_rotvec([0.3, -1.2, 0.7]).as_matrix()
MOTION = JointMotion(np.arange(3.0), np.arange(6.0).reshape(3, 2), np.ones((3, 2)))
JOINTS = 'sensor_msgs/msg/JointState'


def cdr(message, little=True):
    return bytes(TYPES.serialize_cdr(message, message.__msgtype__, little_endian=little))


def transform(frame, child):
    pose = MAKE.pose(NS, np.arange(3.0), TURN, frame)
    of = TYPES.types
    where = of['geometry_msgs/msg/Transform'](
        translation=of['geometry_msgs/msg/Vector3'](*np.arange(3.0)),
        rotation=pose.pose.orientation,
    )
    return of['geometry_msgs/msg/TransformStamped'](pose.header, child, where)


def numbers_of(item):
    where = item.transform
    p, q = where.translation, where.rotation
    return [*map(ord, item.child_frame_id), p.x, p.y, p.z, q.x, q.y, q.z, q.w]


def pose_numbers(message):
    position, rotation = from_messages.pose(message)
    return [*position, *rotation.flat]


P = np.arange(3.0)
SURE = MAKE.pose_with_covariance(NS, P, TURN, np.diag(np.arange(1.0, 7.0)), 'tracker')
FRAMES = TYPES.types['tf2_msgs/msg/TFMessage']([transform('a', 'bc'), transform('abc', 'd')])
TEXT = TYPES.types['std_msgs/msg/String'](data='<robot name="Schweißer"/>')
SAMPLES = [
    (SURE, lambda m: [*pose_numbers(m), from_messages.position_sigma(m)]),
    (transform('tracker', 'probe'), numbers_of),
    (FRAMES, lambda m: [n for item in m.transforms for n in numbers_of(item)]),
    (MAKE.pose(NS, P, TURN, 'tracker'), pose_numbers),
    (MAKE.point(NS, P, 'a'), from_messages.point),
    (MAKE.vector3(NS, P, ''), from_messages.vector3),
    (MAKE.wrench(NS, np.arange(6.0)), from_messages.wrench),
    (MAKE.temperature(NS, 21.5, 'arm'), from_messages.temperature),
    (
        MAKE.joint_trajectory(NS, ('b', 'a'), MOTION),
        lambda m: from_messages.joint_trajectory(m, ('a', 'b')).q,
    ),
    (MAKE.path(NS, np.tile(np.eye(4), (3, 1, 1)), 'world'), from_messages.path_points),
    (TEXT, lambda m: [ord(c) for c in m.data]),
]
SAMPLES = {sample[0].__msgtype__: sample for sample in SAMPLES}


@pytest.mark.parametrize('kind', READERS)
@pytest.mark.parametrize('little', [True, False])
def test_every_input_type_reads_as_rosbags_wrote_it(kind, little):
    message, numbers = SAMPLES[kind]
    read = decoder(kind)(cdr(message, little))
    np.testing.assert_array_equal(numbers(read), numbers(message))
    if hasattr(message, 'header'):
        assert from_messages.stamp_ns(read) == from_messages.stamp_ns(message)
        assert read.header.frame_id == message.header.frame_id


@given(
    st.lists(st.text('ab_c/', min_size=1, max_size=9), unique=True, max_size=8),
    st.text('world', max_size=6),
    st.booleans(),
    st.booleans(),
)
def test_joint_states_read_the_same_the_first_time_and_again(names, frame, fast, little):
    decode_joints = JointStateDecoder()
    for k in range(3):
        q = np.arange(len(names)) + 0.25 * k
        message = MAKE.joint_state(NS + k, names, q, -q if fast else None, frame)
        read = decode_joints(cdr(message, little))
        assert read.name == tuple(names)
        assert read.header.frame_id == frame
        assert from_messages.stamp_ns(read) == NS + k
        assert read.position == tuple(q)
        assert read.velocity == (tuple(-q) if fast else ())


@pytest.mark.parametrize('kind', [JOINTS, *READERS])
@given(st.binary(max_size=200))
def test_bytes_that_are_no_message_give_a_sentence_or_a_message(kind, tail):
    try:
        decoder(kind)(b'\x00\x01\x00\x00' + tail)
    except DataError as error:
        assert kind in str(error)


@pytest.mark.parametrize('kind', READERS)
def test_a_message_cut_anywhere_is_refused_and_promises_are_not_believed(kind):
    whole = cdr(SAMPLES[kind][0])
    for end in range(len(whole) - 4 if kind == 'std_msgs/msg/String' else len(whole)):
        with pytest.raises(DataError, match='no ' + kind):
            decoder(kind)(whole[:end])


def test_a_length_of_four_thousand_million_costs_nothing():
    with pytest.raises(DataError, match='promises 4294967295'):
        decoder(JOINTS)(b'\0\1\0\0' + bytes(8) + b'\1\0\0\0\0\0\0\0' + b'\xff' * 4)


@pytest.mark.parametrize('frame', ['', 'w', 'world', 'base_link_inertia'])
def test_an_encoded_pose_is_the_message_rosbags_reads(frame):
    data = PoseEncoder(frame)(NS, np.array([1.0, -2.0, 3e-9]), TURN)
    message = decode(data, 'geometry_msgs/msg/PoseStamped')
    position, rotation = from_messages.pose(message)
    assert message.header.frame_id == frame
    assert from_messages.stamp_ns(message) == NS
    np.testing.assert_array_equal(position, [1.0, -2.0, 3e-9])
    np.testing.assert_allclose(rotation, TURN, rtol=0.0, atol=1e-15)


@pytest.mark.parametrize('frame', ['', 'world', 'base_link_inertia'])
def test_an_encoded_pose_with_covariance_is_the_message_rosbags_reads(frame):
    covariance = np.arange(36.0).reshape(6, 6) * 1e-9
    data = PoseCovarianceEncoder(frame)(NS, np.array([1.0, -2.0, 3e-9]), TURN, covariance)
    message = decode(data, 'geometry_msgs/msg/PoseWithCovarianceStamped')
    inner = message.pose.pose
    assert (message.header.frame_id, from_messages.stamp_ns(message)) == (frame, NS)
    assert (inner.position.x, inner.position.y, inner.position.z) == (1.0, -2.0, 3e-9)
    turned = Rotation.from_quat(
        [inner.orientation.x, inner.orientation.y, inner.orientation.z, inner.orientation.w]
    )
    np.testing.assert_allclose(turned.as_matrix(), TURN, atol=1e-15)
    np.testing.assert_array_equal(message.pose.covariance, covariance.ravel())


def test_an_encoded_vector_is_the_message_rosbags_reads():
    data = Vector3Encoder('base')(NS, np.array([1e-3, -2e-3, 3e-9]))
    message = decode(data, 'geometry_msgs/msg/Vector3Stamped')
    assert (message.header.frame_id, from_messages.stamp_ns(message)) == ('base', NS)
    np.testing.assert_array_equal(from_messages.vector3(message), [1e-3, -2e-3, 3e-9])


@given(st.lists(st.text('ab_c', min_size=1, max_size=9), unique=True, min_size=1, max_size=8))
def test_encoded_joint_states_are_the_messages_rosbags_reads(names):
    q = np.arange(len(names)) + 0.5
    for qd in (None, -q):
        message = decode(JointStateEncoder(names)(NS, q, qd), JOINTS)
        assert (list(message.name), from_messages.stamp_ns(message)) == (names, NS)
        np.testing.assert_array_equal(message.position, q)
        np.testing.assert_array_equal(message.velocity, [] if qd is None else qd)
        assert message.effort.size == 0
