# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables as spreadsheets, instruments and controllers leave them, of one arm with known joints."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from weld_twin_core import DataError, Robot, catalog, forward
from weld_twin_msgs_py.files.csv_text import csv_text
from weld_twin_msgs_py.tables import TableOptions, read_table, read_two_tables

ARM = catalog.load('kuka_kr6_r900')
RNG = np.random.default_rng(31)
Q = np.radians(RNG.uniform(-110.0, 110.0, (12, 6)).round(3))
SEEN = forward(ARM, Q)[:, :3, 3] + RNG.normal(scale=1e-5, size=(12, 3))
DEG, MM = np.degrees(Q), 1e3 * SEEN
J, XYZ = [f'J{k}' for k in range(1, 7)], ['X', 'Y', 'Z']
PLAIN = ','.join([*J, *XYZ])


def rows(*blocks, sep=',', form='{:.6f}', comma=False):
    """Return rows of text, blocks side by side."""
    cells = [[form.format(v) for v in np.concatenate(row)] for row in zip(*blocks, strict=True)]
    return [sep.join(c.replace('.', ',') if comma else c for c in row) for row in cells]


def grouped(value):
    """Return a number as a German spreadsheet shows it, thousands in groups."""
    return f'{value:,.3f}'.translate(str.maketrans(',.', '.,'))


def lines(*parts):
    return '\n'.join(
        line for part in parts for line in ([part] if isinstance(part, str) else part)
    )


def many(*names):
    """Return headers of six columns each, numbered where a brace stands."""
    return [name.format(k) for name in names for k in range(1, 7)]


