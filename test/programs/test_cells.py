# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Programs of a robot on a rail beside a table that tilts and turns.

Every oracle is made here of plain matrices: what the controller believes, what the real cell does,
and a reader of the numbers in the corrected file. The robot file has the rail and both axes of the
table; the tilt is one that the controller counts the other way round.
"""

import json
import re

import numpy as np
import pytest
import yaml
from command_line import done, refused, weld_twin
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

import weld_twin_core as wt
from weld_twin_msgs_py.programs.controllers import world_of

QUARTER = 0.5 * np.pi
RAIL = {'name': 'rail', 'type': 'prismatic', 'alpha': QUARTER, 'lower': -2.0, 'upper': 2.0}
TABLE = [
    {'name': 'tilt', 'a': 0.1, 'd': 0.2, 'alpha': QUARTER, 'lower': -1.6, 'upper': 1.6},
    {'name': 'turn', 'd': -0.1, 'theta_offset': 0.3, 'lower': -6.2, 'upper': 6.2},
]
FRAMES = {
    'base': {'xyz': [0.0, 0.0, 0.3], 'quat_xyzw': [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]},
    'tool': {'xyz': [0.05, 0.02, 0.35], 'quat_xyzw': [0.0, 0.6, 0.0, 0.8]},
    'foot': {'xyz': [1.3, 0.1, 0.6], 'quat_xyzw': [0.0, -(0.5**0.5), 0.0, 0.5**0.5]},
    'table': {'xyz': [0.1, 0.05, 0.08], 'quat_xyzw': [0.0, 0.0, 0.6, 0.8]},
}
OFF = {'tilt': -8e-4, 'turn': 5e-4, 'joint_2': 1.2e-3, 'joint_5': -9e-4}
ROOT = [6e-4, -4e-4, 3e-4]
"""What the real cell has: zeros that are off, and a table that stands elsewhere."""
POSTURES = np.array(
    # turn, tilt, rail, joints 1 to 6
    [
        [0.2, 0.1, 0.3, -0.6, 1.0, -0.2, 0.3, -0.9, 0.4],
        [0.3, 0.2, 0.35, -0.55, 1.02, -0.22, 0.32, -0.88, 0.42],
        [0.5, 0.2, 0.4, -0.5, 1.05, -0.25, 0.35, -0.85, 0.45],
        [0.6, 0.0, 0.4, -0.52, 1.03, -0.23, 0.33, -0.86, 0.43],
    ]
)
OBJECT = ([40.0, -25.0, 12.0], [30.0, 10.0, -5.0])
"""The base of the program on the table's flange: X Y Z [mm] and A B C [deg]."""
EXTERNAL = {
    'krl': 'E1=rail,E2=-tilt,E3=turn',
    'rapid': 'eax_a=rail,eax_b=-tilt,eax_c=turn',
    'fanuc-ls': 'E1=rail,GP2.J1=-tilt,GP2.J2=turn',
}
NAMES = {'krl': 'cell.src', 'rapid': 'cell.mod', 'fanuc-ls': 'cell.ls'}


def stood(frame):
    return placed(np.array(frame['xyz']), Rotation.from_quat(frame['quat_xyzw']))


def placed(xyz, turn):
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = turn.as_matrix(), xyz
    return out


def rows_of(arm):
    return [RAIL, *arm['joints']]


def chain(rows, values, off):
    pose = np.eye(4)
    for row, value in zip(rows, values, strict=True):
        value = value + off.get(row['name'], 0.0)
        slides = row.get('type') == 'prismatic'
        theta = row.get('theta_offset', 0.0) + (0.0 if slides else value)
        slid = [0.0, 0.0, row.get('d', 0.0) + (value if slides else 0.0)]
        pose = pose @ placed(slid, Rotation.from_rotvec([0.0, 0.0, theta]))
        pose = pose @ placed([row.get('a', 0.0), 0, 0], Rotation.from_rotvec([row['alpha'], 0, 0]))
    return pose


@pytest.fixture(scope='module')
def arm():
    return wt.load('abb_irb1600').to_mapping()


