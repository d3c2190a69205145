# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables of touches and of pixels."""

import numpy as np
import pytest

import weld_twin_core as wt
from weld_twin_core import DataError, TwinError, load
from weld_twin_core.contacts import Artefact, Contact, Tie
from weld_twin_msgs_py.bags import read_recording, write_recording
from weld_twin_msgs_py.tables import (
    read_camera,
    read_contacts,
    read_pixels,
    read_table,
    read_target,
    write_touches,
)

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


CAMERA = 'camera_matrix: {rows: 3, cols: 3, data: [800, 0, 320, 0, 800, 240, 0, 0, 1]}\n'
FISHEYE = 'distortion_model: equidistant\ndistortion_coefficients: [0.1, 0, 0, 0]\n'
ROW = '0.1,0.2,0.3,0.4,0.5,0.6'


@pytest.fixture
def read(tmp_path):
    """Return a function that reads a table with one camera and one square target."""
    (tmp_path / 'camera.yaml').write_text(CAMERA)
    (tmp_path / 'target.csv').write_text(
        'label,x [mm],y [mm],z [mm]\na,0,0,0\nb,50,0,0\nc,0,50,0\n'
    )
    camera = read_camera('left', tmp_path / 'camera.yaml')
    target = read_target('board', tmp_path / 'target.csv')

    def table(header, *rows, targets=(target,)):
        names = ','.join(load('ur5').joint_names)
        lines = [f'{header},{names}', *(f'{row},{ROW}' for row in rows)]
        (tmp_path / 'pixels.csv').write_text('\n'.join(lines) + '\n')
        return read_pixels(tmp_path / 'pixels.csv', load('ur5'), (camera,), targets)

    return table


def test_a_target_of_a_table_is_in_metres(tmp_path):
    (tmp_path / 'target.csv').write_text('face,x [mm],y [mm],z [mm]\n7,50,0,0\n9,0,25,1\n')
    target = read_target('hand', tmp_path / 'target.csv')
    assert target.labels == ('7', '9')
    assert target.points.tolist() == [[0.05, 0.0, 0.0], [0.0, 0.025, 0.001]]


@pytest.mark.parametrize(
    ('header', 'row', 'said'),
    [
        ('camera,point,u,v', 'right,a,10,10', "camera 'right' is not described.*--camera right="),
        ('camera,point,u,v', 'left,d,10,10', "line 2: target 'board' has no point 'd'; it has a"),
        ('camera,point,u', 'left,a,10', "no column 'v'; pixels need u, v and point"),
        ('camera,point,u,v', 'left,a,10,10', 'no image shows four or more points'),
    ],
)
def test_what_is_not_described_is_named(read, header, row, said):
    with pytest.raises(TwinError, match=said):
        read(header, row)


def test_pixels_alone_are_not_enough(read):
    with pytest.raises(TwinError, match='--target NAME=FILE'):
        read('camera,point,u,v', 'left,a,10,10', targets=())


@pytest.mark.parametrize(
    ('text', 'said'),
    [
        ('camera_name: left\n', "'camera_matrix' is missing; it needs camera_matrix"),
        (CAMERA + FISHEYE, 'equid'),
        (CAMERA + 'mount: ceiling\n', "mounted on 'ceiling'; a mount is 'world' or 'tool'"),
        ('camera_matrix: [1, 2, 3]\n', '3 numbers where 9 belong'),
    ],
)
def test_a_file_that_is_no_camera_is_told_in_one_sentence(tmp_path, text, said):
    (tmp_path / 'left.yaml').write_text(text)
    with pytest.raises(TwinError, match=said) as error:
        read_camera('left', tmp_path / 'left.yaml')
    assert 'left.yaml' in str(error.value)


def test_a_board_without_its_squares_is_told(tmp_path):
    (tmp_path / 'board.yaml').write_text('board: charuco\nsquare: 0.02\n')
    with pytest.raises(TwinError, match=r"board.yaml.*'squares' is missing"):
        read_target('board', tmp_path / 'board.yaml')