TABLES = {
    'German of a spreadsheet': lines(
        'sep=;',
        ';'.join([*many('Achse {} [°]'), *(f'Ist {a} [mm]' for a in XYZ)]),
        rows(DEG, MM, sep=';', comma=True),
    ),
    'wanted and measured': lines(
        ';'.join([*many('A{}'), *(f'{a} {w} (mm)' for w in ('Soll', 'Ist') for a in XYZ)]),
        rows(DEG, MM + 3.0, MM, sep=';', comma=True),
    ),
    'RAPID': lines(
        '\t'.join([*many('rax_{}'), *(f'trans_{a}' for a in 'xyz')]), rows(DEG, MM, sep='\t')
    ),
    'units below, rows numbered': lines(
        ','.join(['Nr', *J, 'x', 'y', 'z']),
        ','.join(['', *['deg'] * 6, *['mm'] * 3]),
        [f'{k},{row}' for k, row in enumerate(rows(DEG, MM), 1)],
    ),
    'a title above': lines(
        'Messprotokoll Zelle 7\nDatum;22.11.2026\n',
        ';'.join([*many('Gelenk {}'), *(f'Messwert {a}' for a in XYZ)]),
        rows(DEG, MM, sep=';', comma=True),
    ),
    'comments': lines(
        '// made by hand', '# q0,q1,q2,q3,q4,q5,x,y,z', '% rad and m', rows(Q, SEEN)
    ),
    'recorder': lines(
        ','.join([*many('target_q_{}', 'actual_q_{}', 'actual_qd_{}'), 'tracker_x', 'tracker_y'])
        + ',tracker_z',
        rows(0.0 * Q, Q, Q, SEEN),
    ),
    'Yaskawa': lines(','.join([*'SLURBT', *(f'{a} mm' for a in XYZ)]), rows(DEG, MM)),
    'two lines of names': lines('Joints,,,,,,Position,,', ','.join([*J, *XYZ]), rows(DEG, MM)),
    'names, units': lines(
        'Joints [deg],,,,,,Measured [mm],,', ','.join([*J, *XYZ]), rows(DEG, MM)
    ),
    'names, names, units': lines(
        'Joints,,,,,,Nominal,,,Measured,,',
        ','.join([*J, *XYZ, *XYZ]),
        ','.join(['deg'] * 6 + ['mm'] * 6),
        rows(DEG, MM + 3.0, MM),
    ),
    'titles filled up by Excel': lines(
        'Messprotokoll' + ';' * 8,
        'Datum;22.11.2026' + ';' * 7,
        PLAIN.replace(',', ';'),
        rows(DEG, MM, sep=';', comma=True),
    ),
    'groups of thousands': lines(
        ';'.join([*(f'{j} [°]' for j in J), *(f'{a} [µm]' for a in XYZ)]),
        [
            ';'.join([*(f'{v:.6f}'.replace('.', ',') for v in d), *map(grouped, 1e3 * p)])
            for d, p in zip(DEG, MM, strict=True)
        ],
    ),
    'a unit for every column': lines(
        'J1 [rad],J2 [deg],J3 [deg],J4 [deg],J5 [deg],J6 [deg],X [m],Y [mm],Z [cm]',
        rows(Q[:, :1], DEG[:, 1:], SEEN[:, :1], MM[:, 1:2], 0.1 * MM[:, 2:]),
    ),
    'units in the cells': lines(
        PLAIN,
        [
            ','.join([*(f'{v:.6f}°' for v in d), *(f'{v:.6f} mm' for v in p)])
            for d, p in zip(DEG, MM, strict=True)
        ],
    ),
    'target in mm, difference in µm': lines(
        ','.join([*J, *(f'{a}_t [mm]' for a in 'xyz'), *(f'{a}_dif [um]' for a in 'xyz')]),
        rows(DEG, MM - 0.25, np.full((12, 3), 250.0)),
    ),
    'a real minus': lines(PLAIN, rows(DEG, MM)).replace('-', '\N{MINUS SIGN}'),
    'blanks between': lines('   '.join([*J, *XYZ]), rows(DEG, MM, sep='  ')),
    'inches': lines(','.join([*J, *(f'{a} [in]' for a in XYZ)]), rows(DEG, MM / 25.4)),
    'names over two lines in one cell': lines(
        '"J1\n[deg]",J2,J3,J4,J5,J6,"X\n[mm]",Y,Z', rows(DEG, MM)
    ),
    'Measure X': lines(','.join([*J, *(f'Measure {a} [mm]' for a in XYZ)]), rows(DEG, MM)),
    'nominal, measured and difference': lines(
        ','.join([*J, *(f'{w} {a}' for w in ('Nom', 'Meas') for a in XYZ), 'dX', 'dY', 'dZ']),
        rows(DEG, MM - 1.0, MM, np.ones((12, 3))),
    ),
    'measured and difference in small letters': lines(
        ','.join([*J, *XYZ, 'dx', 'dy', 'dz']), rows(DEG, MM, np.ones((12, 3)))
    ),
    'speeds beside': lines(
        ','.join([*(f'{j} [deg]' for j in J), *(f'{j} [deg/s]' for j in J), *XYZ]),
        rows(DEG, 0.0 * DEG, MM),
    ),
    'a delimiter too many': lines(PLAIN, [f'{row},' for row in rows(DEG, MM)]),
}


def of(tmp_path, text, robot=ARM, options=None):
    path = tmp_path / 'table.csv'
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_table(path, robot, options)


@pytest.mark.parametrize('name', TABLES)
def test_units_and_columns_are_those_of_the_header(tmp_path, name):
    recording, said = of(tmp_path, TABLES[name])
    np.testing.assert_allclose(recording.joints.q, Q, atol=2e-6, err_msg=str(said))
    np.testing.assert_allclose(recording.measured.position, SEEN, atol=2e-6, err_msg=str(said))
    computed = 'trans_x may be what the controller computes' in ' '.join(said)
    assert computed is (name == 'RAPID')


def test_positions_that_were_computed_are_told(tmp_path):
    exact = lines(PLAIN, rows(DEG, 1e3 * forward(ARM, Q)[:, :3, 3]))
    assert 'these positions were computed, not measured' in ' '.join(of(tmp_path, exact)[1])


@pytest.mark.parametrize('coding', ['utf-8-sig', 'cp1252', 'utf-16'])
def test_a_table_is_read_in_the_coding_it_is_written_in(tmp_path, coding):
    recording, _ = of(tmp_path, TABLES['German of a spreadsheet'].encode(coding))
    np.testing.assert_allclose(recording.joints.q, Q, atol=2e-6)


