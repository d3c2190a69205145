# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a bag is said to hold, and which of its streams begins late or ends early."""

import numpy as np
import pytest

from weld_twin_core import DataError, Robot, catalog
from weld_twin_core.bursts import ONE_CLOCK
from weld_twin_msgs_py.bags import BagWriter, bag_info, read_recording, write_recording
from weld_twin_msgs_py.bags.needed import COMPLETENESS, Ends, never_recorded, uneven_ends
from weld_twin_msgs_py.messages.to_messages import bag_messages
from weld_twin_msgs_py.messages.topics import TopicNames

SECOND = 1_000_000_000


def write_joints(path, stamps, topic='/joint_states'):
    make = bag_messages()
    with BagWriter(path) as bag:
        for k, ns in enumerate(stamps):
            bag.write(topic, make.joint_state(ns, ['a'], np.zeros(1)), SECOND + k)


def test_rates_counts_and_uses_of_a_whole_bag(tmp_path, robot, recording):
    write_recording(tmp_path / 'bag', recording, robot)
    info = bag_info(tmp_path / 'bag')
    topics = {topic.name: topic for topic in info.topics}
    assert {name: (t.count, t.use) for name, t in topics.items()} == {
        '/joint_states': (400, 'joints'),
        '/measured/tool_pose': (90, 'pose'),
        '/measured/sigma': (90, 'sigma'),
        '/tool_wrench': (200, 'wrench'),
        '/temperature': (4, 'temperature'),
    }
    assert topics['/joint_states'].rate_hz == pytest.approx(125.0)
    assert topics['/measured/tool_pose'].rate_hz == pytest.approx(1.0 / 0.033)
    assert info.duration_s == pytest.approx(399 * 0.008)
    assert info.start_ns == recording.epoch_ns
    assert info.usable
    assert info.missing == ()
    assert info.provenance['robot']['name'] == 'two'


def test_a_gap_is_counted_and_measured(tmp_path):
    stamps = [SECOND + k * 10_000_000 for k in [*range(50), *range(150, 200)]]
    write_joints(tmp_path / 'bag', stamps)
    (topic,) = bag_info(tmp_path / 'bag').topics
    assert topic.gaps == 1
    assert topic.longest_gap_s == pytest.approx(1.01)
    assert topic.rate_hz == pytest.approx(100.0)


def test_stamps_that_cannot_be_used_are_counted(tmp_path):
    write_joints(tmp_path / 'bag', [0, SECOND, 3 * SECOND, 2 * SECOND, 2 * SECOND])
    (topic,) = bag_info(tmp_path / 'bag').topics
    assert (topic.count, topic.unstamped, topic.unordered, topic.repeated) == (5, 1, 1, 1)


def test_a_bag_without_measurements_is_not_usable_and_says_why(tmp_path):
    write_joints(tmp_path / 'bag', [SECOND, 2 * SECOND])
    info = bag_info(tmp_path / 'bag')
    assert not info.usable
    assert info.missing == (
        "no measurements on '/measured/tool_pose' or '/measured/tool_point'; its topics are "
        "'/joint_states'",
    )


def test_a_topic_of_the_right_type_is_suggested(tmp_path):
    write_joints(tmp_path / 'bag', [SECOND, 2 * SECOND], '/cell/joints')
    missing = bag_info(tmp_path / 'bag').missing
    assert missing[0] == (
        "no joint states on '/joint_states'; '/cell/joints' has that type, "
        'try --joint-topic /cell/joints'
    )
    renamed = bag_info(tmp_path / 'bag', TopicNames(joints='/cell/joints'))
    assert [topic.use for topic in renamed.topics] == ['joints']


def test_clocks_without_overlap_are_told(tmp_path):
    make = bag_messages()
    with BagWriter(tmp_path / 'bag') as bag:
        for k in range(5):
            bag.write('/joint_states', make.joint_state(SECOND + k, ['a'], np.zeros(1)), k + 1)
            bag.write('/measured/tool_point', make.point(90 * SECOND + k, np.zeros(3)), k + 1)
    (missing,) = bag_info(tmp_path / 'bag').missing
    assert 'do not overlap in time' in missing and missing.endswith(ONE_CLOCK)


@pytest.mark.parametrize('own', ['/twin/tool_pose', '/left/twin/tool_pose'])
def test_what_info_and_a_diagnosis_say_of_lacking_measurements_is_the_same(tmp_path, own):
    make, robot = bag_messages(), catalog.load('ur5')
    with BagWriter(tmp_path / 'bag') as bag:
        for k in range(1, 6):
            joints = make.joint_state(k * SECOND, robot.joint_names, np.zeros(6))
            bag.write('/joint_states', joints, k * SECOND)
            pose = make.pose(k * SECOND, np.zeros(3), np.eye(3))
            bag.write(own, pose, k * SECOND)
    (missing,) = bag_info(tmp_path / 'bag').missing
    assert 'try' not in missing, 'what the twin says was not measured'
    with pytest.raises(DataError) as error:
        read_recording(tmp_path / 'bag', robot, needs_measurements=True)
    assert str(error.value).endswith(missing)