def seen(arm, q, *, real):
    """Return the tool on the table's flange, as the controller believes or as it is."""
    off, away = (OFF, ROOT) if real else ({}, [0.0, 0.0, 0.0])
    base, foot = stood(FRAMES['base']), stood(FRAMES['foot'])
    foot[:3, 3] += base[:3, :3] @ away
    table = [TABLE[0], TABLE[1] | {'alpha': 0.0}]
    plate = foot @ chain(table, q[1::-1], off)
    return np.linalg.inv(plate) @ base @ chain(rows_of(arm), q[2:], off) @ stood(FRAMES['tool'])


def reached(arm, pose, q):
    """Return the posture near one in which the controller believes to be at a pose."""

    def gap(own):
        now = seen(arm, np.concatenate([q[:3], own]), real=False)
        turn = Rotation.from_matrix(now[:3, :3].T @ pose[:3, :3]).as_rotvec()
        return np.concatenate([now[:3, 3] - pose[:3, 3], turn])

    own = least_squares(gap, q[3:], xtol=1e-15, ftol=1e-15, gtol=1e-15).x
    return np.concatenate([q[:3], own])


def on_object():
    xyz, abc = OBJECT
    return placed(np.array(xyz) * 1e-3, Rotation.from_euler('ZYX', abc, degrees=True))


def axes(q):
    """Return the rail [mm], the tilt as the controller counts it and the turn [deg]."""
    return q[2] * 1e3, -np.degrees(q[1]), np.degrees(q[0])


def krl(arm):
    rows = ['DEF cell( )', 'BAS (#INITMOV,0 )', f'$TOOL = {{{kuka(stood(FRAMES["tool"]))}}}']
    xyz, abc = OBJECT
    frame = ','.join(f'{n} {v}' for n, v in zip('XYZABC', xyz + abc, strict=True))
    own = ','.join(f'A{k + 1} {v:.6f}' for k, v in enumerate(np.degrees(POSTURES[0, 3:])))
    rows.append(f'PTP {{{own},{kuka_axes(POSTURES[0])}}}')
    rows.append(f'$BASE = EK(MACHINE_DEF[2].ROOT, MACHINE_DEF[2].MECH_TYPE, {{{frame}}})')
    for q in POSTURES[1:]:
        place = np.linalg.inv(on_object()) @ seen(arm, q, real=False)
        rows.append(f'LIN {{{kuka(place)},{kuka_axes(q)},E4 0.0}}')
    return '\n'.join([*rows, 'END', ''])


def kuka(pose):
    turn = Rotation.from_matrix(pose[:3, :3]).as_euler('ZYX', degrees=True)
    values = zip('XYZABC', [*pose[:3, 3] * 1e3, *turn], strict=True)
    return ','.join(f'{n} {v:.6f}' for n, v in values)


def kuka_axes(q):
    return ','.join(f'E{k + 1} {v:.6f}' for k, v in enumerate(axes(q)))


def abb(pose, digits=9):
    x, y, z, w = Rotation.from_matrix(pose[:3, :3]).as_quat()
    numbers = [*pose[:3, 3] * 1e3], [w, x, y, z]
    return '[{}],[{}]'.format(*(','.join(f'{v:.{digits}f}' for v in part) for part in numbers))


def rapid(arm):
    load = '[1,[0,0,1],[1,0,0,0],0,0,0]'
    rows = ['MODULE cell', f'PERS tooldata torch:=[TRUE,[{abb(stood(FRAMES["tool"]))}],{load}];']
    wobj = f'[FALSE,FALSE,"STN1",[[7,8,9],[1,0,0,0]],[{abb(on_object())}]]'
    rows += [f'PERS wobjdata part:={wobj};', 'PROC main()']
    own = ','.join(f'{v:.6f}' for v in np.degrees(POSTURES[0, 3:]))
    rows.append(f'MoveAbsJ [[{own}],{abb_axes(POSTURES[0])}],v100,fine,torch\\WObj:=part;')
    for q in POSTURES[1:]:
        place = np.linalg.inv(on_object()) @ seen(arm, q, real=False)
        conf = ','.join(f'{np.floor(v / QUARTER):.0f}' for v in q[[3, 6, 8]])
        target = f'[{abb(place)},[{conf},0],{abb_axes(q)}]'
        rows.append(f'MoveL {target},v100,fine,torch\\WObj:=part;')
    return '\n'.join([*rows, 'ENDPROC', 'ENDMODULE', ''])