WHOLE = 1e3 * forward(ARM, np.radians(DEG.round()))[:, :3, 3] + 700.0
LOST = np.where(np.arange(12)[:, None] % 5 == 1, -9999.0, MM)
MEANT_OTHERWISE = {
    'inches without a word': (lines(PLAIN, rows(DEG, MM / 25.4)), '--length-unit in'),
    'inches called mm': (
        lines(','.join([*J, *(f'{a} [mm]' for a in XYZ)]), rows(DEG, MM / 25.4)),
        '--length-unit in',
    ),
    'radians called degrees': (
        lines(','.join([*(f'{j} [deg]' for j in J), *XYZ]), rows(Q, MM)),
        '--angle-unit rad',
    ),
    'thousands that look like a decimal comma': (
        lines(
            PLAIN.replace(',', ';'),
            [
                ';'.join([*(f'{v:.0f}' for v in d), *(f'{v:,.0f}' for v in p)])
                for d, p in zip(DEG.round(), WHOLE, strict=True)
            ],
        ),
        "--decimal '.'",
    ),
    'numbers that stand for no target': (lines(PLAIN, rows(DEG, LOST)), '--skip-rows 2,7,12'),
}


@pytest.mark.parametrize('name', MEANT_OTHERWISE)
def test_a_table_that_fits_the_arm_when_read_otherwise_is_told_how(tmp_path, name):
    text, option = MEANT_OTHERWISE[name]
    with pytest.raises(DataError, match=f'; with {option} they fit: import it so') as told:
        of(tmp_path, text)
    assert '\n' not in str(told.value)


def test_rows_that_were_pasted_twice_are_no_measurements(tmp_path):
    recording, said = of(tmp_path, lines(PLAIN, rows(DEG, MM), rows(DEG, MM)[3:7]))
    np.testing.assert_allclose(recording.measured.position, SEEN, atol=2e-6)
    assert any('4 rows are others once more' in each and 'line 14' in each for each in said)
    coarse = np.tile(MM, (2, 1)).round(1)
    coarse[12] += 0.1
    again, _ = of(tmp_path, lines(PLAIN, rows(np.tile(DEG, (2, 1)), coarse)))
    assert len(again.measured.position) == 24


def test_rows_in_which_an_instrument_saw_no_target_are_left_out(tmp_path):
    lost = [2, 5, 6]
    seen = MM.copy()
    seen[lost] = 0.0
    recording, said = of(tmp_path, lines(PLAIN, rows(DEG, seen)))
    np.testing.assert_allclose(recording.measured.position, np.delete(SEEN, lost, 0), atol=2e-6)
    np.testing.assert_allclose(recording.joints.q, np.delete(Q, lost, 0), atol=2e-6)
    assert any('3 rows' in each and 'line 4' in each and 'zero' in each for each in said)


def test_a_single_point_or_a_pin_at_the_origin_is_kept(tmp_path):
    recording, _ = of(tmp_path, lines(PLAIN, rows(DEG, MM - MM[3])))
    np.testing.assert_allclose(recording.measured.position, SEEN - SEEN[3], atol=2e-6)
    recording, said = of(tmp_path, lines(PLAIN, rows(DEG, 0.0 * MM)))
    assert not recording.measured.position.any() and len(recording.joints.q) == len(Q), said


@pytest.mark.parametrize('scale', [0.03, 1.0])
def test_degrees_without_a_word_are_told_from_radians_by_the_arm(tmp_path, scale):
    """Small angles in degrees, and angles beyond a turn in radians, look like the other unit."""
    small = scale < 1.0
    q = Q * scale if small else Q + 4.0 * np.pi * np.eye(6)[5]
    seen = 1e3 * forward(ARM, q)[:, :3, 3] + RNG.normal(scale=0.02, size=(12, 3))
    recording, said = of(tmp_path, lines(PLAIN, rows(np.degrees(q) if small else q, seen)))
    np.testing.assert_allclose(recording.joints.q, q, atol=2e-6, err_msg=str(said))


