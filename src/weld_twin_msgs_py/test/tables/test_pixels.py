# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables of pixels and files of cameras that cannot be used: one sentence each."""

import pytest

from weld_twin_core import load
from weld_twin_core.errors import TwinError
from weld_twin_msgs_py.tables import read_camera, read_pixels, read_target

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
