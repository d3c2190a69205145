# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Serialised messages read and written here, one by one and at once, against rosbags."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from weld_twin_core import DataError, JointMotion
from weld_twin_msgs_py.assembly import Intake, Role
from weld_twin_msgs_py.bags import BagReader, BagWriter, from_bag, read_recording, write_recording
from weld_twin_msgs_py.bags.from_bag import Stream, fill_regular
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
from weld_twin_msgs_py.messages.topics import TopicNames
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
def test_encoded_poses_are_the_messages_rosbags_reads(frame):
    place, covariance = np.array([1.0, -2.0, 3e-9]), np.arange(36.0).reshape(6, 6) * 1e-9
    plain = PoseEncoder(frame)(NS, place, TURN)
    sure = PoseCovarianceEncoder(frame)(NS, place, TURN, covariance)
    kinds = ('PoseStamped', 'PoseWithCovarianceStamped')
    read = [
        decode(data, f'geometry_msgs/msg/{kind}')
        for data, kind in zip((plain, sure), kinds, strict=True)
    ]
    for message in read:
        position, rotation = from_messages.pose(message)
        assert (message.header.frame_id, from_messages.stamp_ns(message)) == (frame, NS)
        np.testing.assert_array_equal(position, place)
        np.testing.assert_allclose(rotation, TURN, rtol=0.0, atol=1e-15)
    np.testing.assert_array_equal(read[1].pose.covariance, covariance.ravel())


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


ROLES = {
    TopicNames().joints: Role.JOINTS,
    TopicNames().pose: Role.POSE,
    TopicNames().wrench: Role.WRENCH,
    TopicNames().temperature: Role.TEMPERATURE,
}


@pytest.fixture
def messages(tmp_path, recording, robot):
    """Topic, type, time and bytes of the first half second of a usual bag."""
    write_recording(tmp_path / 'usual', recording, robot)
    with BagReader(tmp_path / 'usual') as bag:
        return list(bag.raw(bag.topics))[:100]


def write(path, messages, storage='mcap'):
    with BagWriter(path, storage=storage) as bag:
        for topic, kind, log_ns, data in messages:
            bag.write_cdr(topic, kind, bytes(data), log_ns)
    return path


def everything(path, robot):
    """Return what reading a bag gives, refusals included, as something that compares."""
    try:
        got = read_recording(path, robot)
    except DataError as error:
        return str(error)
    arrays = [got.joints.t, got.joints.q, got.joints.qd]
    if got.measured is not None:
        seen = got.measured
        arrays += [seen.t, seen.position, seen.rotation, seen.sigma]
    for signal in (got.wrench, got.temperature):
        arrays += [] if signal is None else [signal.t, signal.value]
    numbers = [None if each is None else each.tobytes() for each in arrays]
    return numbers, got.notes, got.incomplete, got.wrench_frame, got.epoch_ns, got.joints.static


def at_once(path, robot):
    with BagReader(path) as bag:
        streams = {role: Stream(topic, Intake.width(role, robot)) for topic, role in ROLES.items()}
        return fill_regular(bag, ROLES, streams, Intake(robot, limits=False))


def one_by_one(path, robot, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(from_bag, 'fill_regular', lambda *_: False)
        return everything(path, robot)


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_the_usual_bag_is_read_at_once_and_alike(tmp_path, robot, messages, storage, monkeypatch):
    bag = write(tmp_path / 'bag', messages, storage)
    assert at_once(bag, robot)
    assert everything(bag, robot) == one_by_one(bag, robot, monkeypatch)


def _flip(data, rng):
    data[rng.integers(len(data))] ^= 1 << rng.integers(8)


def _not_a_number(data, rng):
    data[-8:] = np.array(rng.choice([np.nan, np.inf, -np.inf, 1e300])).tobytes()


def _unset_stamp(data, _):
    data[4:12] = bytes(8)


def _stamp_of_another_time(data, rng):
    data[4:8] = int(rng.integers(-5, 2**31 - 1)).to_bytes(4, 'little', signed=True)


def _big_endian(data, _):
    data[1] = 0


def _rubbish_in_padding(data, _):
    data[2:4] = b'\x5a\x5a'


def _shorter(data, rng):
    del data[int(rng.integers(len(data))) :]


def _longer(data, rng):
    data += bytes(int(rng.integers(1, 9)))


CHANGES = (_flip, _not_a_number, _unset_stamp, _stamp_of_another_time)
CHANGES += (_big_endian, _rubbish_in_padding, _shorter, _longer)


@pytest.mark.parametrize('seed', range(2))
@pytest.mark.parametrize('change', CHANGES)
def test_changed_messages_give_the_same_samples_or_the_same_refusal(
    tmp_path, robot, messages, monkeypatch, change, seed
):
    rng = np.random.default_rng(seed)
    changed = [(topic, kind, ns, bytearray(data)) for topic, kind, ns, data in messages]
    for _ in range(rng.integers(1, 4)):
        change(changed[rng.integers(len(changed))][3], rng)
    bag = write(tmp_path / 'bag', changed)
    assert everything(bag, robot) == one_by_one(bag, robot, monkeypatch)


@pytest.mark.parametrize('seed', range(2))
def test_messages_in_another_order_are_read_alike(tmp_path, robot, messages, monkeypatch, seed):
    """Recorded late, twice, or not at all: each topic then has gaps, repeats or steps back."""
    rng = np.random.default_rng(seed)
    order = np.arange(len(messages))
    first, second = rng.integers(len(messages), size=2)
    order[first], order[second] = order[second], order[first]
    times = sorted(message[2] for message in messages)
    shuffled = [(*messages[k][:2], ns, messages[k][3]) for k, ns in zip(order, times, strict=True)]
    del shuffled[int(rng.integers(len(shuffled)))]
    shuffled.insert(int(first) // 2, shuffled[int(first) // 2])
    bag = write(tmp_path / 'bag', shuffled)
    assert everything(bag, robot) == one_by_one(bag, robot, monkeypatch)


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_damaged_files_are_read_alike(tmp_path, robot, messages, storage, monkeypatch):
    bag = write(tmp_path / 'bag', messages, storage)
    file = next(path for path in bag.iterdir() if path.suffix != '.yaml')
    whole = file.read_bytes()
    for place in np.random.default_rng(2).integers(0, len(whole), 12):
        damaged = bytearray(whole)
        damaged[place] ^= 0xFF
        file.write_bytes(damaged)
        assert everything(bag, robot) == one_by_one(bag, robot, monkeypatch)


def test_of_a_bag_that_is_only_looked_through_the_last_samples_are_kept_alone():
    kept, passing = (Stream('/joint_states', 2, kept=keep) for keep in (True, False))
    for stream in (kept, passing):
        for k in range(100):
            stream.extend(np.arange(10 * k, 10 * k + 10), np.full((10, 2), float(k)))
        stream.append(1000, (7.0, 8.0))
    assert (len(kept), len(passing)) == (1001, 1)
    np.testing.assert_array_equal(passing.samples().rows, kept.samples().rows[-1:])