def test_temperatures_times_and_spreads_have_units_too(tmp_path):
    head = f'Zeit [min],Temp (°F),{PLAIN},sigma_x [µm],sigma_y [µm],sigma_z [µm]'
    clock = np.column_stack([np.arange(12.0), np.full(12, 77.0)])
    recording, _ = of(tmp_path, lines(head, rows(clock, DEG, MM, np.full((12, 3), 30.0))))
    np.testing.assert_allclose(np.diff(recording.joints.t), 60.0)
    np.testing.assert_allclose(recording.temperature.value, 25.0)
    np.testing.assert_allclose(recording.measured.sigma, 3e-5)


@pytest.mark.parametrize(
    ('step', 'far', 'rests'), [(0.02, 1e-3, False), (6.0, 1e-3, True), (0.02, 1.0, True)]
)
def test_rows_of_a_motion_are_no_stations(tmp_path, step, far, rests):
    """Fifty rows a second follow a motion, unless no drive could go so far from row to row."""
    q = Q[0] + far * (Q - Q[0])
    seen = forward(ARM, q)[:, :3, 3] + RNG.normal(scale=1e-5, size=(12, 3))
    body = rows(step * np.arange(12.0)[:, None], np.degrees(q), 1e3 * seen)
    recording, said = of(tmp_path, lines(f'time [s],{PLAIN}', body))
    assert recording.joints.static is rests
    assert ('one motion' in ' '.join(said)) is not rests
    np.testing.assert_allclose(recording.measured.t, recording.joints.t)


def test_a_motion_goes_on_where_the_instrument_lost_its_target(tmp_path):
    q = Q[0] + 0.05 * np.sin(0.2 * np.arange(60.0)[:, None] + np.arange(6.0))
    seen = forward(ARM, q)[:, :3, 3] + RNG.normal(scale=1e-5, size=(60, 3))
    shown = np.r_[0:3, 8:30, 45:60]
    told = np.zeros((60, 3))
    told[shown] = 1e3 * seen[shown]
    body = rows(7.0 + 0.1 * np.arange(60.0)[:, None], np.degrees(q), told)
    recording, _ = of(tmp_path, lines(f'time [s],{PLAIN}', body))
    np.testing.assert_allclose(recording.joints.q, q, atol=2e-6)
    np.testing.assert_allclose(recording.measured.t, recording.joints.t[shown], atol=1e-9)
    np.testing.assert_allclose(recording.measured.position, seen[shown], atol=2e-6)


@pytest.mark.parametrize('between', [20.0, 0.1])
def test_readings_one_after_the_other_at_rest_are_of_stations(tmp_path, between):
    """Ten a second while the arm stands, and a way to the next posture that no log holds."""
    many = 4
    t = (np.arange(12.0)[:, None] * (between + 0.1 * many) + 0.1 * np.arange(many)).reshape(-1, 1)
    q = np.repeat(Q, many, axis=0) + RNG.normal(scale=1e-6, size=(12 * many, 6))
    seen = forward(ARM, q)[:, :3, 3] + RNG.normal(scale=1e-5, size=(12 * many, 3))
    body = rows(t, np.degrees(q), 1e3 * seen)
    assert of(tmp_path, lines(f'time [s],{PLAIN}', body))[0].joints.static


@pytest.mark.parametrize('stamp', ['2041-03-01T08:00:{:02d}', '22400000{:02d}'])
def test_stamps_that_no_bag_holds_are_told_and_counted_from_the_first(tmp_path, stamp):
    body = [f'{stamp.format(k)},{row}' for k, row in enumerate(rows(DEG, MM))]
    recording, said = of(tmp_path, lines(f'time,{PLAIN}', body))
    assert 'beyond January 2038' in ' '.join(said)
    assert recording.epoch_ns + 1e9 * recording.joints.t[-1] < 2**31 * 1e9
    np.testing.assert_allclose(np.diff(recording.joints.t), 1.0)


