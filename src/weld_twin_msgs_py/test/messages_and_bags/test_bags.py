# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
import os
import shutil
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from weld_twin_core import DataError, JointMotion, Measurements, Recording
from weld_twin_msgs_py.bags import (
    BagReader,
    BagWriter,
    provenance,
    read_recording,
    recover,
    write_recording,
)
from weld_twin_msgs_py.messages.to_messages import bag_messages
from weld_twin_msgs_py.messages.topics import TopicNames

STORAGES = ('mcap', 'sqlite3')
SECOND = 1_000_000_000


@pytest.fixture(params=STORAGES)
def storage(request):
    return request.param


def assert_same(back, recording):
    np.testing.assert_allclose(back.joints.t, recording.joints.t, atol=1e-9)
    np.testing.assert_array_equal(back.joints.q, recording.joints.q)
    np.testing.assert_array_equal(back.joints.qd, recording.joints.qd)
    np.testing.assert_allclose(back.measured.t, recording.measured.t, atol=1e-9)
    np.testing.assert_array_equal(back.measured.position, recording.measured.position)
    np.testing.assert_allclose(back.measured.rotation, recording.measured.rotation, atol=1e-14)
    np.testing.assert_allclose(back.measured.sigma, recording.measured.sigma, rtol=1e-14)
    np.testing.assert_array_equal(back.wrench.value, recording.wrench.value)
    np.testing.assert_array_equal(back.temperature.value, recording.temperature.value)
    assert back.wrench_frame == recording.wrench_frame
    assert back.epoch_ns == recording.epoch_ns


def write_messages(path, messages, storage='mcap', **options):
    with BagWriter(path, storage=storage, **options) as bag:
        for k, (topic, message) in enumerate(messages):
            bag.write(topic, message, (k + 1) * SECOND)


def joint_states(stamps, names=('shoulder', 'elbow')):
    make = bag_messages()
    q = np.arange(len(names)) * 0.1
    return [('/joint_states', make.joint_state(ns, names, q + 1e-9 * ns)) for ns in stamps]


# Round trips ---------------------------------------------------------------------------------


def test_a_recording_survives_the_bag_its_single_file_and_the_loss_of_metadata(
    tmp_path, robot, recording, storage
):
    bag = tmp_path / 'mine.bag'  # as a directory may be called
    made = {'seed': 7, 'effects': [{'effect': 'backlash', 'joint': 'elbow', 'width': 5e-4}]}
    write_recording(bag, recording, robot, storage=storage, provenance=made)
    back = read_recording(bag, robot)
    assert_same(back, recording)
    assert (back.name, back.notes) == ('mine.bag', ())
    (note,) = read_recording(bag, replace(robot, name='other')).notes
    assert f"of robot '{robot.name}', and 'other' was given" in note
    (file,) = (path for path in bag.iterdir() if path.suffix != '.yaml')
    told = provenance(bag)
    assert told.items() >= {**made, 'robot': robot.to_mapping(), 'static': False}.items()
    alone = shutil.copy(file, tmp_path / f'alone{file.suffix}')
    write_recording(tmp_path / 'another', recording, robot, provenance={'static': None})
    beside = shutil.copy(file, tmp_path / 'another' / f'beside{file.suffix}')
    (bag / 'metadata.yaml').unlink()
    for place in (alone, beside, bag):  # what its writer said of it goes along with the file
        assert_same(read_recording(place, robot), recording)
        assert provenance(place) == told


def test_another_reader_finds_the_same_numbers(tmp_path, robot, recording):
    write_recording(tmp_path / 'bag', recording, robot)
    stamps, positions, points = [], [], []
    with open(tmp_path / 'bag' / 'bag.mcap', 'rb') as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            stamp = decoded.header.stamp
            assert message.log_time == stamp.sec * SECOND + stamp.nanosec
            if channel.topic == '/joint_states':
                assert list(decoded.name) == ['shoulder', 'elbow']
                stamps.append(message.log_time)
                positions.append(list(decoded.position))
            if channel.topic == '/measured/tool_pose':
                p = decoded.pose.position
                points.append([p.x, p.y, p.z])
    expected = recording.epoch_ns + np.round(recording.joints.t * 1e9).astype(np.int64)
    np.testing.assert_array_equal(stamps, expected)
    np.testing.assert_array_equal(positions, recording.joints.q)
    np.testing.assert_array_equal(points, recording.measured.position)