def abb_axes(q):
    return '[{:.6f},{:.6f},{:.6f},9E9,9E9,9E9]'.format(*axes(q))


def fanuc(arm):
    rows = ['/PROG CELL', '/MN', '   1:J P[1] 100% FINE ;']
    rows += [f'   {k}:L P[{k}] 100mm/sec FINE COORD ;' for k in (2, 3, 4)]
    rows.append('/POS')
    for k, q in enumerate(POSTURES, start=1):
        own = ', '.join(f'J{i + 1} = {v:.6f} deg' for i, v in enumerate(np.degrees(q[3:])))
        rail, tilt, turn = axes(q)
        rows += [f'P[{k}]{{', f'   GP1:\n UF : 0, UT : 1,\n {own}, E1 = {rail:.6f} mm']
        rows += [f'   GP2:\n UF : 1, UT : 1,\n J1 = {tilt:.6f} deg, J2 = {turn:.6f} deg', '};']
    return '\n'.join([*rows, '/END', ''])


WRITE = {'krl': krl, 'rapid': rapid, 'fanuc-ls': fanuc}


def numbers(text):
    return [float(v) for v in re.findall(r'[-+]?\d+\.\d+', text)]


def told(text, language):
    """Return of the points of a program whether they are joints, their numbers and the axes'."""
    if language == 'krl':
        moves = re.findall(r'^(PTP|LIN) \{(.*)\}', text, re.M)
        parts = [(kind == 'PTP', numbers(m), 6) for kind, m in moves]
    elif language == 'rapid':
        moves = re.findall(r'^(Move\w+) \[(.*?)\],v100', text, re.M)
        parts = [(k == 'MoveAbsJ', numbers(m), 6 if k == 'MoveAbsJ' else 7) for k, m in moves]
    else:
        points = re.split(r'P\[\d\]\{', text)[1:]
        parts = [(True, numbers(p.split('};')[0]), 6) for p in points]
    return [(joints, v[:n], v[n : n + 3]) for joints, v, n in parts]


def meant(arm, point, q):
    """Return the posture to which a controller takes a point that it comes to from near q."""
    joints, own, beside = point
    q = np.array([np.radians(beside[2]), -np.radians(beside[1]), beside[0] * 1e-3, *q[3:]])
    if joints:
        return np.concatenate([q[:3], np.radians(own)])
    if len(own) == 6:
        turn = Rotation.from_euler('ZYX', own[3:], degrees=True)
    else:
        turn = Rotation.from_quat([*own[4:], own[3]])
    return reached(arm, on_object() @ placed(np.array(own[:3]) * 1e-3, turn), q)


@pytest.fixture
def cell(tmp_path, arm):
    """Write the robot file and what was found of the cell."""
    robot = {'name': 'cell', 'base': FRAMES['base'], 'tool': FRAMES['tool']}
    robot |= {'gravity': [0.0, 9.80665, 0.0], 'joints': rows_of(arm)}
    robot['workpiece'] = {'base': FRAMES['foot'], 'tool': FRAMES['table'], 'joints': TABLE}
    (tmp_path / 'cell.yaml').write_text(yaml.safe_dump(robot), encoding='utf-8')
    found = [{'effect': 'joint_offset', 'joint': n, 'offset': v} for n, v in OFF.items()]
    found.append({'effect': 'root_pose', 'xyz': ROOT, 'rotvec': [0.0, 0.0, 0.0]})
    (tmp_path / 'found.yaml').write_text(yaml.safe_dump(found), encoding='utf-8')
    return tmp_path


