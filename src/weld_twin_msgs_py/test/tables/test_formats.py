# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Logs of controllers and exports of instruments, a sample each of the documented form."""

import re
from pathlib import Path

import numpy as np
import pytest

from weld_twin_core import DataError, catalog, forward
from weld_twin_core.arm.rotation import quaternion_from_matrix
from weld_twin_msgs_py.tables import TableOptions, read_two_tables
from weld_twin_msgs_py.tables.formats import forms

UR5 = catalog.load('ur5')
COUNT = 40
T = 0.04 * np.arange(float(COUNT))
Q = np.array([0.3, -1.4, 1.2, -1.1, 0.9, 0.4]) + 0.4 * np.sin(
    np.outer(T, [1.0, 1.3, 0.8, 1.7, 1.1, 0.6]) + np.arange(6.0)
)
POSE = forward(UR5, Q)
POINT = POSE[:, :3, 3]
QUAT = quaternion_from_matrix(POSE[:, :3, :3])


def lines(*columns, sign=','):
    values = np.column_stack(columns)
    return '\n'.join(sign.join(f'{v:.7g}' for v in row) for row in values) + '\n'


def rtde():
    """As csv_writer.py of Universal Robots writes what record_configuration.xml asks for."""
    head = [
        'timestamp',
        *(f'target_q_{k}' for k in range(6)),
        *(f'actual_q_{k}' for k in range(6)),
    ]
    head += [*(f'actual_TCP_pose_{k}' for k in range(6)), 'output_int_register_0']
    other = np.zeros((COUNT, 6))
    return ' '.join(head) + '\n' + lines(1000.0 + T, other, Q, other, T * 0, sign=' ')


def ur_rtde():
    head = [
        'timestamp',
        *(f'actual_q_{k}' for k in range(6)),
        *(f'actual_qd_{k}' for k in range(6)),
    ]
    return ','.join(head) + '\n' + lines(50.0 + T, Q, np.zeros((COUNT, 6)))


def egm():
    """As EGMLogger of abb_libegm writes it, with the columns after the first two groups cut."""
    head = ['TIMESTAMP', *(f'R_FB_POS_RJ{k}' for k in range(1, 7))]
    head += [*(f'R_FB_POS_EJ{k}' for k in range(1, 7)), 'R_FB_POS_X', 'R_FB_POS_Y', 'R_FB_POS_Z']
    other = np.zeros((COUNT, 6))
    return ','.join(head) + '\n' + lines(7000.0 + 1e3 * T, np.degrees(Q), other, 1e3 * POINT)


def motive():
    """A rigid body and one of its markers, as Motive 2 and 3 export them."""
    top = 'Format Version,1.23,Take Name,run,Capture Frame Rate,25.000000,Export Frame Rate,'
    top += (
        '25.000000,Rotation Type,Quaternion,Length Units,Millimeters,Coordinate Space,Global\n\n'
    )
    kinds = ['Rigid Body'] * 7 + ['Marker'] * 3
    names = ['torch'] * 7 + ['loose'] * 3
    what = ['Rotation'] * 4 + ['Position'] * 6
    ids = ['506381AA00'] * 7 + ['1'] * 3
    rows = [',Type,' + ','.join(kinds), ',Name,' + ','.join(names), ',ID,' + ','.join(ids)]
    rows += [',,' + ','.join(what), 'Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,X,Y,Z']
    frame = np.arange(float(COUNT))
    return top + '\n'.join(rows) + '\n' + lines(frame, T, QUAT, 1e3 * POINT, 1e3 * POINT + 9.0)


def vicon():
    rows = ['Trajectories', '25', ',,cell:torch,,,cell:other,,', 'Frame,Sub Frame,X,Y,Z,X,Y,Z']
    rows += [',,mm,mm,mm,mm,mm,mm']
    frame = np.arange(1.0, COUNT + 1.0)
    return '\n'.join(rows) + '\n' + lines(frame, 0 * T, 1e3 * POINT, 1e3 * POINT + 5.0)