def test_a_bag_of_another_writer_is_read(tmp_path, robot, storage):
    store = get_typestore(Stores.ROS2_HUMBLE)
    kind = 'sensor_msgs/msg/JointState'
    plugin = {'mcap': StoragePlugin.MCAP, 'sqlite3': StoragePlugin.SQLITE3}[storage]
    with Writer(tmp_path / 'theirs', version=8, storage_plugin=plugin) as bag:
        connection = bag.add_connection('/robot/joints', kind, typestore=store)
        for _, message in joint_states([5 * SECOND, 6 * SECOND]):
            bag.write(connection, SECOND, bytes(store.serialize_cdr(message, kind)))
    back = read_recording(tmp_path / 'theirs', robot, TopicNames(joints='robot/joints'))
    np.testing.assert_array_equal(back.joints.t, [0.0, 1.0])
    assert back.epoch_ns == 5 * SECOND
    assert back.measured is None


def test_points_are_read_where_there_are_no_poses(tmp_path, robot, recording):
    points = Measurements(recording.measured.t, recording.measured.position)
    write_recording(tmp_path / 'bag', recording.with_measured(points), robot)
    back = read_recording(tmp_path / 'bag', robot).measured
    np.testing.assert_array_equal(back.position, points.position)
    assert back.rotation is None
    assert back.sigma is None


def test_sigma_is_that_of_the_same_stamp_and_none_where_one_pose_has_none(tmp_path, robot):
    make, stamps, read = bag_messages(), [k * SECOND for k in (1, 2, 3)], {}
    poses = [('/measured/tool_pose', make.pose(ns, np.ones(3), np.eye(3))) for ns in stamps]
    sure = [('/measured/sigma', make.vector3(ns, np.array([1e-5, 2e-5, 2e-5]))) for ns in stamps]
    for count in (3, 2):
        write_messages(tmp_path / f'{count}', [*joint_states(stamps), *poses, *sure[:count]])
        read[count] = read_recording(tmp_path / f'{count}', robot).measured.sigma
    np.testing.assert_allclose(read[3], np.sqrt(3.0) * 1e-5)
    assert read[2] is None


def test_poses_win_over_points_with_a_note(tmp_path, robot):
    make = bag_messages()
    pose = make.pose(SECOND, np.ones(3), np.eye(3))
    point = make.point(SECOND, np.zeros(3))
    write_messages(
        tmp_path / 'bag',
        [*joint_states([SECOND]), ('/measured/tool_point', point), ('/measured/tool_pose', pose)],
    )
    back = read_recording(tmp_path / 'bag', robot)
    np.testing.assert_array_equal(back.measured.position, np.ones((1, 3)))
    assert "'/measured/tool_pose' is used, '/measured/tool_point' beside it is not" in back.notes


def test_results_are_written_beside_the_inputs(tmp_path, robot, recording):
    m = recording.measured
    n = recording.joints.t.size
    twin = (np.ones((n, 3)), np.tile(np.eye(3), (n, 1, 1)))
    write_recording(
        tmp_path / 'bag',
        recording,
        robot,
        actual=recording.joints.q + 1.0,
        twin=twin,
        deviation=m.position * 2.0,
    )
    with BagReader(tmp_path / 'bag') as bag:
        deviations = [m.message.vector.x for m in bag.messages(['/deviation'])]
        actual = [m.message.position[1] for m in bag.messages(['/actual/joint_states'])]
        assert bag.topics['/twin/tool_pose'] == ('geometry_msgs/msg/PoseStamped', n)
    np.testing.assert_array_equal(deviations, m.position[:, 0] * 2.0)
    np.testing.assert_array_equal(actual, recording.joints.q[:, 1] + 1.0)


# Writing -------------------------------------------------------------------------------------


def test_notes_are_read_back_wherever_a_line_of_the_metadata_is_broken(tmp_path):
    row = "it's [\N{DEGREE SIGN}], a [\N{DEGREE SIGN}] " * 9
    told = {f'{k} letters': 'x' * k + row for k in range(60)}
    with BagWriter(tmp_path / 'bag', provenance=told) as bag:
        bag.write_all(())
    assert provenance(tmp_path / 'bag') == told