NAN = np.nan


@pytest.mark.parametrize(
    ('pose', 'angle', 'gripper', 'robot', 'reason'),
    [
        ([0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 0.0], 0.0, 0.0, None, 'orientation'),
        ([0.1, 0.2, 0.3, NAN, NAN, NAN, NAN], 0.0, 0.0, None, 'orientation'),
        ([NAN, NAN, NAN, 0.0, 0.0, 0.0, 1.0], 0.0, 0.0, None, 'position'),
        ([0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0], NAN, NAN, None, 'joint_states'),
        ([0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0], 0.0, NAN, None, ''),
        ([0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0], NAN, NAN, {'joints': [{'name': 'a'}]}, "'a'"),
        ([0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0], 0.0, NAN, {'joints': [{'name': 'a'}]}, ''),
        ([0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.0], 0.0, 0.0, {'joints': 7}, ''),
    ],
)
def test_a_bag_of_which_a_diagnosis_can_take_nothing_is_not_called_usable(
    tmp_path, pose, angle, gripper, robot, reason
):
    make, made = bag_messages(), {} if robot is None else {'robot': robot}
    with BagWriter(tmp_path / 'bag', provenance=made) as bag:
        for k in range(1, 6):
            q = [0.1 * k + angle, gripper]
            bag.write('/joint_states', make.joint_state(k * SECOND, ['a', 'gripper'], q), k)
            seen = make.pose(k * SECOND, np.zeros(3), np.eye(3))
            inner = seen.pose
            (inner.position.x, inner.position.y, inner.position.z) = pose[:3]
            turn = inner.orientation
            (turn.x, turn.y, turn.z, turn.w) = pose[3:]
            bag.write('/measured/tool_pose', seen, k)
    info = bag_info(tmp_path / 'bag')
    assert info.usable == (not reason) and reason in info.refused
    arm = Robot.from_mapping({'joints': [{'name': 'a'}]})
    if reason:
        with pytest.raises(DataError) as error:
            read_recording(tmp_path / 'bag', arm)
        assert str(error.value) == info.refused
    else:
        assert read_recording(tmp_path / 'bag', arm).measured is not None


def test_an_empty_bag_is_described_not_refused(tmp_path):
    BagWriter(tmp_path / 'bag').open().close()
    info = bag_info(tmp_path / 'bag')
    assert info.duration_s == 0.0
    assert not info.usable


ROBOT = catalog.load('ur5')


def ends(first, last, step=0.01):
    return Ends(*(round(value * SECOND) for value in (first, last, step)))


def test_a_late_start_is_told_with_its_length_if_it_is_more_than_four_of_its_steps():
    found = uneven_ends({'/fast': ends(0.0, 10.0), '/late': ends(1.9, 9.0)})
    assert found == (
        "'/late' begins 1.900 s later than '/fast'",
        "'/late' ends 1.000 s earlier than '/fast'",
    )
    assert uneven_ends({'a': ends(0.0, 10.0), 'b': ends(0.039, 9.961)}) == uneven_ends({}) == ()
    for first, told in ((30.0, 0), (41.0, 1)):
        slow = ends(first, first + 10.0, step=10.0)
        assert len(uneven_ends({'/joints': ends(0.0, 60.0), '/temperature': slow})) == told


@pytest.mark.parametrize(
    'noted', [{}, {'completeness': 7}, {'completeness': {'/a': 3, '/b': {'missing': 1}}}]
)
def test_what_no_recorder_noted_is_not_told(noted):
    assert never_recorded(noted) == ()


@pytest.fixture
def cut_bag(tmp_path):
    """Return a bag of ten seconds whose poses stop after six, as its recorder noted."""
    make = bag_messages()
    row = {'sent': 500, 'recorded': 301, 'missing': 199, 'where': 'at the end'}
    made = {COMPLETENESS: {'/measured/tool_pose': row, '/joint_states': {'missing': 0}}}
    with BagWriter(tmp_path / 'bag', provenance=made) as bag:
        for k in range(501):
            stamp = SECOND + k * 20_000_000
            q = np.full(ROBOT.n, 0.2 * np.sin(0.01 * k))
            bag.write('/joint_states', make.joint_state(stamp, ROBOT.joint_names, q))
            if k <= 300:
                position = np.array([0.4, 0.1, 0.3 + 1e-4 * k])
                bag.write('/measured/tool_pose', make.pose(stamp, position, np.eye(3)))
    return tmp_path / 'bag'


SENTENCES = (
    "'/measured/tool_pose' lacks 199 of the 500 messages sent, at the end",
    "'/measured/tool_pose' ends 4.000 s earlier than '/joint_states'",
)


def test_the_stream_that_was_cut_is_named_and_the_recording_carries_it(cut_bag):
    info = bag_info(cut_bag)
    assert info.incomplete == SENTENCES
    assert info.notes[:2] == SENTENCES
    assert info.usable
    recording = read_recording(cut_bag, ROBOT)
    assert recording.incomplete == SENTENCES
    assert SENTENCES[0] in recording.notes