def corrected(cell, language, text, *more):
    (cell / NAMES[language]).write_text(text, encoding='utf-8')
    words = ('correct', cell / NAMES[language], '--robot', cell / 'cell.yaml')
    words += (
        '--out',
        cell / 'out',
        '--model',
        cell / 'found.yaml',
        '--max-correction',
        '6mm',
        '1deg',
    )
    return weld_twin(*words, *more)


@pytest.mark.parametrize('language', WRITE)
def test_a_corrected_program_takes_the_real_tool_to_the_place_on_the_real_workpiece(
    cell, arm, language
):
    text = WRITE[language](arm)
    ran = corrected(cell, language, text, '--external', EXTERNAL[language])
    assert ran.code == 0, ran.err
    after = (cell / 'out' / NAMES[language]).read_text(encoding='utf-8')
    points = list(zip(told(text, language), told(after, language), strict=True))
    assert len(points) == len(POSTURES)
    for (was, now), q in zip(points, POSTURES, strict=True):
        assert now[2] == was[2]  # no external axis goes elsewhere
        wanted = seen(arm, meant(arm, was, q), real=False)
        np.testing.assert_allclose(wanted, seen(arm, q, real=False), atol=2e-8)
        before = seen(arm, q, real=True)
        there = seen(arm, meant(arm, now, q), real=True)
        assert np.linalg.norm((before - wanted)[:3, 3]) > 5e-4
        np.testing.assert_allclose(there[:3, 3], wanted[:3, 3], atol=4e-6)
        np.testing.assert_allclose(there[:3, :3], wanted[:3, :3], atol=4e-6)
    entry = json.loads((cell / 'out' / 'correction.json').read_text(encoding='utf-8'))
    (note,) = [note for note in entry['notes'] if 'is -tilt' in note]
    assert 'compare them with the pendant' in note
    # Nothing but digits of points differs.
    after = re.sub(r'[^\n]*corrected by weld_twin[^\n]*\n', '', after)
    assert re.sub(r'[-\d.]', '', after) == re.sub(r'[-\d.]', '', text)


KNOWN = ('--external', '')
"""The option that tells the axes as they are called."""
STANDS = (r'\$BASE = EK.*', '$BASE = {X 0,Y 0,Z 0,A 0,B 0,C 0}')
"""What lets the base stand still while the table turns."""
ALONG = 'the positioner moves while the tool goes straight in a frame that stands still'
SECOND = (
    'PERS wobjdata w:=[FALSE,FALSE,"STN2",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\nPROC main'
)
OPEN = [
    ('krl', (), None, 'say which external axes of the controller the joints turn, tilt, rail'),
    ('krl', ('--external', 'E1=rail,E2=tilt'), None, 'must tell each of the joints turn'),
    ('krl', ('--external', 'E1=rail,E2=tilt,E2=turn'), None, 'a name of its own'),
    ('krl', ('--external', 'eax_a=rail'), None, '--external needs NAME=joint'),
    ('krl', KNOWN, (r'(LIN.*),E2 [-.\d]+', r'\1'), 'does not say where the external axes stand'),
    ('krl', KNOWN, (STANDS[0], 'BAS(#BASE,17)'), 'whether base 17 goes along with the positioner'),
    ('krl', KNOWN, STANDS, 'where the track begins in it is not known; say it with --world'),
    ('krl', (*KNOWN, '--world', '0,0,0,0,0,0'), STANDS, ALONG),
    ('krl', KNOWN, ('E4 0.0', 'E4 1.0'), 'moves external axes'),
    ('rapid', KNOWN, ('PROC main', SECOND), 'with STN1 and STN2, and a robot file has one'),
    ('fanuc-ls', KNOWN, (' COORD', ''), ALONG),
    ('fanuc-ls', KNOWN, (r'J(\d) = (\S+) deg, (?=.*E1)', r'\2 '), 'needs X Y Z W P R, or J1'),
]


@pytest.mark.parametrize(('language', 'options', 'change', 'sentence'), OPEN)
def test_what_a_program_leaves_open_is_asked_for_and_nothing_is_written(
    cell, arm, language, options, change, sentence
):
    text = WRITE[language](arm)
    text = re.sub(*change, text) if change else text
    ran = corrected(cell, language, text, *(word or EXTERNAL[language] for word in options))
    assert ran.code == 2
    assert sentence in ran.err
    assert ran.err.count('\n') == 1
    assert not (cell / 'out').exists()


