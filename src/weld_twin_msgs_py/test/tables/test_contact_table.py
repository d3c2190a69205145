# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables of touches, English and German, and their way through a bag."""

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core.contacts import Artefact, Contact, Tie
from weld_twin_core.errors import DataError
from weld_twin_msgs_py.bags import read_recording, write_recording
from weld_twin_msgs_py.tables import read_contacts, read_table, write_touches

ENGLISH = 'joint_1,joint_2,joint_3,joint_4,joint_5,joint_6,contact,kind,value,sigma\n'
GERMAN = 'joint_1;joint_2;joint_3;joint_4;joint_5;joint_6;Kontakt;Art;Wert_mm;Unsicherheit_mm\n'
PLATE = Artefact((Contact('a'), Contact('b')), (Tie(('a', 'b'), 0.05),))


@pytest.fixture
def robot():
    return wt.load('ur5')


def table(tmp_path, text):
    path = tmp_path / 'touches.csv'
    path.write_text(text, encoding='utf-8')
    return path


def test_german_headers_commas_degrees_and_millimetres_come_back_from_a_bag(tmp_path, robot):
    rows = '10,5;20;30;40;50;60;Stab;Länge;305,2;0,02\n-90;0;0;0;0;0;Stab;Länge;304,9;0,02\n'
    found = read_contacts(table(tmp_path, GERMAN + rows), robot).recording
    assert found.contacts.artefact.named('Stab').kind == 'length'
    np.testing.assert_allclose(found.contacts.value, [0.3052, 0.3049])
    np.testing.assert_allclose(found.contacts.sigma, [2e-5, 2e-5])
    np.testing.assert_allclose(found.joints.q[0, 0], np.radians(10.5))
    write_recording(tmp_path / 'bag', found, robot)
    came = read_recording(tmp_path / 'bag', robot)
    assert came.contacts.labels == found.contacts.labels
    assert came.contacts.artefact == found.contacts.artefact
    assert came.joints.static
    np.testing.assert_allclose(came.joints.q, found.joints.q)
    np.testing.assert_allclose(came.contacts.value, found.contacts.value, rtol=1e-7)
    np.testing.assert_allclose(came.contacts.sigma, found.contacts.sigma, rtol=1e-6)


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        (ENGLISH.replace('contact', 'what') + '0,0,0,0,0,0,a,point,,\n', "no column 'contact'"),
        (ENGLISH + '0,0,0,0,0,0,c,point,,\n', "there is no contact 'c' in the artefact; it has"),
        (ENGLISH + '0,0,0,0,0,0,,point,,\n', 'line 2 names no contact'),
        (ENGLISH + ',0,0,0,0,0,a,point,,\n', 'line 2 has an empty joint angle'),
    ],
)
def test_what_cannot_be_read_is_told_in_one_sentence(tmp_path, robot, text, message):
    with pytest.raises(DataError, match=message):
        read_contacts(table(tmp_path, text), robot, PLATE)


def test_a_table_of_touches_read_as_measurements_is_told_what_it_lacks(tmp_path, robot):
    path = table(tmp_path, GERMAN + '10,5;20;30;40;50;60;Stab;Länge;305,2;0,02\n')
    with pytest.raises(DataError, match="the column 'Kontakt'; say what was touched with --cont"):
        read_table(path, robot)


def test_touches_that_are_proposed_are_read_as_they_were_written(tmp_path, robot):
    plate = Artefact((Contact('a'), Contact('by "b", left')), (Tie(('a', 'by "b", left'), 0.05),))
    q = [[0.1, 0.2, 0.3, 0.4, 0.5, 0.6], [0.2, 0.2, 0.3, 0.4, 0.5, 0.6]]
    motion = {'joint_names': list(robot.joint_names), 'q': q, 'contact': ['a', 'by "b", left']}
    write_touches(tmp_path / 'next.csv', motion)
    found = read_contacts(tmp_path / 'next.csv', robot, plate).recording
    assert found.contacts.labels == ('a', 'by "b", left')
    assert found.contacts.artefact.ties[0].value == 0.05
    np.testing.assert_allclose(found.joints.q, q)
