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
