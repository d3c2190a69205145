# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Joint states: names as others have them, and efforts, checked where they are asked for."""

from dataclasses import replace

import numpy as np
import pytest

from weld_twin_core import DataError, load
from weld_twin_core.recording import JointSignal
from weld_twin_msgs_py.assembly.joint_states import JointStates
from weld_twin_msgs_py.bags import BagReader, BagWriter, from_bag, read_recording, write_recording
from weld_twin_msgs_py.messages.cdr import decoder
from weld_twin_msgs_py.messages.to_messages import bag_messages
from weld_twin_msgs_py.messages.topics import TopicNames
from weld_twin_msgs_py.messages.typestore import TYPES
from weld_twin_msgs_py.tables import read_table

ROBOT = load('ur5')
MAKE = bag_messages()
S = 1_000_000_000
THEIRS = tuple(f'A{k}' for k in range(1, 7))


def state(k, q, names=ROBOT.joint_names, qd=None):
    return MAKE.joint_state(k * S // 100 + S, names, np.asarray(q), qd)


def test_names_of_the_controller_are_taken_in_any_order():
    states = JointStates(ROBOT, joint_names=THEIRS)
    q = np.linspace(0.1, 0.6, 6)
    mixed = [THEIRS[k] for k in (3, 1, 5, 0, 2, 4)]
    sample = states.take(state(0, q[[3, 1, 5, 0, 2, 4]], mixed))
    np.testing.assert_array_equal(sample.q, q)
    assert states.take(state(1, q)) is None  # the robot's own names are others' joints now
    assert states.others == 1


def test_one_of_two_robots_on_a_topic_is_chosen_by_its_prefix():
    both = [f'{side}_{name}' for side in ('left', 'right') for name in ROBOT.joint_names]
    q = np.linspace(-1.0, 1.0, 12)
    with pytest.raises(DataError, match="prefixes 'left_', 'right_'; say which with joint_prefix"):
        JointStates(ROBOT).take(state(0, q, both))
    states = JointStates(ROBOT, joint_names=[f'right_{name}' for name in ROBOT.joint_names])
    np.testing.assert_array_equal(states.take(state(0, q, both)).q, q[6:])


def test_joints_of_another_robot_are_passed_over_once_the_names_are_known():
    """A prefix is taken off names that were never seen without it."""
    states, q = JointStates(ROBOT), np.full(6, 0.1)
    assert states.take(state(0, q)) is not None
    for k in range(1, 5):
        assert states.take(state(k, q, [f'other_{name}' for name in ROBOT.joint_names])) is None
    assert states.others == 4
    assert states.remark == ''
    assert states.take(state(5, q)) is not None


def test_our_own_joints_count_though_another_robots_came_first():
    states, q = JointStates(ROBOT, mend=True), np.full(6, 0.1)
    assert states.take(state(0, q, [f'left_{name}' for name in ROBOT.joint_names])) is not None
    np.testing.assert_array_equal(states.take(state(1, q + 0.1)).q, q + 0.1)
    assert states.take(state(2, q, [f'left_{name}' for name in ROBOT.joint_names])) is None
    assert 'what came with a prefix before was of another robot' in states.remark


def test_velocities_that_stay_zero_while_a_joint_moves_are_left_out_and_told():
    states = JointStates(ROBOT, mend=True)
    known = []
    for k in range(60):
        q = np.full(6, 0.1) + [0.0, 0.0011 * k, 0.0, 0.0, 0.0, 0.0]
        known.append(states.take(state(k, q, qd=np.zeros(6))).qd is not None)
    assert known == [k < 19 for k in range(60)]
    assert 'velocities are zero while the joints move' in states.velocity_remark
    assert states.take(state(60, np.full(6, 0.1), qd=np.ones(6))).qd is not None


def test_an_arm_at_rest_has_velocities_of_zero():
    states = JointStates(ROBOT, mend=True)
    for k in range(60):
        hum = 1e-4 * np.sin(k)
        assert not states.take(state(k, np.full(6, 0.1 + hum), qd=np.zeros(6))).qd.any()
    moving = np.full(6, 0.1) + 0.03 * np.arange(5)[:, None]
    for k, q in enumerate(moving):  # goes on with velocities that are told
        assert states.take(state(60 + k, q, qd=np.ones(6))).qd is not None
    assert states.velocity_remark == ''


def test_a_recording_keeps_the_velocities_it_has():
    states = JointStates(ROBOT)
    for k in range(60):
        sample = states.take(state(k, np.full(6, 0.01 * k), qd=np.zeros(6)))
        assert sample.qd is not None


def test_a_message_that_is_refused_tells_nothing_of_joints_beside():
    """Its places are not those of the messages after it, either."""
    states, q = JointStates(ROBOT), np.full(6, 0.1)
    states.take(state(0, q))
    odd = [*ROBOT.joint_names[:5], 'misspelt']
    for k in range(1, 9):
        with pytest.raises(DataError, match='has no joint'):
            states.take(state(2 * k, q + 0.05 * k, odd))
        np.testing.assert_array_equal(states.take(state(2 * k + 1, q + 0.05 * k)).q, q + 0.05 * k)
    assert (states.beside.remark, states.beside.warning()) == ('', '')


@pytest.mark.parametrize(
    ('names', 'carries'),
    [(('rail',), True), (('tilt', 'turn'), True), (THEIRS, False), ((*THEIRS, 'A7'), False)],
)
def test_what_carries_an_arm_has_fewer_axes_than_one(names, carries):
    """Another arm on the topic moves without a warning that it carries this one."""
    states = JointStates(ROBOT)
    for k in range(9):
        states.take(state(2 * k, np.full(6, 0.1)))
        assert states.take(state(2 * k + 1, np.full(len(names), 0.05 * k), names)) is None
    assert bool(states.beside.warning()) == carries


ASKED = TopicNames(use_effort=True)
BAG = bag_messages()
JOINTS = 'sensor_msgs/msg/JointState'
STAMP = 1_700_000_000_000_000_000
NAMES = ('elbow', 'gripper', 'shoulder')


@pytest.fixture
def borne(recording):
    """A recording with efforts: numbers without meaning."""
    value = np.random.default_rng(8).normal(size=recording.joints.q.shape)
    return replace(recording, effort=JointSignal(recording.joints.t, value))


def test_efforts_come_back_from_a_bag_at_once_and_one_by_one(tmp_path, borne, robot, monkeypatch):
    write_recording(tmp_path / 'bag', borne, robot)
    assert read_recording(tmp_path / 'bag', robot).effort is None
    at_once = read_recording(tmp_path / 'bag', robot, ASKED)
    monkeypatch.setattr(from_bag, 'fill_regular', lambda *_: False)
    one_by_one = read_recording(tmp_path / 'bag', robot, ASKED)
    for got in (at_once, one_by_one):
        np.testing.assert_array_equal(got.effort.value, borne.effort.value)
        np.testing.assert_array_equal(got.effort.t, got.joints.t)
        np.testing.assert_array_equal(got.joints.qd, borne.joints.qd)


def bag_of(path, states):
    """Write joint states of a gripper between the robot's joints, in another order."""
    with BagWriter(path) as bag:
        for k, (position, effort) in enumerate(states):
            ns = STAMP + 10_000_000 * k
            message = BAG.joint_state(ns, NAMES, np.array(position), effort=np.array(effort))
            bag.write_cdr('/joint_states', JOINTS, bytes(TYPES.serialize_cdr(message, JOINTS)), ns)
    return path


def test_efforts_are_matched_by_name(tmp_path, robot):
    states = [((1.0, 9.0, 2.0), (-3.0, 9.0, 4.0)), ((1.1, 9.0, 2.1), (-3.5, 9.0, 4.5))]
    got = read_recording(bag_of(tmp_path / 'bag', states), robot, ASKED)
    assert got.effort.value.tolist() == [[4.0, -3.0], [4.5, -3.5]]


@pytest.mark.parametrize(
    ('effort', 'said'),
    [
        ((1.0, 0.0, np.nan), "joint 'shoulder' has the effort nan"),
        ((1.0, 2.0), '3 names but 2 efforts'),
        ((), 'the joint state tells no effort'),
    ],
)
def test_bad_efforts_are_refused_where_they_are_asked_for(tmp_path, robot, effort, said):
    states = [((1.0, 9.0, 2.0), (-3.0, 9.0, 4.0)), ((1.1, 9.0, 2.1), effort)]
    path = bag_of(tmp_path / 'bag', states)
    with pytest.raises(DataError, match=said):
        read_recording(path, robot, ASKED)
    assert read_recording(path, robot).joints.t.size == 2


def test_a_node_reads_efforts_as_rosbags_does():
    read, rng = decoder(JOINTS), np.random.default_rng(2)
    for k in range(12):
        q, qd, effort = rng.normal(size=(3, 3))
        # Drivers begin to tell efforts, and stop, and some tell no velocities.
        told = effort if k % 3 else None
        fast = None if k % 4 == 3 else qd
        message = BAG.joint_state(STAMP + k, NAMES, q, fast, effort=told)
        got = read(bytes(TYPES.serialize_cdr(message, JOINTS)))
        assert got.position == tuple(q)
        assert got.velocity == (() if fast is None else tuple(qd))
        assert got.effort == (() if told is None else tuple(effort))


def table(path, names, unit, scale, gap=False):
    rng = np.random.default_rng(3)
    q, point, effort = rng.uniform(-1.0, 1.0, (12, 2)), rng.normal(size=(12, 3)), np.arange(24.0)
    head = ['shoulder [rad]', 'elbow [rad]', 'x [m]', 'y [m]', 'z [m]']
    head += [f'{name}{unit}' for name in names]
    rows = np.hstack([q, point, scale * effort.reshape(12, 2)])
    lines = [','.join(f'{value:.9g}' for value in row) for row in rows]
    lines[4] = lines[4].rpartition(',')[0] + ',' if gap else lines[4]
    path.write_text('\n'.join([','.join(head), *lines]) + '\n')
    return path


@pytest.mark.parametrize(
    ('names', 'unit', 'scale'),
    [
        (('tau1', 'tau2'), '', 1.0),
        (('tau_1', 'tau_2'), ' [N m]', 1.0),
        (('effort_shoulder', 'effort_elbow'), ' [Nm]', 1.0),
        (('Drehmoment Achse 1', 'Drehmoment Achse 2'), ' (Nmm)', 1e3),
        (('joint_1_torque', 'joint_2_torque'), ' [N*m]', 1.0),
    ],
)
def test_efforts_of_a_table_are_found(tmp_path, robot, names, unit, scale):
    recording, said = read_table(table(tmp_path / 'table.csv', names, unit, scale), robot)
    np.testing.assert_allclose(recording.effort.value, np.arange(24.0).reshape(12, 2))
    assert any(f'efforts are {names[0]}{unit}' in sentence for sentence in said)


@pytest.mark.parametrize(
    ('unit', 'gap', 'why'), [(' [%]', False, 'are in %'), ('', True, 'line 6 has none')]
)
def test_efforts_that_springs_cannot_take_are_left_out(tmp_path, robot, unit, gap, why):
    path = table(tmp_path / 'table.csv', ('tau1', 'tau2'), unit, 1.0, gap)
    recording, said = read_table(path, robot)
    assert recording.effort is None and recording.joints.t.size == 12
    assert any(why in sentence for sentence in said)


def test_the_efforts_of_a_table_go_into_its_bag(tmp_path, robot):
    recording, _ = read_table(table(tmp_path / 'table.csv', ('tau1', 'tau2'), '', 1.0), robot)
    write_recording(tmp_path / 'bag', recording, robot)
    with BagReader(tmp_path / 'bag') as bag:
        states = [message for *_, message in bag.messages(['/joint_states'])]
    assert states[3].effort.tolist() == [6.0, 7.0]
