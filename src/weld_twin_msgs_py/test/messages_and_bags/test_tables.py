# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from weld_twin_core import DataError, catalog, forward
from weld_twin_msgs_py.robots import load_robot
from weld_twin_msgs_py.tables import TableOptions, read_table

JOINTS = ['j1', 'j2', 'j3', 'j4', 'j5', 'j6']


@pytest.fixture
def ur5():
    return catalog.load('ur5')


def poses(robot, count=12, seed=2):
    q = np.random.default_rng(seed).uniform(-2.5, 2.5, (count, robot.n))
    return q, forward(robot, q)


def table(path, header, *blocks, delimiter=','):
    rows = np.concatenate([np.reshape(b, (len(b), -1)) for b in blocks], axis=1)
    lines = [delimiter.join(header), *(delimiter.join(repr(float(v)) for v in r) for r in rows)]
    path.write_text('\n'.join(lines) + '\n')
    return path


# What is found out ---------------------------------------------------------------------------


@pytest.mark.parametrize('order', ['XYZ', 'ZYX', 'XZY', 'YXZ'])
@pytest.mark.parametrize('unit', ['rad', 'deg'])
def test_the_order_of_the_angles_follows_from_the_arm(tmp_path, ur5, order, unit):
    q, T = poses(ur5)
    world = Rotation.random(random_state=4)
    turned = world * Rotation.from_matrix(T[:, :3, :3]) * Rotation.random(random_state=5)
    angles = turned.as_euler(order, degrees=unit == 'deg')
    columns = angles[:, [order.index(axis) for axis in 'XYZ']]
    path = table(
        tmp_path / 't.csv',
        [*JOINTS, 'x', 'y', 'z', 'rx', 'ry', 'rz'],
        q,
        world.apply(T[:, :3, 3]),
        columns,
    )
    recording, said = read_table(path, ur5)
    np.testing.assert_allclose(recording.measured.rotation, turned.as_matrix(), atol=1e-12)
    assert any(f'Euler {order} (intrinsic)' in sentence for sentence in said)


def test_a_rotation_vector_is_told_from_euler_angles(tmp_path, ur5):
    q, T = poses(ur5)
    vector = Rotation.from_matrix(T[:, :3, :3]).as_rotvec()
    header = [*JOINTS, 'x', 'y', 'z', 'rx', 'ry', 'rz']
    recording, said = read_table(table(tmp_path / 't.csv', header, q, T[:, :3, 3], vector), ur5)
    np.testing.assert_allclose(recording.measured.rotation, T[:, :3, :3], atol=1e-12)
    assert any('a rotation vector' in sentence for sentence in said)


def test_quaternions_are_read_by_their_names(tmp_path, ur5):
    q, T = poses(ur5)
    x, y, z, w = Rotation.from_matrix(T[:, :3, :3]).as_quat().T
    header = [*JOINTS, 'x', 'y', 'z', 'qw', 'qx', 'qy', 'qz']
    path = table(tmp_path / 't.csv', header, q, T[:, :3, 3], w, x, y, z)
    recording, _ = read_table(path, ur5)
    np.testing.assert_allclose(recording.measured.rotation, T[:, :3, :3], atol=1e-12)


def test_joints_with_their_own_names_may_stand_in_any_order(tmp_path, ur5):
    q, T = poses(ur5)
    header = [*reversed(ur5.joint_names), 'x', 'y', 'z']
    recording, _ = read_table(table(tmp_path / 't.csv', header, q[:, ::-1], T[:, :3, 3]), ur5)
    np.testing.assert_array_equal(recording.joints.q, q)


def test_the_tool_offset_does_not_hide_that_the_table_is_right(tmp_path, ur5):
    q, T = poses(ur5, 40)
    tip = T[:, :3, 3] + T[:, :3, :3] @ [0.1, 0.05, 0.3]
    _, said = read_table(table(tmp_path / 't.csv', [*JOINTS, 'x', 'y', 'z'], q, tip), ur5)
    (sentence,) = (s for s in said if 'base and tool fitted' in s)
    assert float(re.search(r'are (\S+) mm', sentence).group(1)) < 0.01


def test_a_row_that_stands_out_is_named_and_kept(tmp_path, ur5):
    q, T = poses(ur5, 60)
    position = T[:, :3, 3] + np.random.default_rng(1).normal(0.0, 1e-3, (60, 3))
    position[17] += 0.08
    path = table(tmp_path / 't.csv', [*JOINTS, 'x', 'y', 'z'], q, position)
    recording, said = read_table(path, ur5)
    assert any(s.startswith('1 rows stand out, most of all line 19') for s in said)
    assert recording.joints.t.size == 60
    # Rows are given as the option counts them, also where some were left out before.
    (sentence,) = (
        s
        for s in read_table(path, ur5, TableOptions(skip_rows=(3,))).assumptions
        if 'stand out' in s
    )
    assert sentence.endswith('--skip-rows 18 leaves them out')
    _, said = read_table(path, ur5, TableOptions(skip_rows=(3, 18)))
    assert not any('stand out' in s for s in said)