@pytest.mark.parametrize(
    ('text', 'told'),
    [
        (lines(f'{PLAIN},note', [f'{r},"ok' if k == 5 else f'{r},ok'
                                 for k, r in enumerate(rows(DEG, MM))]), 'line 7: a cell has no end'),
        (lines(f'{PLAIN},note', [f'{r},"ok' if k == 5 else f'{r},ok'
                                 for k, r in enumerate(rows(DEG, MM) * 300)]), 'line 7: a cell has no'),
        (lines(','.join(f'c{k}' for k in range(30_000)), ",".join(["1"] * 30_000)), 'more; --joint'),
        (lines(','.join([*J, *(f'{a} [deg]' for a in XYZ)]), rows(DEG, MM)), "unit 'deg' does not fit"),
        (lines(','.join([*J, 'X [m]', 'X [mm]', 'Y', 'Z']), rows(DEG, MM[:, :1], MM)),
         'X [m] and X [mm] mean the same; --position-columns decides'),
    ],
)  # fmt: skip
def test_what_cannot_be_meant_is_one_sentence(tmp_path, text, told):
    with pytest.raises(DataError) as caught:
        of(tmp_path, text)
    assert told in str(caught.value) and len(str(caught.value).splitlines()) == 1
    assert len(str(caught.value)) < 1000


def with_slides(where):
    """Return the arm with a slide in place of the joint at some place in the chain."""
    prismatic = np.zeros(6, bool)
    prismatic[where] = True
    names = tuple(f'axis_{k}' if k != where else 'ram' for k in range(6))
    limits = np.where(prismatic, 2.0, 6.0)
    return replace(
        ARM, name='odd', joint_names=names, prismatic=prismatic, lower=-limits, upper=limits
    )


@pytest.mark.parametrize('where', [0, 3, 5])
@pytest.mark.parametrize('unit', ['m', 'mm', ''])
def test_a_joint_that_slides_is_read_in_its_own_unit(tmp_path, where, unit):
    robot: Robot = with_slides(where)
    q = Q.copy()
    q[:, where] = RNG.uniform(0.1, 1.6, 12)
    seen = 1e3 * forward(robot, q)[:, :3, 3] + RNG.normal(scale=0.02, size=(12, 3))
    shown = np.degrees(q)
    shown[:, where] = q[:, where] * (1.0 if unit == 'm' else 1e3)
    names = [f'{n} [deg]' for n in robot.joint_names]
    names[where] = f'ram [{unit}]' if unit else 'ram'
    recording, said = of(tmp_path, lines(','.join([*names, *XYZ]), rows(shown, seen)), robot)
    np.testing.assert_allclose(recording.joints.q, q, atol=2e-6, err_msg=str(said))


def test_an_axis_beside_the_arm_is_the_joint_that_slides(tmp_path):
    robot = with_slides(0)
    q = Q.copy()
    q[:, 0] = RNG.uniform(0.1, 1.6, 12)
    seen = 1e3 * forward(robot, q)[:, :3, 3]
    head = ','.join([*(f'A{k} [deg]' for k in range(1, 6)), 'E1 [mm]', *XYZ])
    shown = np.column_stack([np.degrees(q[:, 1:]), 1e3 * q[:, 0]])
    recording, _ = of(tmp_path, lines(head, rows(shown, seen)), robot)
    np.testing.assert_allclose(recording.joints.q, q, atol=2e-6)
    with pytest.raises(DataError, match="which slides, and its unit 'deg' does not fit"):
        of(tmp_path, lines(head.replace('mm', 'deg'), rows(shown, seen)), robot)
    options = TableOptions(slide_unit='mm')
    bare = lines(head.replace(' [mm]', ''), rows(shown, seen))
    np.testing.assert_allclose(of(tmp_path, bare, robot, options)[0].joints.q, q, atol=2e-6)


def test_columns_that_serve_nothing_are_told(tmp_path):
    names = ','.join([*(f'A{k} [deg]' for k in range(1, 7)), *XYZ, 'E1 [mm]'])
    _, said = of(tmp_path, lines(names, rows(DEG, MM, np.arange(12.0)[:, None])), ARM)
    assert 'not used: E1 [mm]' in said