def test_nothing_is_overwritten(tmp_path, robot, recording):
    (tmp_path / 'bag').mkdir()
    with pytest.raises(DataError, match=r"bag' exists already and is not .*; give another name$"):
        write_recording(tmp_path / 'bag', recording, robot)
    assert list(tmp_path.rglob('*')) == [tmp_path / 'bag']


def test_a_failure_half_way_leaves_nothing(tmp_path, storage):
    with pytest.raises(RuntimeError), BagWriter(tmp_path / 'bag', storage=storage) as bag:
        bag.write(*joint_states([SECOND])[0])
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []


def test_the_bag_appears_only_when_it_is_closed(tmp_path, storage):
    bag = BagWriter(tmp_path / 'bag', storage=storage).open()
    bag.write(*joint_states([SECOND])[0])
    assert not (tmp_path / 'bag').exists()
    bag.close()
    assert [path.name for path in tmp_path.iterdir()] == ['bag']
    bag.close()


def test_writing_to_a_closed_bag_is_refused(tmp_path):
    with pytest.raises(DataError, match='is not open for writing'):
        BagWriter(tmp_path / 'bag').write(*joint_states([SECOND])[0])


def test_a_place_that_cannot_be_written_is_named(tmp_path, robot, recording):
    (tmp_path / 'file').write_text('')
    with pytest.raises(DataError, match=r"bag '.*file/bag' cannot be written: "):
        write_recording(tmp_path / 'file' / 'bag', recording, robot)


def test_an_unknown_storage_is_refused(tmp_path):
    with pytest.raises(DataError, match="storage must be one of mcap, sqlite3, got 'zip'"):
        BagWriter(tmp_path / 'bag', storage='zip')


# Bad inputs ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ('name', 'words'),
    [
        ('notes.txt', 'expected a rosbag2 directory, a .mcap or a .db3 file'),
        ('old.bag', 'is a ROS 1 bag; convert it with rosbags-convert first'),
        ('mine.csv', 'a table becomes one with weld-twin import$'),
        ('empty.mcap', 'damaged or was cut short'),
        ('empty.db3', 'damaged or was cut short'),
        ('', r'holds neither metadata\.yaml nor'),
        ('folder/nowhere', r"^there is no bag at '.*nowhere'$"),
    ],
)
def test_files_that_are_no_bag_are_refused(tmp_path, robot, name, words):
    if '.' in name:
        (tmp_path / name).write_bytes(b'')
    with pytest.raises(DataError, match=words):
        read_recording(tmp_path / name, robot)


@pytest.mark.parametrize('share', [0.01, 0.3, 0.7, 0.99])
def test_a_bag_cut_short_gives_one_sentence_and_no_open_file(
    tmp_path, robot, recording, storage, share
):
    write_recording(tmp_path / 'bag', recording, robot, storage=storage)
    file = next(path for path in (tmp_path / 'bag').iterdir() if path.suffix != '.yaml')
    whole = file.read_bytes()
    file.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(DataError, match=r"^bag '.*' is damaged or was cut short \(") as caught:
        read_recording(tmp_path / 'bag', robot)
    assert '\n' not in str(caught.value)
    opened = (Path(f'/proc/self/fd/{number}') for number in os.listdir('/proc/self/fd'))
    assert file.resolve() not in {one.resolve() for one in opened}


def test_damaged_metadata_is_refused(tmp_path, robot, recording):
    write_recording(tmp_path / 'bag', recording, robot)
    (tmp_path / 'bag' / 'metadata.yaml').write_text('rosbag2_bagfile_information: [')
    with pytest.raises(DataError, match='damaged or was cut short'):
        read_recording(tmp_path / 'bag', robot)


def states_at(*seconds, names=('shoulder', 'elbow')):
    return joint_states([k * SECOND for k in seconds], names)