def test_stamps_that_increase_are_kept(tmp_path, ur5):
    q, T = poses(ur5)
    ms = 1_700_000_000_000.0 + 2500.0 * np.arange(12)
    path = table(tmp_path / 't.csv', ['time', *JOINTS, 'x', 'y', 'z'], ms, q, T[:, :3, 3])
    recording, said = read_table(path, ur5)
    np.testing.assert_allclose(recording.joints.t, 2.5 * np.arange(12), atol=1e-6)
    assert recording.epoch_ns == 1_700_000_000_000_000_000
    assert "stamps in 'time' are in ms" in said


@pytest.mark.parametrize(
    ('name', 'step', 'days'), [('time', 30, 1), ('Datum', 300, 1), ('time', 300, 0)]
)
def test_dates_that_excel_counts_in_days_are_told_from_seconds(tmp_path, ur5, name, step, days):
    """Half a minute would be a third of a millisecond; five minutes could be a fast clock's."""
    q, T = poses(ur5)
    serial = 45992.5 + step * np.arange(12) / 86400.0
    path = table(tmp_path / 't.csv', [name, *JOINTS, 'x', 'y', 'z'], serial, q, T[:, :3, 3])
    recording, _ = read_table(path, ur5)
    scale = 1.0 if days else 1.0 / 86400.0
    np.testing.assert_allclose(np.diff(recording.joints.t), step * scale, rtol=2e-3)
    if days:
        assert recording.epoch_ns == 1_764_590_400 * 1_000_000_000  # noon of 1 December 2025


def test_rows_with_a_gap_are_left_out_and_counted(tmp_path, ur5):
    q, T = poses(ur5)
    path = table(tmp_path / 't.csv', [*JOINTS, 'x', 'y', 'z'], q, T[:, :3, 3])
    lines = path.read_text().splitlines()
    lines[4] = ','.join(['', *lines[4].split(',')[1:]])
    path.write_text('\n'.join(lines))
    recording, said = read_table(path, ur5)
    assert recording.joints.t.size == 11
    assert '1 rows with empty cells left out, the first in line 5' in said


# What is refused -----------------------------------------------------------------------------

HEAD = 'j1,j2,j3,j4,j5,j6,x,y,z'
SEVERAL = 'measured_x,measured_y,measured_z,laser_x,laser_y,laser_z'
ROW = '0.1,0.2,0.3,0.4,0.5,0.6,0.7,0.8,0.9'


def headed(*rows):
    return '\n'.join([HEAD, *rows, ''])


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('', "table '{}' needs a header line and at least one row"),
        (f'{ROW}\n{ROW}\n', "table '{}' has numbers in its first line; put a header line above"),
        (f'{HEAD}\n{ROW},1\n{ROW}\n', "table '{}' line 2 has 10 cells, the header has 9"),
        ('a b\n1 2\n', '--delimiter decides'),
        (
            headed(ROW, ROW.replace('0.3', 'abc')),
            "table '{}' line 3, column 'j3': 'abc' is no number",
        ),
        (f'{HEAD},x\n{ROW},1\n', "table '{}' has two columns called 'x'; rename one"),
        (
            headed(ROW).replace('j6', 'w'),
            "table '{}': the table has no columns for the 6 joints of",
        ),
        (
            headed(ROW).replace('z', 'w'),
            "table '{}': the table has no columns with measured positions",
        ),
        ('j1;j2;j3;j4;j5;j6;x;y;z\n0,1;0,2;0,3;0,4;0,5;0,6;7.1;8.1;9.1\n', '--decimal decides'),
        (
            headed(f'{ROW},1,2,3').replace('x,y,z', SEVERAL),
            f'several columns could serve ({SEVERAL.replace(",", ", ").replace("z, l", "z; l")});',
        ),
        (headed(ROW.replace('0.9', '')), "table '{}' has no complete row"),
        (
            headed(ROW, ROW.replace('0.9', '-1e308')),
            "line 3, column 'z': -1e+308 is far beyond any",
        ),
    ],
)
def test_bad_tables_are_refused_in_one_sentence(tmp_path, ur5, text, words):
    path = tmp_path / 't.csv'
    path.write_text(text)
    with pytest.raises(DataError, match=re.escape(words.format(path))) as caught:
        read_table(path, ur5)
    assert '\n' not in str(caught.value)