def test_a_base_that_goes_along_is_none_for_a_robot_alone(cell, arm):
    robot = yaml.safe_load((cell / 'cell.yaml').read_text(encoding='utf-8'))
    robot['joints'] = robot['joints'][1:]
    del robot['workpiece']
    (cell / 'cell.yaml').write_text(yaml.safe_dump(robot), encoding='utf-8')
    (cell / 'found.yaml').write_text('- {effect: joint_offset, joint: joint_2, offset: 1e-3}\n')
    ran = corrected(cell, 'krl', re.sub(r',E\d [-.\d]+', '', krl(arm)))
    assert ran.code == 2
    assert 'goes along with a positioner, and the robot file has none' in ran.err


@pytest.mark.parametrize('language', WRITE)
def test_stations_are_written_under_the_names_that_the_controller_has(cell, language):
    stations = {'kind': 'joints', 'static': True, 't': [0.0, 1.0, 2.0, 3.0]}
    names = ['turn', 'tilt', 'rail', *(f'joint_{k}' for k in range(1, 7))]
    stations |= {'joint_names': names, 'q': POSTURES.tolist()}
    (cell / 'stations.yaml').write_text(yaml.safe_dump(stations), encoding='utf-8')
    words = ['export', 'program', cell / 'stations.yaml', '--robot', cell / 'cell.yaml']
    words += ['--controller', language, '--out', cell / NAMES[language]]
    assert 'say which external axes' in refused(*words)
    done(*words, '--external', EXTERNAL[language])
    text = (cell / NAMES[language]).read_text(encoding='utf-8')
    digits = 5e-4 if language == 'fanuc-ls' else 5e-6
    for values, q in zip(by_label(text, language), POSTURES, strict=True):
        rail, tilt, turn = axes(q)
        own = {f'{"J" if language == "fanuc-ls" else "A"}{k + 1}': v for k, v in enumerate(q[3:])}
        wanted = {name: np.degrees(v) for name, v in own.items()}
        second = ('GP2.J1', 'GP2.J2') if language == 'fanuc-ls' else ('E2', 'E3')
        wanted |= {'E1': rail, second[0]: tilt, second[1]: turn}
        assert values == pytest.approx(wanted, abs=1.01 * digits)


def by_label(text, language):
    """Return of every station the numbers by what the controller calls them; ABB's as KUKA's."""
    if language == 'krl':
        moves = re.findall(r'PTP \{(.*)\}', text)
        return [{k: float(v) for k, v in (p.split() for p in m.split(','))} for m in moves]
    if language == 'rapid':
        labels = [f'A{k}' for k in range(1, 7)] + ['E1', 'E2', 'E3']
        moves = re.findall(r'MoveAbsJ \[\[(.*?)\],\[(.*?),9E9,9E9,9E9\]\]', text)
        return [dict(zip(labels, numbers(','.join(m)), strict=True)) for m in moves]
    out = []
    for point in re.split(r'P\[\d+\]\{', text)[1:]:
        first, second = point.split('GP2:')
        found = [('', first), ('GP2.', second)]
        pairs = [
            (g + n, v) for g, part in found for n, v in re.findall(r'([JE]\d)=\s*(\S+) ', part)
        ]
        assert re.search(r'E1= *\S+ mm', first)
        out.append({name: float(value) for name, value in pairs})
    return out


def test_the_world_of_a_controller_is_where_a_track_begins_or_that_of_the_arm(arm):
    alone = wt.Robot.from_mapping(arm)
    bare = {key: value for key, value in arm.items() if key not in ('links', 'controller')}
    railed = wt.Robot.from_mapping({**bare, 'name': 'cell', 'joints': rows_of(arm)})
    world, begins = world_of(railed, 'rapid')
    assert begins == 'where the track begins' and np.array_equal(world, np.eye(4))
    assert world_of(alone, 'rapid')[1] != begins