@pytest.mark.parametrize(
    ('messages', 'words'),
    [
        (
            [('/other', message) for _, message in states_at(1)],
            "^the bag has no joint states on '/joint_states'; '/other' has that type, "
            'try --joint-topic /other$',
        ),
        (
            [*states_at(1), ('/measured/tool_pose', bag_messages().point(SECOND, np.zeros(3)))],
            "'/measured/tool_pose' has the type geometry_msgs/msg/PointStamped, but this use",
        ),
        (
            states_at(1, names=('shoulder', 'wrist')),
            "message 0 of '/joint_states': the joint state has no joint 'elbow'; "
            'it has shoulder, wrist',
        ),
        (states_at(1, names=('j0', 'j1')), r"robot 'two': shoulder, elbow.* j0, j1\. If"),
        (
            states_at(1, names=[f'j{k}' for k in range(40)]),
            r"holds a joint of robot 'two': shoulder, elbow.* and more\. If",
        ),
        (states_at(0, 0, 0), r"^header\.stamp is unset in all 3 messages of '/joint_states'; set"),
        (
            states_at(50, 51, 20),
            r"'/joint_states' jump back by 31\.000 s at message 2: the clock was set",
        ),
    ],
)
def test_what_cannot_be_used_is_an_error_that_says_what_is_there(tmp_path, robot, messages, words):
    write_messages(tmp_path / 'bag', messages)
    with pytest.raises(DataError, match=words):
        read_recording(tmp_path / 'bag', robot)


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
@pytest.mark.parametrize('steady', [False, True], ids=['its own stamps', 'stamps of another'])
def test_a_clock_set_back_while_it_was_recorded_is_told_and_mended(
    tmp_path, robot, storage, steady
):
    first, then = [50, 51, 52, 53], [51, 52, 53, 54]
    stamps = range(50, 58) if steady else first + then
    with BagWriter(tmp_path / 'bag', storage=storage) as bag:
        states = joint_states([k * SECOND for k in stamps])
        for log, (topic, message) in zip(first + then, states, strict=True):
            bag.write(topic, message, log * SECOND)
    told = (
        r"set back by 2\.000 s at message 4 of '/joint_states', .* 'weld-twin bag recover .*bag'"
    )
    with pytest.raises(DataError, match=told):
        read_recording(tmp_path / 'bag', robot)
    mended = recover(tmp_path / 'bag')
    assert 'each file as a recording' in mended.damage[0]
    if steady:
        q = read_recording(mended.path, robot).joints.q
        np.testing.assert_allclose(q[:, 0], np.arange(50.0, 58.0))
        return
    with pytest.raises(DataError, match=r'jump back by 2\.000 s'):
        read_recording(mended.path, robot)
    files = sorted(file for file in mended.path.iterdir() if file.suffix != '.yaml')
    for file, each in zip(files, (first, then), strict=True):
        np.testing.assert_allclose(read_recording(file, robot).joints.q[:, 0], each)


def test_clocks_without_overlap_and_topics_without_a_message_are_an_error(
    tmp_path, robot, recording
):
    late = replace(recording.measured, t=recording.measured.t + 1000.0)
    write_recording(tmp_path / 'bag', recording.with_measured(late), robot)
    with pytest.raises(DataError, match=r'do not overlap in time, they are 996\.\d{3} s apart'):
        read_recording(tmp_path / 'bag', robot)
    with pytest.raises(DataError, match="no message on '/tracker'"):
        read_recording(tmp_path / 'bag', robot, TopicNames(point='/tracker'))


# Odd but usable ------------------------------------------------------------------------------


def test_late_repeated_and_unstamped_messages_are_counted(tmp_path, robot):
    tenth = SECOND // 10
    order = [50, 51, 53, 52, 53, 54]
    states = joint_states([k * tenth for k in order]) + joint_states([0])
    write_messages(tmp_path / 'bag', states)
    back = read_recording(tmp_path / 'bag', robot)
    np.testing.assert_allclose(back.joints.t, [0.0, 0.1, 0.3, 0.4], atol=1e-9)
    np.testing.assert_allclose(back.joints.q[:, 0], [5.0, 5.1, 5.3, 5.4])
    assert back.notes == (
        "1 messages of '/joint_states' without a stamp dropped",
        "1 messages of '/joint_states' with a stamp before the last one dropped",
        "1 messages of '/joint_states' with a repeated stamp dropped",
    )