def test_a_spreadsheet_and_a_missing_table_are_told(tmp_path, ur5):
    (tmp_path / 't.xlsx').write_bytes(b'PK\x03\x04\0\0\0\0')
    with pytest.raises(DataError, match='is no text; save it as CSV'):
        read_table(tmp_path / 't.xlsx', ur5)
    with pytest.raises(DataError, match=r"nowhere\.csv' cannot be read: No such file"):
        read_table(tmp_path / 'nowhere.csv', ur5)


def test_positions_of_another_robot_are_told_and_refused_where_the_user_said_how_to_read(
    tmp_path, ur5
):
    q, T = poses(load_robot('abb_irb1600'), 40)
    path = table(tmp_path / 't.csv', [*JOINTS, 'x', 'y', 'z'], q, T[:, :3, 3])
    said = ' '.join(read_table(path, ur5).assumptions)
    assert 'wrong robot, joint columns, or units' in said and 'weld-twin diagnose' in said
    with pytest.raises(DataError, match='wrong robot, joint columns, or units'):
        read_table(path, ur5, TableOptions(length_unit='m'))


def test_a_length_that_is_neither_metres_nor_millimetres_is_told(tmp_path, ur5):
    q, T = poses(ur5, 40)
    path = table(tmp_path / 't.csv', [*JOINTS, 'x', 'y', 'z'], q, T[:, :3, 3] * 70.0)
    assert '--length-unit decides' in ' '.join(read_table(path, ur5).assumptions)


def test_angles_no_convention_explains_are_refused(tmp_path, ur5):
    q, T = poses(ur5, 40)
    angles = np.random.default_rng(3).uniform(-3.0, 3.0, (40, 3))
    header = [*JOINTS, 'x', 'y', 'z', 'rx', 'ry', 'rz']
    path = table(tmp_path / 't.csv', header, q, T[:, :3, 3], angles)
    with pytest.raises(DataError, match='no reading of the three angles agrees with the arm'):
        read_table(path, ur5)
    recording, _ = read_table(path, ur5, TableOptions(positions_only=True))
    assert recording.measured.rotation is None


def test_angles_that_fit_several_conventions_need_the_user(tmp_path, ur5):
    q, T = poses(ur5, 1)
    q = np.repeat(q, 9, axis=0)
    q[:, 5] += np.linspace(0.0, 1.0, 9)
    there = forward(ur5, q)
    turned = Rotation.from_matrix(T[0, :3, :3]).inv() * Rotation.from_matrix(there[:, :3, :3])
    header = [*JOINTS, 'x', 'y', 'z', 'rx', 'ry', 'rz']
    path = table(tmp_path / 't.csv', header, q, there[:, :3, 3], turned.as_rotvec())
    with pytest.raises(DataError, match='--rotation decides'):
        read_table(path, ur5, TableOptions(length_unit='m'))


@pytest.mark.parametrize(
    ('options', 'words'),
    [
        ({'difference': 'times'}, "--difference must be one of add, subtract, got 'times'"),
        ({'rotation': 'ABC'}, '--rotation must be one of XYZ, '),
        ({'position_columns': ('x', 'y')}, '--position-columns needs 3 column names, got 2'),
    ],
)
def test_options_that_mean_nothing_are_refused(options, words):
    with pytest.raises(DataError, match=re.escape(words)):
        TableOptions(**options)


def test_of_several_targets_in_one_column_one_is_read_and_names_of_postures_are_none(
    tmp_path, ur5
):
    q, pose = poses(ur5)
    beside = pose[:, :3, 3] + pose[:, :3, 0] * 0.08
    rows = [
        [*joints, name, *place]
        for joints, ends in zip(q, zip(pose[:, :3, 3], beside, strict=True), strict=True)
        for name, place in zip(('T1', 'T2'), ends, strict=True)
    ]
    head = [*(f'J{k}' for k in range(1, 7)), 'SMR', 'x', 'y', 'z']
    file = tmp_path / 'cell.csv'
    file.write_text('\n'.join(','.join(map(str, row)) for row in [head, *rows]))
    with pytest.raises(
        DataError, match='several things were tracked; --marker takes one of T1, T2'
    ):
        read_table(file, ur5)
    read = read_table(file, ur5, TableOptions(marker='T2'))
    np.testing.assert_allclose(read.recording.measured.position, beside, atol=1e-9)
    assert any("'T2' of column 'SMR'" in said for said in read.assumptions)
    own = [[*row[:6], f'P{k}', *row[7:]] for k, row in enumerate(rows[::2])]
    file.write_text('\n'.join(','.join(map(str, row)) for row in [head, *own]))
    assert len(read_table(file, ur5).recording.measured.position) == len(q)
