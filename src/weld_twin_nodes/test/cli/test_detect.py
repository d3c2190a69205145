# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Boards in images: drawn in perspective here, found by the command."""

import csv

import numpy as np
import pytest
from command_line import refused, weld_twin
from scipy.spatial.transform import Rotation

SQUARE, SQUARES = 0.03, (7, 5)
BOARD = 'board: charuco\nsquares: [7, 5]\nsquare: 0.03\nmarker: 0.022\ndictionary: DICT_4X4_50\n'
FOCAL, MIDDLE = 900.0, (400.0, 300.0)
PRINTED = 4000.0
"""Pixels of a metre in the picture of the board."""


def places(turn, shift):
    """Return where a pinhole sees the inner corners, row by row (24, 2) [px]."""
    grid = [[c + 1.0, r + 1.0, 0.0] for r in range(SQUARES[1] - 1) for c in range(SQUARES[0] - 1)]
    there = np.array(grid) * SQUARE @ turn.T + shift
    return FOCAL * there[:, :2] / there[:, 2:] + MIDDLE


def picture(cv2, turn, shift):
    """Return what the pinhole sees of the printed board."""
    markers = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    printed = cv2.aruco.CharucoBoard(SQUARES, SQUARE, 0.022, markers)
    flat = printed.generateImage([round(n * SQUARE * PRINTED) for n in SQUARES])
    # From pixels of the print, whose centres are half a pixel off, to metres, to the image.
    metres = np.array([[1.0, 0.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, PRINTED]]) / PRINTED
    lens = np.array([[FOCAL, 0.0, MIDDLE[0]], [0.0, FOCAL, MIDDLE[1]], [0.0, 0.0, 1.0]])
    seen = lens @ np.column_stack([turn[:, 0], turn[:, 1], shift]) @ metres
    return cv2.warpPerspective(flat, seen, (800, 600), flags=cv2.INTER_AREA, borderValue=255)


def test_a_board_in_images_becomes_a_table_of_pixels(tmp_path):
    cv2 = pytest.importorskip('cv2')
    (tmp_path / 'images').mkdir()
    (tmp_path / 'board.yaml').write_text(BOARD)
    truth = {}
    for name, turn, depth in (
        ('a.png', [0.3, -0.2, 0.1], 0.4),
        ('b.png', [-0.25, 0.35, 0.8], 0.5),
    ):
        matrix = Rotation.from_rotvec(turn).as_matrix()
        shift = np.array([0.0, 0.0, depth]) - matrix @ [0.105, 0.075, 0.0]
        truth[name] = places(matrix, shift)
        cv2.imwrite(str(tmp_path / 'images' / name), picture(cv2, matrix, shift))
    (tmp_path / 'joints.csv').write_text('image,joint_1 [rad]\nb,0.5\na,-0.25\n')
    out = tmp_path / 'pixels.csv'
    words = ('--board', tmp_path / 'board.yaml', '--joints', tmp_path / 'joints.csv')
    said = weld_twin('detect', tmp_path / 'images', *words, '--out', out).out
    assert 'the board is in 2 of 2 images' in said
    rows = list(csv.DictReader(out.open()))
    joints = {row['image']: row['joint_1 [rad]'] for row in rows}
    assert joints == {'a.png': '-0.25', 'b.png': '0.5'}
    assert len(rows) > 40
    for row in rows:
        seen = [float(row['u [px]']), float(row['v [px]'])]
        assert np.linalg.norm(truth[row['image']][int(row['point'])] - seen) < 0.6


def test_what_is_no_board_file_is_told_in_one_sentence(tmp_path):
    (tmp_path / 'a.png').write_bytes(b'')
    (tmp_path / 'board.yaml').write_text('board: charuco\nsquare: 0.03\n')
    ran = refused(
        'detect', tmp_path / 'a.png', '--board', tmp_path / 'board.yaml', '--out', tmp_path / 'p'
    )
    assert "'squares' is missing" in ran


def test_tags_in_images_become_a_table_of_their_corners(tmp_path):
    cv2 = pytest.importorskip('cv2')
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    image = np.full((400, 700), 255, dtype=np.uint8)
    for tag, left in ((5, 80), (23, 400)):
        image[100:300, left : left + 200] = cv2.aruco.generateImageMarker(family, tag, 200)
    cv2.imwrite(str(tmp_path / 'a.png'), image)
    (tmp_path / 'tags.yaml').write_text('board: tags\nsize: 0.05\ntags: {5: [0, 0, 0]}\n')
    table = tmp_path / 'pixels.csv'
    weld_twin('detect', tmp_path / 'a.png', '--board', tmp_path / 'tags.yaml', '--out', table)
    rows = {row['point']: row for row in csv.DictReader(table.open())}
    # Clockwise from the upper left; the tag that is not of the board is left out.
    places = {'5.0': (80, 100), '5.1': (280, 100), '5.2': (280, 300), '5.3': (80, 300)}
    assert set(rows) == set(places)
    for text, place in places.items():
        seen = [float(rows[text]['u [px]']), float(rows[text]['v [px]'])]
        assert np.linalg.norm(np.subtract(place, seen) - 0.5) < 1.0
