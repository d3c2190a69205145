# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables become bags, and boards in images tables."""

import csv
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import done, refused, weld_twin
from scipy.spatial.transform import Rotation

from weld_twin_core import DataError, catalog, forward
from weld_twin_msgs_py.bags import read_recording
from weld_twin_nodes.cli.commands.detect import _joints

ROBOT = catalog.load('ur5')


@pytest.fixture
def table(tmp_path):
    """Thirty stations in degrees and millimetres, the tool 2 mm off along x of the world."""
    rng = np.random.default_rng(0)
    q = rng.uniform(-1.5, 1.5, size=(30, 6))
    position = forward(ROBOT, q)[:, :3, 3] + [2e-3, 0.0, 0.0]
    file = tmp_path / 'table.csv'
    names = [*(f'joint_{k}' for k in range(1, 7)), *(f'{a}_measured' for a in 'xyz')]
    rows = np.hstack([np.degrees(q), position * 1e3])
    np.savetxt(file, rows, '%.17g', ',', header=','.join(names), comments='')
    return file, q, position


def test_degrees_and_millimetres_arrive_as_radians_and_metres(tmp_path, table):
    file, q, position = table
    result = done('import', file, '--robot', 'ur5', '--out', tmp_path / 'bag')
    recording = read_recording(tmp_path / 'bag', ROBOT)
    assert recording.joints.static
    np.testing.assert_allclose(recording.joints.q, q, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(recording.measured.position, position, rtol=0.0, atol=1e-13)
    assert 'joint angles are in degrees' in result
    assert 'base and tool frame not fitted: RMS 2.000 mm, max 2.000 mm' in result


def test_a_table_that_memory_has_no_room_for_is_one_sentence_and_leaves_nothing(tmp_path, table):
    file, bag = table[0], tmp_path / 'bag'
    with file.open('a') as more:
        more.writelines([file.read_text().splitlines()[1] + '\n'] * 1_000_000)
    program = (
        'import resource, sys\n'
        'resource.setrlimit(resource.RLIMIT_AS, (1_000_000_000,) * 2)\n'
        'from weld_twin_nodes.cli.main import main\n'
        'sys.exit(main())\n'
    )
    words = ('import', file, '--robot', 'ur5', '--out', bag)
    command = [sys.executable, '-c', program, *map(str, words)]
    run = subprocess.run(command, capture_output=True, text=True)
    said = 'weld-twin: there is too little memory for this; free some, or give less at once\n'
    assert (run.returncode, run.stderr) == (2, said)
    assert list(tmp_path.iterdir()) == [file]


def test_a_list_of_numbers_may_begin_with_a_sign(tmp_path, table):
    file, q, _ = table
    shifted = ('--joint-offsets', '-5,0,0,0,0,.5', '--joint-signs', '-1,1,1,1,1,1')
    done('import', file, '--robot', 'ur5', *shifted, '--out', tmp_path / 'bag')
    expected = q * [-1.0, 1.0, 1.0, 1.0, 1.0, 1.0] + np.radians([-5.0, 0.0, 0.0, 0.0, 0.0, 0.5])
    recording = read_recording(tmp_path / 'bag', ROBOT)
    np.testing.assert_allclose(recording.joints.q, expected, rtol=0.0, atol=1e-13)


def test_deviations_come_as_table_and_picture_too(tmp_path, table):
    csv, png = tmp_path / 'off.csv', tmp_path / 'off.png'
    words = ('--robot', 'ur5', '--table', csv, '--picture', png)
    done('import', table[0], *words, '--out', tmp_path / 'bag')
    rows = np.genfromtxt(csv, delimiter=',', names=True)
    np.testing.assert_allclose(rows['dx_m'], 2e-3, atol=1e-9)
    np.testing.assert_allclose(rows['dz_m'], 0.0, atol=1e-9)
    assert png.read_bytes().startswith(b'\x89PNG')


def test_a_table_misread_is_refused_with_the_option_that_decides(tmp_path, table):
    for words, sentence in (
        (('--joint-columns', 'a,b,c,d,e,f'), "no column 'a'"),
        (('--skip-rows', '99'), 'names row 99'),
    ):
        out = ('--out', tmp_path / 'bag')
        assert sentence in refused('import', table[0], '--robot', 'ur5', *out, *words)
        assert not (tmp_path / 'bag').exists()


def test_a_motion_of_two_files_becomes_a_bag_with_two_clocks(tmp_path):
    """Joints at 100 Hz, the tracker at 30 Hz on a clock of its own that is 20 ms late."""
    t, seen = np.arange(0.0, 6.0, 0.01), np.arange(0.5, 5.5, 1.0 / 30.0)
    start = np.array([0.2, -1.3, 1.4, -1.5, -1.4, 0.3])
    turns = np.array([0.5, 0.4, -0.6, 0.7, 0.5, 0.9])

    def joints(at):
        return start + turns * np.sin(0.7 * at[:, None] + np.arange(6.0))

    point = forward(ROBOT, joints(seen - 0.02))[:, :3, 3]
    head = ','.join(['time [s]', *(f'joint_{k} [deg]' for k in range(1, 7))])
    log = np.column_stack([t + 100.0, np.degrees(joints(t))])
    np.savetxt(tmp_path / 'log.csv', log, delimiter=',', header=head, comments='', fmt='%.6f')
    track = np.column_stack([seen + 7.0, 1e3 * point])
    head = 'time [s],x [mm],y [mm],z [mm]'
    np.savetxt(tmp_path / 'track.csv', track, delimiter=',', header=head, comments='', fmt='%.6f')
    result = done('import', tmp_path / 'log.csv', '--measured', tmp_path / 'track.csv',
                       '--clock-offset', 0.5, '--robot', 'ur5', '--out', tmp_path / 'bag')  # fmt: skip
    assert f'{seen.size} measurements along a motion' in result
    back = read_recording(tmp_path / 'bag', ROBOT)
    assert not back.joints.static and back.joints.t.size == t.size
    late = forward(ROBOT, back.joints.at(back.measured.t - 0.02)[0])[:, :3, 3]
    assert np.linalg.norm(back.measured.position - late, axis=1).max() < 2e-5


def test_a_log_with_gaps_and_repeated_stamps_is_a_motion_all_the_same(tmp_path):
    t = np.arange(0.0, 4.0, 0.01)
    q = np.array([0.2, -1.3, 1.4, -1.5, -1.4, 0.3]) + 0.5 * np.sin(t[:, None] + np.arange(6.0))
    lines = [','.join([f'{a:.3f}', *(f'{v:.7f}' for v in b)]) for a, b in zip(t, q, strict=True)]
    lines[40] = lines[40].split(',')[0] + ',' * 6
    lines.insert(90, lines[89])
    head = ','.join(['time', *(f'J{k}' for k in range(1, 7))])
    (tmp_path / 'log.csv').write_text('\n'.join([head, *lines]))
    point = 1e3 * forward(ROBOT, q[::3])[:, :3, 3]
    seen = [','.join([f'{1e3 * a:.0f}', *(f'{v:.5f}' for v in p)])
            for a, p in zip(t[::3], point, strict=True)]  # fmt: skip
    (tmp_path / 'track.csv').write_text('\n'.join(['t [ms],X [mm],Y [mm],Z [mm]', *seen]))
    result = done('import', tmp_path / 'log.csv', '--measured', tmp_path / 'track.csv',
                       '--robot', 'ur5', '--out', tmp_path / 'bag')  # fmt: skip
    assert '1 rows are left out in which a joint is missing' in result
    assert '1 rows are left out whose stamp repeats one before' in result
    back = read_recording(tmp_path / 'bag', ROBOT)
    np.testing.assert_allclose(back.measured.t[:-1], t[::3][:-1], atol=1e-6)
    there = forward(ROBOT, back.joints.at(back.measured.t)[0])[:, :3, 3]
    assert np.linalg.norm(back.measured.position - there, axis=1).max() < 2e-5


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


@pytest.mark.parametrize(
    ('table', 'cells'),
    [
        ('', ([], [[], []])),
        ('j,k\n1,2\n3,4\n', (['j', 'k'], [['1', '2'], ['3', '4']])),
        ('j,image,k\n1,a,2\n3,b.png,4\n', (['j', 'k'], [['3', '4'], ['1', '2']])),
        ('j,k\n1,2\n', 'has 1 rows for 2 images'),
        ('image,j\na,1\nc,2\n', "has no row of image 'b.png'"),
    ],
)  # fmt: skip
def test_joints_beside_pixels_are_those_of_the_image_by_its_name_or_its_place(
    table, cells, tmp_path
):
    file, images = tmp_path / 'joints.csv', [Path('b.png'), Path('a.png')]
    file.write_text(table)
    if isinstance(cells, tuple):
        assert _joints(str(file) if table else '', images) == cells
        return
    with pytest.raises(DataError, match=cells):
        _joints(str(file), images)


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