def qualisys():
    rows = [f'NO_OF_FRAMES\t{COUNT}', 'NO_OF_CAMERAS\t8', 'NO_OF_MARKERS\t2', 'FREQUENCY\t25']
    rows += ['NO_OF_ANALOG\t0', 'ANALOG_FREQUENCY\t0', 'DESCRIPTION\t--']
    rows += ['TIME_STAMP\t2026-11-22, 10:47:36.627\t94247.45402301', 'DATA_INCLUDED\t3D']
    rows += ['MARKER_NAMES\ttorch\tother']
    seen = 1e3 * POINT
    seen[3] = 0.0  # not seen
    return '\n'.join(rows) + '\n' + lines(1e3 * POINT - 7.0, seen, sign='\t')


def spatial_analyzer():
    """Collection, group, target, x, y, z, with the comments that the export may begin with."""
    top = '// SA Version: 2024\n// Frame: A::WORLD (mm)\n'
    rows = [
        f'A, torch, p{k + 1}, {x:.4f}, {y:.4f}, {z:.4f}' for k, (x, y, z) in enumerate(1e3 * POINT)
    ]
    return top + '\n'.join(rows) + '\n'


def curpos(turntable=True):
    """As R-30iA and R-30iB controllers answer for MD:CURPOS.DG, the web page's tags left in."""
    text = ''
    for k, q in enumerate(np.degrees(Q)):
        text += f'<PRE>\nF Number: F999999\nDATE:     12-JUN-26 08:{k:02}\n\n'
        text += 'CURRENT ROBOT POSITION::\nGroup #:  1\n\nCURRENT JOINT POSITION:\n'
        text += ''.join(f'Joint   {i}: {v:9.2f}\n' for i, v in enumerate(q, 1))
        text += '\nTool #:  1\nCURRENT WORLD POSITION:\nX:   2032.71\nCFG: N U T, 0, 0, 0\n\n'
        if turntable:
            text += 'CURRENT ROBOT POSITION::\nGroup #:  2\n\nCURRENT JOINT POSITION:\n'
            text += 'Joint   1:     12.34\n</PRE>\n'
    return text


def leica(sign=';'):
    """No form of Leica or FARO is known: points as a table with names, as anybody exports them."""
    rows, unit = [sign.join(f'{v:.4f}' for v in row) for row in 1e3 * POINT], 'mm'
    if sign == 'German groups':
        sign, unit, swapped = ';', 'um', str.maketrans(',.', '.,')
        rows = [sign.join(f'{v:,.1f}'.translate(swapped) for v in row) for row in 1e6 * POINT]
    names = sign.join(['Point', *(f'{axis} [{unit}]' for axis in 'XYZ')])
    return '\n'.join([names, *(f'P{k}{sign}{row}' for k, row in enumerate(rows, 1))]) + '\n'


def both(tmp_path, log, seen):
    for name, text in (('log.csv', log), ('seen.csv', seen)):
        (tmp_path / name).write_text(text)
    return tmp_path / 'log.csv', tmp_path / 'seen.csv', UR5


@pytest.mark.parametrize('log', [rtde, ur_rtde, egm], ids=lambda f: f.__name__)
def test_a_log_of_a_controller_is_a_motion(tmp_path, log):
    recording, said = read_two_tables(
        *both(tmp_path, log(), vicon()), TableOptions(marker='cell:torch')
    )
    assert not recording.joints.static
    np.testing.assert_allclose(recording.joints.q, Q, atol=1e-6)
    np.testing.assert_allclose(np.diff(recording.joints.t), 0.04, atol=2e-4)
    assert any('both clocks are taken to begin' in sentence for sentence in said)


@pytest.mark.parametrize(
    ('seen', 'marker'),
    [(motive, 'torch'), (vicon, 'cell:torch'), (qualisys, 'other')],
    ids=lambda v: getattr(v, '__name__', v),
)
def test_what_was_tracked_comes_in_metres_at_its_own_stamps(tmp_path, seen, marker):
    recording, said = read_two_tables(
        *both(tmp_path, ur_rtde(), seen()), TableOptions(marker=marker)
    )
    keep = np.arange(COUNT) != 3 if seen is qualisys else np.ones(COUNT, bool)
    np.testing.assert_allclose(recording.measured.position, POINT[keep], atol=1e-6)
    np.testing.assert_allclose(recording.measured.t, T[keep], atol=1e-4)
    turned = recording.measured.rotation
    assert (turned is not None) == (seen is motive), said
    if turned is not None:
        np.testing.assert_allclose(turned, POSE[:, :3, :3], atol=1e-6)