@pytest.mark.parametrize('form', ['pairs', 'with differences', 'measured first'])
def test_a_list_of_nominal_and_measured_points_gives_the_measured(tmp_path, form):
    off = np.array([1.0, -2.0, 0.5])
    one, other = (MM, MM - off) if form == 'measured first' else (MM - off, MM)
    more = (
        [] if form == 'pairs' else [np.tile(off, (12, 1)), np.full((12, 1), np.linalg.norm(off))]
    )
    body = [f'Cell, Run, p{k}, {row}' for k, row in enumerate(rows(one, other, *more))]
    (tmp_path / 'points.txt').write_text(lines('// frame: world', body))
    targets = [f'CONST jointtarget p{k}:=[[{row}],[9E9,9E9,9E9,9E9,9E9,9E9]];'
               for k, row in enumerate(rows(DEG))]  # fmt: skip
    (tmp_path / 'joints.mod').write_text(lines('MODULE Points', targets, 'ENDMODULE'))
    recording, said = read_two_tables(tmp_path / 'joints.mod', tmp_path / 'points.txt', ARM)
    np.testing.assert_allclose(recording.joints.q, Q, atol=2e-6)
    np.testing.assert_allclose(recording.measured.position, SEEN, atol=2e-6, err_msg=str(said))


def test_a_name_is_no_formula_in_a_table_and_comes_back_as_it_was(tmp_path):
    names = ('=cmd|x', '@SUM(A1)', '-j3', '+j4', 'j5', 'j6')
    robot = replace(ARM, joint_names=names)
    text = csv_text([*names, *XYZ], [[*d, *p] for d, p in zip(DEG, MM, strict=True)])
    assert all(cell[0] not in '=@+' for cell in text.splitlines()[0].split(','))
    np.testing.assert_allclose(of(tmp_path, text, robot)[0].joints.q, Q, atol=1e-9)


def test_two_axes_before_a_camera_are_no_wrong_robot(tmp_path):
    """The plate goes along an arc, and a target far above it along one that bends the other way."""
    robot = Robot.from_mapping(
        {
            'name': 'positioner',
            'joints': [
                {'name': 'tilt', 'alpha': -0.5 * np.pi},
                {'name': 'turn', 'd': -0.5, 'theta_offset': -0.5 * np.pi},
            ],
        }
    )
    rng = np.random.default_rng(8)
    tilt, turn = (rng.uniform(-span, span, 120) for span in (0.6, 3.0))
    axis, level = np.array([[0.0, 0.0, 1.0]]), Rotation.from_rotvec([-0.5 * np.pi, 0.0, 0.0])
    plate = Rotation.from_rotvec(tilt[:, None] * axis) * level
    target = plate.apply([0.0, 0.0, -0.5])
    turned = Rotation.from_rotvec((turn[:, None] - 0.5 * np.pi) * axis)
    target += (plate * turned).apply([0.3, -0.1, 1.2])
    camera = Rotation.from_rotvec([2.0, -1.0, 0.7])
    seen = camera.apply(target) + [-0.5, 0.2, 1.4] + rng.normal(scale=3e-4, size=(120, 3))
    rows = np.column_stack([tilt, turn, seen]).tolist()
    text = '\n'.join(','.join(map(str, row)) for row in rows)
    path = tmp_path / 'camera.csv'
    path.write_text(f'tilt [rad],turn [rad],x [m],y [m],z [m]\n{text}\n')
    said = ' '.join(read_table(path, robot).assumptions)
    assert 'wrong robot' not in said
    assert 'with base and tool fitted, positions are 0.' in said


@pytest.mark.parametrize('back', [0.5, 5.0, 3600.0])
@pytest.mark.parametrize('which', ['log.csv', 'seen.csv'])
def test_a_clock_set_back_in_one_of_two_files_is_told_with_its_line(tmp_path, back, which):
    t = np.arange(0.0, 60.0, 0.1)
    q = Q[0] + 0.2 * np.sin(0.2 * t[:, None] + np.arange(6.0))
    seen = 1e3 * forward(ARM, q)[:, :3, 3]
    files = {'log.csv': (J, np.degrees(q)), 'seen.csv': (XYZ, seen)}
    for name, (header, values) in files.items():
        clock = 1e9 + np.where((t > 40.0) & (name == which), t - back, t)
        body = rows(clock[:, None], values, form='{:.4f}')
        (tmp_path / name).write_text(lines(','.join(['time [s]', *header]), body))
    with pytest.raises(
        DataError, match=f"{which}': stamps in 'time .s.' go back in line 403"
    ) as told:
        read_two_tables(tmp_path / 'log.csv', tmp_path / 'seen.csv', ARM)
    assert 'give what follows as a table of its own' in str(told.value)
