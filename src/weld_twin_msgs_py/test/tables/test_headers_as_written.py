# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the header of a table says of stamps, of the way joints are counted, and of several targets."""

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from weld_twin_core import DataError, catalog, forward
from weld_twin_msgs_py.tables import TableOptions, read_contacts, read_table

UR5 = catalog.load('ur5')
Q = np.radians(np.random.default_rng(8).uniform(-150.0, 150.0, (12, 6)).round(3))
POINT = forward(UR5, Q)[:, :3, 3]
BLOCKS = {'deg': np.degrees(Q), 'rad': Q, 'mm': POINT * 1e3, 'm': POINT}


def rows(*kinds, delimiter=';', comma=True, extra=()):
    """Return the rows of a table as text, blocks side by side and texts in front."""
    lines = []
    for k in range(len(Q)):
        cells = [text(k) for text in extra]
        cells += [f'{value:.6f}' for kind in kinds for value in BLOCKS[kind][k]]
        line = delimiter.join(cells)
        lines.append(line.replace('.', ',') if comma else line)
    return '\n'.join(lines) + '\n'


def numbered(word, *, start=1, joined=' '):
    return [f'{word}{joined}{k}' for k in range(start, start + 6)]


@pytest.mark.parametrize(
    ('names', 'text'),
    [
        (['Zeit'], lambda k: f'22.11.2026 08:15:{k:02d},250'),
        (['Datum', 'Uhrzeit'], lambda k: f'22.11.2026;08:15:{k:02d},250'),
        (['Datum', 'Zeit'], lambda k: f'2026-11-22;08:15:{k:02d}.250'),
        (['Timestamp'], lambda k: f'2026-11-22T08:15:{k:02d}.250'),
        (['Date', 'Time'], lambda k: f'11/22/2026;8:15:{k:02d} AM'),
        (['Zeit [s]'], lambda k: f'{k},25'),
    ],
)
def test_times_of_day_and_dates_are_stamps(tmp_path, names, text):
    head = [*names, *numbered('A', joined=''), 'X', 'Y', 'Z']
    path = tmp_path / 'table.csv'
    path.write_text(';'.join(head) + '\n' + rows('deg', 'mm', extra=(text,)))
    recording, said = read_table(path, UR5)
    np.testing.assert_allclose(np.diff(recording.joints.t), 1.0)
    dated = len(names) == 2 or ' ' not in names[0]
    assert (recording.epoch_ns // 10**9 // 86_400 == 20_779) == dated, said


@pytest.mark.parametrize('first', [0, 1])
def test_signs_offsets_and_a_coupled_joint_are_undone(tmp_path, first):
    shown = np.degrees(Q) * [1, -1, 1, 1, -1, 1] - [0, 90, 0, 0, 0, 180] * np.array([1, -1] * 3)
    shown[:, 2] -= -(shown[:, 1])
    head = [*numbered('J', joined=''), 'x [mm]', 'y [mm]', 'z [mm]']
    head += numbered('tau_', start=first, joined='')
    efforts = np.random.default_rng(9).normal(size=shown.shape).round(6)
    lines = [
        ','.join(f'{v:.6f}' for v in row) for row in np.column_stack([shown, POINT * 1e3, efforts])
    ]
    path = tmp_path / 'table.csv'
    path.write_text('\n'.join([','.join(head), *lines]) + '\n')
    # The model's joint 3 is what is shown less joint 2; zeros are moved last.
    model = shown * [1, -1, 1, 1, -1, 1]
    model[:, 2] += model[:, 1]
    offsets = (np.degrees(Q) - model)[0]
    options = TableOptions(
        angle_unit='deg',
        joint_signs=(1, -1, 1, 1, -1, 1),
        coupled='3+2',
        joint_offsets=tuple(offsets),
    )
    recording, said = read_table(path, UR5, options)
    np.testing.assert_allclose(recording.joints.q, Q, atol=1e-6)
    assert 'joints are coupled by 3+2' in said
    matrix, offset = recording.counted
    np.testing.assert_allclose(np.radians(shown) @ matrix.T + offset, Q, atol=1e-6)
    # Efforts do the same work on the joints as the model counts them.
    work = (efforts[:-1] * np.diff(np.radians(shown), axis=0)).sum(axis=1)
    same = (recording.effort.value[:-1] * np.diff(Q, axis=0)).sum(axis=1)
    np.testing.assert_allclose(same, work, atol=1e-6)
    assert read_table(path, UR5).recording.counted is None


@pytest.mark.parametrize(
    ('head', 'words'),
    [
        (
            'Achse 1;Achse 2;Achse 3;Achse 4;Achse 5;Kraft;Ist X;Ist Y;Ist Z',
            'found joints Achse 1, Achse 2, Achse 3, Achse 4, Achse 5, '
            'besides Kraft, Ist X, Ist Y, Ist Z; --joint-columns decides',
        ),
        (
            'Achse 1;Achse 2;Achse 3;Achse 4;Achse 5;Achse 6;Ist X;Ist Y;Strom',
            '(found Ist X, Ist Y; missing z; besides the joints there are Strom)',
        ),
    ],
)
def test_what_was_found_and_what_is_missing_is_listed(tmp_path, head, words):
    path = tmp_path / 'table.csv'
    path.write_text(head + '\n' + rows('deg', 'mm'))
    with pytest.raises(DataError, match=re.escape(words)):
        read_table(path, UR5)


def test_one_of_several_markers_beside_each_other_is_meant(tmp_path):
    head = [
        *numbered('J', joined=''),
        *(f'N1 {a} [mm]' for a in 'xyz'),
        *(f'N2 {a}' for a in 'xyz'),
    ]
    path = tmp_path / 'table.csv'
    lines = rows('deg', 'mm', 'mm', delimiter=',', comma=False).splitlines()
    other = [
        ','.join([*line.split(',')[:6], '1', '2', '3', *line.split(',')[9:]]) for line in lines
    ]
    path.write_text('\n'.join([','.join(head), *other]) + '\n')
    recording, _ = read_table(path, UR5, TableOptions(marker='N2'))
    np.testing.assert_allclose(recording.measured.position, POINT, atol=2e-6)
    with pytest.raises(DataError, match='there of n1, n2: --marker takes one of them'):
        read_table(path, UR5)


def test_a_table_without_a_header_is_told_so_though_its_numbers_repeat(tmp_path):
    path = tmp_path / 'table.csv'
    lines = rows('deg', 'mm', delimiter=',', comma=False).splitlines()
    path.write_text(''.join(f'{line},0,0,0\n' for line in lines))
    with pytest.raises(DataError, match='numbers in its first line; put a header line above'):
        read_table(path, UR5)


def test_orientations_of_an_arm_that_counts_otherwise_name_the_options(tmp_path):
    turn = Rotation.from_matrix(forward(UR5, Q)[:, :3, :3])
    shown = np.degrees(Q) * [1, 1, -1, 1, 1, 1]
    path = tmp_path / 'table.csv'
    options = '--joint-signs, --joint-offsets, --coupled'
    for names, values in (('qx,qy,qz,qw', turn.as_quat()), ('A,B,C', turn.as_euler('ZYX', True))):
        table = np.column_stack([shown, POINT * 1e3, values])
        head = f'J1,J2,J3,J4,J5,J6,x,y,z,{names}'
        np.savetxt(path, table, '%.6f', ',', header=head, comments='')
        try:
            said = ' '.join(read_table(path, UR5).assumptions)
        except DataError as error:
            said = str(error)
        assert options in said


@pytest.mark.parametrize(
    ('options', 'words'),
    [
        ({'coupled': 'three'}, "--coupled needs two joints such as 3+2 or 3-2, got 'three'"),
        ({'joint_signs': (1, -1)}, '--joint-signs needs 6 numbers, got 2'),
    ],
)
def test_an_option_that_means_nothing_is_refused(tmp_path, options, words):
    path = tmp_path / 'table.csv'
    path.write_text(';'.join([*numbered('A', joined=''), *'XYZ']) + '\n' + rows('deg', 'mm'))
    with pytest.raises(DataError, match=re.escape(words)):
        read_table(path, UR5, TableOptions(**options))


def test_touches_take_headers_as_written_too(tmp_path):
    head = [*(f'{name} [°]' for name in numbered('Achse')), 'Kontakt']
    path = tmp_path / 'touches.csv'
    path.write_text('sep=;\n' + ';'.join(head) + '\n' + rows('deg').replace('\n', ';Stift\n'))
    recording, _ = read_contacts(path, UR5)
    np.testing.assert_allclose(recording.joints.q, Q, atol=2e-6)