@pytest.mark.parametrize('sign', [', ', ' ', '\t'])
def test_points_without_stamps_are_paired_row_by_row(tmp_path, sign):
    points = spatial_analyzer().replace(', ', sign)
    recording, said = read_two_tables(*both(tmp_path, ur_rtde(), points))
    assert recording.joints.static
    np.testing.assert_allclose(recording.measured.position, POINT, atol=1e-6)
    assert 'rows of both files are paired in their order' in said


@pytest.mark.parametrize('sign', [';', '\t', ',', 'German groups'])
def test_positions_of_fanuc_and_points_of_any_tracker_are_paired(tmp_path, sign):
    recording, said = read_two_tables(*both(tmp_path, curpos(), leica(sign)))
    assert recording.joints.static
    np.testing.assert_allclose(recording.joints.q, Q, atol=np.radians(0.0051))
    np.testing.assert_allclose(recording.measured.position, POINT, atol=1e-6)
    assert any('CURPOS.DG' in sentence for sentence in said)


def test_positions_of_two_arms_in_one_file_are_told(tmp_path):
    mixed = curpos(False) + curpos(False).replace('Joint   6', 'Axis')
    with pytest.raises(DataError, match='positions of 5 and 6 joints; copy files of one arm'):
        read_two_tables(*both(tmp_path, mixed, leica()))


@pytest.mark.parametrize(
    ('log', 'seen', 'options', 'offset', 'words'),
    [
        (rtde, vicon, {}, 0.0, '--marker takes one of cell:torch, cell:other'),
        (rtde, motive, {'marker': 'gun'}, 0.0, "there is no 'gun'; --marker takes one of torch"),
        (rtde, vicon, {'marker': 'cell:torch'}, 90.0, 'lies within the time of'),
    ],
)
def test_what_is_not_clear_is_told_in_a_sentence(tmp_path, log, seen, options, offset, words):
    with pytest.raises(DataError, match=re.escape(words)):
        read_two_tables(*both(tmp_path, log(), seen()), TableOptions(**options), offset)


def test_rows_with_numbers_of_stations_are_paired_by_them(tmp_path):
    """The instrument measured the stations in another order, and one less."""
    number = np.arange(1.0, COUNT + 1)
    log = 'No,' + ','.join(f'J{k} [deg]' for k in range(1, 7)) + '\n'
    order = np.random.default_rng(4).permutation(COUNT)[1:]
    seen = 'no,x [mm],y [mm],z [mm]\n' + lines(number[order], 1e3 * POINT[order])
    recording, said = read_two_tables(*both(tmp_path, log + lines(number, np.degrees(Q)), seen))
    kept = np.sort(order)
    np.testing.assert_allclose(recording.joints.q, Q[kept], atol=1e-6)
    np.testing.assert_allclose(recording.measured.position, POINT[kept], atol=1e-6)
    paired = "rows of both files are paired by 'No'; 1 of the joints and 0 of the instrument"
    assert any(sentence.startswith(paired) for sentence in said)


def test_files_that_nothing_brings_together_are_refused(tmp_path):
    fewer = '\n'.join(spatial_analyzer().splitlines()[:-1]) + '\n'
    with pytest.raises(DataError, match='nothing says which belong together'):
        read_two_tables(*both(tmp_path, rtde(), fewer))


