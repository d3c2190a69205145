# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Joint states under other names, and velocities that are none, as a running node takes them."""

import numpy as np
import pytest

from weld_twin_core.arm.catalog import load
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.assembly.joint_states import JointStates
from weld_twin_msgs_py.messages.to_messages import bag_messages

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