def test_a_gripper_on_the_same_topic_is_passed_over(tmp_path, robot):
    states = joint_states([SECOND]) + joint_states([SECOND + 5], ('finger',))
    write_messages(tmp_path / 'bag', states + joint_states([SECOND + SECOND // 10]))
    back = read_recording(tmp_path / 'bag', robot)
    assert back.joints.t.size == 2
    assert back.notes == ("1 messages of '/joint_states' hold no joint of the robot",)


@pytest.mark.parametrize(
    ('frame', 'expected'),
    [('', 'tool'), ('tool0', 'tool'), ('base_link', 'base'), ('world', 'base')],
)
def test_the_wrench_is_in_the_frame_its_header_names(tmp_path, robot, frame, expected):
    wrench = bag_messages().wrench(SECOND, np.arange(6.0), frame)
    write_messages(tmp_path / 'bag', [*joint_states([SECOND]), ('/tool_wrench', wrench)])
    assert read_recording(tmp_path / 'bag', robot).wrench_frame == expected


# Static stations -----------------------------------------------------------------------------


def stations(spacing, seed=0):
    rng = np.random.default_rng(seed)
    t = np.arange(30) * spacing
    return Recording(
        'stations',
        JointMotion(t, rng.uniform(-2.0, 2.0, (30, 2))),
        Measurements(t + 0.01 * spacing, rng.normal(size=(30, 3))),
    )


def read_alone(tmp_path, recording, robot):
    """Return what is read of a file of which its writer says nothing."""
    write_recording(tmp_path / 'bag', recording, robot, provenance={'static': None})
    return read_recording(shutil.move(tmp_path / 'bag/bag.mcap', tmp_path / 'alone.mcap'), robot)


@pytest.mark.parametrize('spacing', [1.0, 60.0, 0.1])
def test_one_joint_state_per_measurement_far_apart_is_static(tmp_path, robot, spacing):
    back = read_alone(tmp_path, stations(spacing), robot)
    assert back.joints.static
    assert back.notes == ('30 static stations: the motion between them is not known',)


def test_a_smooth_motion_measured_at_every_joint_state_is_not_static(tmp_path, robot):
    t = np.arange(200) * 0.01
    q = np.stack([np.sin(t), np.cos(t)], axis=1)
    motion = Recording('m', JointMotion(t, q), Measurements(t, np.ones((200, 3))))
    assert not read_alone(tmp_path, motion, robot).joints.static


@pytest.mark.parametrize('every', [1, 12, 150])
def test_joint_states_of_two_arms_in_turn_are_refused_and_a_garbled_one_is_not(
    every, tmp_path, robot
):
    # The second stands at zero, and tells so a millisecond after every so many of the first.
    t = np.arange(200) * 0.01
    q = np.stack([1.0 + np.sin(t), np.cos(t)], axis=1)
    both = np.concatenate([t, t[every - 1 :: every] + 1e-3])
    order = np.argsort(both)
    other = np.concatenate([q, np.zeros((both.size - t.size, 2))])
    motion = JointMotion(both[order], other[order])
    mixed = Recording('mixed', motion, Measurements(t, np.ones((200, 3))))
    if every == 150:
        assert read_alone(tmp_path, mixed, robot).joints.t.size == 201
    else:
        with pytest.raises(DataError, match='two publishers share'):
            read_alone(tmp_path, mixed, robot)


@pytest.mark.parametrize('lap', [2, 3])
def test_stations_with_home_between_them_are_no_two_arms(lap, tmp_path, robot):
    still = stations(0.02)
    q = still.joints.q.copy()
    q[::lap] = 0.5
    home = replace(still, joints=JointMotion(still.joints.t, q))
    assert read_alone(tmp_path, home, robot).joints.static


def test_what_the_writer_knew_about_stations_is_believed(tmp_path, robot):
    known = replace(stations(1.0), measured=None)
    known = replace(known, joints=replace(known.joints, static=True))
    write_recording(tmp_path / 'bag', known, robot)
    assert read_recording(tmp_path / 'bag', robot).joints.static


# Size ----------------------------------------------------------------------------------------


def test_reading_holds_the_numbers_wanted_and_not_the_messages(tmp_path, robot, storage):
    count = 6000
    with BagWriter(tmp_path / 'bag', storage=storage) as bag:
        message = joint_states([SECOND])[0][1]
        message.header.frame_id = 'x' * 3000
        for k in range(count):
            message.header.stamp.nanosec = k
            bag.write('/joint_states', message)
    size = sum(file.stat().st_size for file in (tmp_path / 'bag').iterdir())
    tracemalloc.start()
    back = read_recording(tmp_path / 'bag', robot)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert back.joints.t.size == count
    assert size > 15e6
    assert peak < 6e6