def trace_of_kuka(folder, interleaved):
    """Describe six axes in degrees as a KRC4 does, their values in one file beside."""
    entry = '#BEGINCHANNELHEADER\n{}\n#ENDCHANNELHEADER\n'
    text = 'DIAEXTENDED\n\n#BEGINGLOBALHEADER\n  1,DOS\n#ENDGLOBALHEADER\n\n'
    time = ['200,Zeit', '201,Zeitkanal', '202,sec', '210,IMPLIZIT  ', f'220,{COUNT}']
    text += entry.format('\n'.join([*time, '240,0.00000', '241,0.04000000']))
    for k in range(6):
        first = 1 + k if interleaved else 1 + k * COUNT
        rows = [f'200,$AXIS_ACT_MEAS[{k + 1}]', '202,\N{DEGREE SIGN}', '210,EXPLIZIT']
        rows += ['211,run#1.r64', '213,BLOCK', '214,REAL64', f'220,{COUNT}', f'221,{first}']
        text += entry.format('\n'.join([*rows, '240,0', '241,1.000000e-03']))
    (folder / 'run.dat').write_text(text, encoding='latin-1')
    stored = 1e3 * np.degrees(Q)
    (stored if interleaved else stored.T).astype('<f8').tofile(folder / 'run#1.r64')
    return folder / 'run.dat'


@pytest.mark.parametrize('interleaved', [True, False])
def test_a_trace_of_kuka_is_read_with_the_values_beside_it(tmp_path, interleaved):
    _, seen, _ = both(tmp_path, '', vicon())
    path = trace_of_kuka(tmp_path, interleaved)
    recording, _ = read_two_tables(path, seen, UR5, TableOptions(marker='cell:torch'))
    np.testing.assert_allclose(recording.joints.q, Q, atol=1e-9)
    (tmp_path / 'run#1.r64').unlink()
    with pytest.raises(DataError, match=r"needs '.*run#1\.r64' beside it; copy all files"):
        read_two_tables(path, seen, UR5)


@pytest.mark.filterwarnings('ignore:No analog data')  # the writer's
def test_a_marker_of_a_c3d_file_is_read(tmp_path):
    c3d = pytest.importorskip('c3d', reason='needs the library for C3D')
    writer = c3d.Writer(point_rate=25.0, point_units='mm  ')
    writer.set_point_labels(['torch', 'other'])
    points = np.zeros((COUNT, 2, 5), dtype=np.float32)
    points[:, 0, :3], points[:, 1, :3] = 1e3 * POINT, 5.0
    points[7, 0, 3] = -1.0  # not seen
    empty = np.zeros((0, 0), dtype=np.float32)
    writer.add_frames([(frame, empty) for frame in points])
    with open(tmp_path / 'run.c3d', 'wb') as file:
        writer.write(file)
    log, _, _ = both(tmp_path, ur_rtde(), '')
    recording, _ = read_two_tables(log, tmp_path / 'run.c3d', UR5, TableOptions(marker='torch'))
    keep = np.arange(COUNT) != 7
    np.testing.assert_allclose(recording.measured.position, POINT[keep], atol=1e-6)
    np.testing.assert_allclose(recording.measured.t, T[keep], atol=1e-4)


def test_a_file_cut_off_before_its_header_is_told(tmp_path):
    cut = vicon().replace('Frame,Sub Frame', 'Frame Sub Frame')
    with pytest.raises(DataError, match='the names of columns are gone'):
        read_two_tables(*both(tmp_path, ur_rtde(), cut))


@pytest.mark.parametrize(
    ('old', 'new', 'words'),
    [
        ('241,0.04000000', '241,often', 'has an entry that is no number'),
        (f'220,{COUNT}', '220,999999999999', 'says that a channel has 999999999999 values'),
        ('214,REAL64', '214,INT12', 'values of type INT12 are not read'),
        ('221,3', '221,17', 'stores its channels in a way that is not known'),
    ],
)
def test_a_trace_that_is_broken_is_told(tmp_path, old, new, words):
    path = trace_of_kuka(tmp_path, True)
    path.write_text(path.read_text('latin-1').replace(old, new, 1), encoding='latin-1')
    _, seen, _ = both(tmp_path, '', vicon())
    with pytest.raises(DataError, match=words):
        read_two_tables(path, seen, UR5)


def test_the_page_has_a_row_for_every_form():
    page = Path(__file__).parents[4] / 'docs' / 'tables.md'
    rows = [line.split('|')[1].strip() for line in page.read_text().splitlines() if '|' in line]
    assert {form.name for form in forms()} <= set(rows)
