# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Marking a contact by hand, over DDS: what the arm does decides whether there is one."""

import re

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_msgs_py.messages.topics import CONTACT, JOINT_STATES
from weld_twin_msgs_py.tables import read_contacts
from weld_twin_nodes.harness import Cell
from weld_twin_nodes.live.contact_marker import ContactMarker

pytestmark = pytest.mark.cells

S = 1_000_000_000
Q = np.array([0.1, -1.2, 1.5, -1.8, -1.5, 0.3])


def last_answer(cell):
    answer = cell.trigger('/contact_marker/mark')
    assert not answer.success
    return answer.message


def test_an_arm_that_stands_is_marked_and_one_that_moves_is_not(tmp_path):
    robot = wt.load('ur5')
    with Cell(tmp_path / 'cell') as cell:
        table = tmp_path / 'touches.csv'
        node = cell.add(ContactMarker, reliable_inputs=True, table=str(table), label='front a')
        heard = cell.collect(CONTACT.name, CONTACT.message_class())
        joints = cell.publisher(JOINT_STATES)
        cell.wait(lambda: joints.get_subscription_count() == 1, 'the node to listen')

        answer = cell.trigger('/contact_marker/mark')
        assert (answer.success, answer.message[:17]) == (False, 'nothing was heard')

        def feed(first, speed):
            for k in range(40):
                q = Q + speed * k * np.ones(6)
                ns = first * S + k * S // 100
                joints.publish(node.messages.joint_state(ns, robot.joint_names, q))

        feed(1, 1e-3)
        cell.wait(lambda: 'moves' in cell.trigger('/contact_marker/mark').message, 'a moving arm')
        feed(3, 0.0)
        cell.wait(lambda: cell.trigger('/contact_marker/mark').success, 'a contact')
        nothing_new = 'no joint state has come since the last contact'
        cell.wait(
            lambda: nothing_new in cell.trigger('/contact_marker/mark').message, 'the same posture'
        )
        cell.wait(lambda: heard.messages, 'the contact')
        assert {message.header.frame_id for message in heard.messages} == {'front a'}
        cell.wait(lambda: 's old' in cell.trigger('/contact_marker/mark').message, 'its age')
        age = re.search(r'the last joint state .* is (.*) s old; is the', last_answer(cell))
        assert age is not None
        assert 1.0 <= float(age[1]) < 20.0

    found = read_contacts(table, robot).recording
    assert set(found.contacts.labels) == {'front a'}
    np.testing.assert_allclose(found.joints.q, np.tile(Q, (len(found.contacts.labels), 1)))


class Cellmates:
    """An arm and a gripper that send on one topic, each its own joints."""

    def __init__(self, cell, table, **parameters):
        self.cell = cell
        self.node = cell.add(ContactMarker, reliable_inputs=True, table=str(table), **parameters)
        self.out = cell.publisher(JOINT_STATES)
        self.stamp, self.sent = 100 * S, 0

    def run(self, samples, arm=0.0, gripper=None, back=0.0):
        """Send samples 10 ms apart, beginning some seconds back, while joints move [rad each]."""
        self.stamp -= round(back * S)
        for k in range(samples):
            self.stamp += S // 100
            if gripper is not None:
                state = self.node.messages.joint_state(
                    self.stamp, ('finger',), np.array([0.01 + gripper * k])
                )
                self.out.publish(state)
            q = Q + arm * k
            self.out.publish(self.node.messages.joint_state(self.stamp, JOINTS, q))
        state = self.node.health.inputs[JOINT_STATES.name]
        self.sent += samples * (1 if gripper is None else 2)
        self.cell.wait(lambda: state.received == self.sent, 'the samples')

    def mark(self):
        return self.cell.trigger('/contact_marker/mark')


JOINTS = wt.load('ur5').joint_names


def test_whoever_comes_first_every_joint_must_stand_and_is_in_the_table(tmp_path):
    table = tmp_path / 't.csv'
    with Cell(tmp_path / 'cell') as cell:
        mates = Cellmates(cell, table)
        mates.run(60, arm=1e-3, gripper=0.0)  # the gripper is heard first, and stands
        answer = mates.mark()
        assert (answer.success, 'shoulder_pan_joint' in answer.message) == (False, True)
        mates.run(60, gripper=1e-3)
        assert 'the arm moves (finger)' in mates.mark().message
        mates.run(60, gripper=0.0)
        assert mates.mark().success
    assert table.read_text().splitlines()[0] == ','.join(('finger', *JOINTS, 'contact'))


def test_a_driver_that_is_started_anew_with_earlier_stamps_is_marked_soon(tmp_path):
    table = tmp_path / 't.csv'
    table.write_text(','.join((*reversed(JOINTS), 'contact')) + '\n')
    with Cell(tmp_path / 'cell') as cell:
        mates = Cellmates(cell, table, joints_beside='finger')
        mates.run(60, gripper=1e-3)
        assert mates.mark().success
        mates.run(60, back=50.0)
        assert mates.mark().success
    rows = [line.split(',') for line in table.read_text().splitlines()[1:]]
    assert [[float(cell) for cell in row[:6]] for row in rows] == [Q[::-1].tolist()] * 2


def test_a_table_of_other_joints_is_not_mixed_up(tmp_path):
    table = tmp_path / 't.csv'
    table.write_text('j1,j2,contact\n')
    with Cell(tmp_path / 'cell') as cell:
        mates = Cellmates(cell, table)
        mates.run(60)
        assert 'has the columns j1, j2, contact, and the joints are now' in mates.mark().message
    assert table.read_text() == 'j1,j2,contact\n'
