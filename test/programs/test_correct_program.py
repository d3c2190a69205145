# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A program as a controller has it, corrected: read by another reader, run by another arm."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from command_line import done, refused, weld_twin
from scipy.spatial.transform import Rotation

import weld_twin_core as wt
from weld_twin_core.twin.compensation import beyond_limits
from weld_twin_lab.programs import plain as readers
from weld_twin_lab.programs.plain import along, joints_for, tool_pose
from weld_twin_msgs_py.robots import write_robot_yaml
from weld_twin_nodes.offline import correcting

MADE = Path(__file__).parent / 'made'
CELLS = {
    'krl': ('kuka_kr16_2', ['bracket.src', 'bracket.dat'], readers.krl, [8, -85, 100, 5, 70, -3]),
    'rapid': ('abb_irb1600', ['bracket.mod'], readers.rapid, [8, 20, 15, 4, 55, -6]),
    'urscript': ('ur5', ['bracket.script'], readers.urscript, [10, -80, 95, -105, -90, 5]),
    'inform': ('yaskawa_ma1440', ['bracket.jbi'], readers.inform, [8, 15, -10, 4, -75, -6]),
    'fanuc-ls': ('fanuc_m10ia', ['bracket.ls'], readers.fanuc, [8, 15, 5, 4, -75, -6]),
    'joint-trajectory': ('ur5', ['bracket.yaml'], readers.trajectory, [0] * 6),
    'csv': ('ur5', ['bracket.csv'], readers.table, [0] * 6),
}
OPTIONS = {
    'inform': ['--pulses-per-degree', '1000,-1200,1100,900,-800,700', '--tool', '1=0,0,250,0,0,0'],
    'fanuc-ls': ['--tool', '1=0,0,250,0,0,0'],
}
ROUNDING = {'inform': 2.5e-5, 'fanuc-ls': 5e-5}
"""What is lost [m] as Yaskawa writes pulses and FANUC thousandths of a degree; else micrometres."""
OFFSETS = np.array([2e-4, 8e-4, -5e-4, 3e-4, 2e-4, 0.0])


def words(path, robot, out, model=None):
    """Return the command that corrects a program."""
    return 'correct', path, '--robot', robot, '--out', out, *(('--model', model) if model else ())


def texts(folder, files):
    return [(folder / name).read_bytes().decode('latin-1') for name in files]


def effects(robot):
    pairs = zip(robot.joint_names, OFFSETS.tolist(), strict=True)
    return yaml.safe_dump(
        [
            {'effect': 'joint_offset', 'joint': name, 'offset': value}
            for name, value in pairs
            if value
        ]
    )


def tool_of(robot, language):
    if language in ('joint-trajectory', 'csv'):
        return robot.T_flange_tool
    return robot.T_flange_tool @ along(2, 0.25)


def driven(robot, tool, moves, near):
    """Return where an arm with joints that are off takes its tool, and where it was told to."""
    out = []
    q = np.radians(near)
    for _, places in moves:
        for place in places:
            q = place if place.ndim == 1 else joints_for(robot, place, tool, q)
            out.append(tool_pose(robot, q, tool, OFFSETS))
    return out


def told(robot, tool, moves):
    return [
        tool_pose(robot, place, tool) if place.ndim == 1 else place
        for _, places in moves
        for place in places
    ]


REMARKS = {
    'krl': ['; {}\r\nEND\r\n', '; {}\r\nENDDAT\r\n'],
    'rapid': ['! {}\nENDMODULE\n'],
    'inform': ["'{}\r\nEND\r\n"],
    'fanuc-ls': ['  14:  !{} ;\n/POS\n'],
}
"""How a corrected file says so, with what stands behind it: where controllers take remarks."""


def unmarked(folder, language):
    """Return the texts of a corrected program without the remark, which stands where it belongs."""
    files, out = CELLS[language][1], []
    remarks = REMARKS.get(language, ['# {}\n'])
    for text, remark in zip(texts(folder, files), remarks, strict=True):
        assert remark.format('corrected by weld_twin') in text
        out.append(readers.re.sub(r'[^\n]*corrected by weld_twin[^\n]*\n', '', text))
    return out


@pytest.mark.parametrize('language', CELLS)
def test_a_program_comes_back_byte_for_byte_without_a_model(language, tmp_path):
    robot, files, _, _ = CELLS[language]
    done(*words(MADE / files[0], robot, tmp_path / 'out'), *OPTIONS.get(language, []))
    for name in files:
        assert (tmp_path / 'out' / name).read_bytes() == (MADE / name).read_bytes()


@pytest.mark.parametrize('language', ['krl', 'rapid', 'inform', 'fanuc-ls', 'urscript'])
def test_a_program_that_was_cut_off_is_refused(language, tmp_path):
    robot, files, _, _ = CELLS[language]
    for name in files:
        (tmp_path / name).write_bytes((MADE / name).read_bytes())
    path = tmp_path / files[0]
    path.write_bytes(path.read_bytes().rstrip()[:-9].rstrip())
    assert 'is the file cut off?' in refused(*words(path, robot, tmp_path / 'out'))


def test_points_in_two_files_of_one_name_are_refused(tmp_path):
    for name, copy in (('.src', '.src'), ('.dat', '.dat'), ('.dat', '.DAT')):
        (tmp_path / f'bracket{copy}').write_bytes((MADE / f'bracket{name}').read_bytes())
    said = refused(*words(tmp_path / 'bracket.src', 'kuka_kr16_2', tmp_path / 'out'))
    assert "bracket.DAT' and 'bracket.dat' both belong" in said


def test_a_job_in_pulses_is_refused_without_their_size(tmp_path):
    said = refused(*words(MADE / 'bracket.jbi', 'yaskawa_ma1440', tmp_path / 'out'))
    assert '--pulses-per-degree' in said and not (tmp_path / 'out').exists()


@pytest.mark.parametrize('language', CELLS)
def test_the_real_tool_goes_where_the_program_meant_and_only_digits_change(language, tmp_path):
    name, files, reader, near = CELLS[language]
    robot = wt.load(name)
    model, options = tmp_path / 'found.yaml', OPTIONS.get(language, [])
    model.write_text(effects(robot))
    done(*words(MADE / files[0], name, tmp_path / 'out', model), *options)
    before, after = (reader(texts(folder, files)) for folder in (MADE, tmp_path / 'out'))
    assert [word for word, _ in before] == [word for word, _ in after]
    tool = tool_of(robot, language)
    goals = told(robot, tool, before)
    errors = [
        np.array([np.linalg.norm(g[:3, 3] - r[:3, 3]) for g, r in zip(goals, real, strict=True)])
        for real in (driven(robot, tool, before, near), driven(robot, tool, after, near))
    ]
    # A place derived from another (Offs) goes along with it, and is not corrected for itself.
    led = np.array([word != 'MoveL' for word, places in before for _ in places])
    assert errors[0].min() > 1.5e-4
    assert errors[1][led].max() < ROUNDING.get(language, 4e-6)
    expected = json.loads((tmp_path / 'out' / 'correction.json').read_text())['expected']
    assert expected['after']['rms_m'] < 0.05 * expected['before']['rms_m']
    written = unmarked(tmp_path / 'out', language)
    for pair in zip(texts(MADE, files), written, strict=True):
        old, new = (''.join(readers.re.split(readers.NUMBER, text)) for text in pair)
        assert old == new
        old, new = (readers.re.findall(r'(?:;|!|#)[^\n]*', text) for text in pair)
        assert old == new
    # On another machine, with nothing near that tells where it comes from, it is refused.
    (tmp_path / 'elsewhere').mkdir()
    for file in files:
        (tmp_path / 'out' / file).rename(tmp_path / 'elsewhere' / file)
    moved = tmp_path / 'elsewhere' / files[0]
    said = refused(*words(moved, name, tmp_path / 'b', model), *options)
    assert 'was corrected already' in said and not (tmp_path / 'b').exists()


def corrected(tmp_path, text, *more, name='seam.script', robot='ur5', offset=8e-4):
    (tmp_path / name).write_text(text)
    joint, model = wt.load(robot).joint_names[1], tmp_path / 'found.yaml'
    model.write_text(f'- {{effect: joint_offset, joint: {joint}, offset: {offset}}}\n')
    return weld_twin(*words(tmp_path / name, robot, tmp_path / 'out', model), *more)


SEAM = """def seam():
  movej([0.17, -1.39, 1.65, -1.83, -1.57, 0.08])
  movel(p[-0.52, -0.20, 0.25, 2.12, 2.31, 0.0], v=0.1)
  movel(p[-0.45, -0.20, 0.25, 2.12, 2.31, 0.0], v=0.1)
  movej([0.1, -1.3, 2.5, -1.8, -1.5, 0.0])
end
"""


def test_the_correction_of_another_program_is_not_replaced(tmp_path):
    assert corrected(tmp_path, SEAM).code == 0
    written = (tmp_path / 'out' / 'seam.script').read_bytes()
    said = corrected(tmp_path, SEAM, name='other.script')
    assert said.code == 2 and 'holds the correction of seam.script' in said.err
    assert (tmp_path / 'out' / 'seam.script').read_bytes() == written
    assert corrected(tmp_path, SEAM).code == 0
    said = corrected(tmp_path, SEAM, '--force', name='other.script')
    assert said.code == 0 and 'the correction of seam.script was removed' in said.out


def test_a_folder_given_as_model_is_told_to_be_one(tmp_path):
    (tmp_path / 'seam.script').write_text(SEAM)
    (tmp_path / 'found').mkdir()
    asked = words(tmp_path / 'seam.script', 'ur5', tmp_path / 'out', tmp_path / 'found')
    said = weld_twin(*asked)
    assert said.code == 2 and 'is a folder; give the diagnosis.json' in said.err


def test_a_model_that_is_replaced_while_a_program_is_corrected_is_refused(tmp_path, monkeypatch):
    made = correcting.corrected_program

    def meanwhile(*args, **words):
        (tmp_path / 'found.yaml').write_text('[]\n')
        return made(*args, **words)

    monkeypatch.setattr(correcting, 'corrected_program', meanwhile)
    said = corrected(tmp_path, SEAM)
    assert said.code == 2 and "found.yaml' was changed while it was read" in said.err
    assert not (tmp_path / 'out').exists()


@pytest.mark.parametrize(('apart', 'calm'), [(0.05, False), (0.002, True)])
def test_play_asks_for_no_leap_that_a_joint_cannot_make_between_timed_points(
    apart, calm, tmp_path
):
    robot, width = wt.load('ur5'), 1e-3
    (tmp_path / 'found.yaml').write_text(
        f'- {{effect: backlash, joint: elbow_joint, width: {width}}}\n'
        '- {effect: joint_offset, joint: shoulder_lift_joint, offset: 8e-4}\n'
    )
    t = apart * np.arange(24)
    q = np.tile([0.17, -1.39, 1.65, -1.83, -1.57, 0.08], (t.size, 1))
    q[:, 2] += 0.01 * np.sin(np.pi * t / t[-1])
    stamps = np.round(1e9 * t).astype(int).tolist()
    points = [
        {'positions': row, 'time_from_start': {'sec': ns // 10**9, 'nanosec': ns % 10**9}}
        for ns, row in zip(stamps, q.tolist(), strict=True)
    ]
    text = json.dumps({'joint_names': robot.joint_names, 'points': points})
    (tmp_path / 'plan.json').write_text(text)
    model = tmp_path / 'found.yaml'
    said = done(*words(tmp_path / 'plan.json', 'ur5', tmp_path / 'out', model))
    assert ('rad/s^2 between these points, and the robot file allows 15' in said) is calm
    made = json.loads((tmp_path / 'out' / 'plan.json').read_text())['points']
    moved = np.array([point['positions'] for point in made]) - q
    assert np.ptp(moved[:, 2]) == pytest.approx(0.0 if calm else width, abs=0.01 * width)


def test_commands_that_leap_by_play_are_told(tmp_path):
    (tmp_path / 'found.yaml').write_text('- {effect: backlash, joint: elbow_joint, width: 1e-3}\n')
    seam = ('--robot', 'ur5', '--path', 'spline', '--profile', 'aggressive', '--rate', '250')
    done('simulate', *seam, '--out', tmp_path / 'bag')
    said = done(*words(tmp_path / 'bag', 'ur5', tmp_path / 'out', tmp_path / 'found.yaml'))
    assert 'the correction alone would ask elbow_joint for' in said
    # By hand: a step of 1 mrad within 4 ms takes 0.25 rad/s, and to come to that 62.5 rad/s^2.
    robot, shift = wt.load('ur5'), np.zeros((5, 6))
    shift[2:, 2] = 1e-3
    leaps = beyond_limits(robot, shift, np.full(4, 4e-3))
    assert list(leaps) == [0, 1] and 'elbow_joint for 62.5 rad/s^2' in leaps[0]
    assert not beyond_limits(robot, shift, np.full(4, 1e-2))


@pytest.mark.parametrize(
    ('header', 'frame'),
    [
        ({}, 'corrected by weld_twin'),
        ({'header': {'stamp': {'sec': 0, 'nanosec': 0}}}, 'corrected by weld_twin'),
        ({'header': {'frame_id': ''}}, 'corrected by weld_twin'),
        ({'header': {'frame_id': 'base'}}, 'corrected by weld_twin; base'),
    ],
)
def test_a_corrected_trajectory_in_json_says_so_in_its_header(header, frame, tmp_path):
    points = [{'positions': [0.17, -1.39, 1.65 + k, -1.83, -1.57, 0.08]} for k in (0.0, 0.1)]
    text = json.dumps(header | {'joint_names': wt.load('ur5').joint_names, 'points': points})
    said = corrected(tmp_path, text, name='plan.json')
    assert said.code == 0, said.err
    written = (tmp_path / 'out' / 'plan.json').read_text()
    assert json.loads(written)['header']['frame_id'] == frame
    (tmp_path / 'elsewhere').mkdir()
    said = corrected(tmp_path / 'elsewhere', written, name='goal.json')
    assert said.code == 2 and 'was corrected already' in said.err


def test_what_is_expected_counts_the_way_and_what_an_encoder_rounds(tmp_path):
    # Outward from the base, with all points but one at the beginning. A base joint that stands off
    # moves the tool by its distance from the axis; an encoder in steps by up to half a step of that.
    way = [0.4 + 0.001 * k for k in range(15)] + [0.7]
    moves = [f'  movel(p[{-x}, 0.1, 0.25, 2.12, 2.31, 0.0], v=0.1)' for x in way]
    start = '  movej([-0.2, -1.39, 1.95, -2.13, -1.57, 0.08])'
    (tmp_path / 'out.script').write_text('\n'.join(['def seam():', start, *moves, 'end', '']))
    off, step = 8e-4, 1e-3
    pan = 'joint: shoulder_pan_joint'
    (tmp_path / 'found.yaml').write_text(
        f'- {{effect: joint_offset, {pan}, offset: {off}}}\n'
        f'- {{effect: quantization, {pan}, step: {step}}}\n'
    )
    asked = words(tmp_path / 'out.script', 'ur5', tmp_path / 'out', tmp_path / 'found.yaml')
    done(*asked, '--max-correction', '5mm', '1deg')
    expected = json.loads((tmp_path / 'out' / 'correction.json').read_text())['expected']
    before, after = (expected[when]['rms_m'] for when in ('before', 'after'))
    along = np.linspace(0.4, 0.7, 3001)
    reach = np.sqrt((along**2 + 0.1**2).mean())
    # Rounding errors are spread evenly over a step, and here over a hundred and fifty of them.
    assert abs(before / (reach * np.hypot(off, step / np.sqrt(12.0))) - 1.0) < 0.15
    assert abs(after / (reach * step / np.sqrt(12.0)) - 1.0) < 0.3


@pytest.mark.parametrize('degrees', ['295', '-300', 'nan'])
def test_a_temperature_in_kelvin_and_one_that_is_none_are_refused(degrees, tmp_path):
    said = corrected(tmp_path, SEAM, '--temperature', degrees)
    assert said.code == 2 and 'the temperature is' in said.err


def test_a_tool_in_metres_is_refused_and_one_that_no_move_names_is_told(tmp_path):
    text, how = (MADE / 'bracket.ls').read_text(), {'name': 'p.ls', 'robot': 'fanuc_m10ia'}
    said = corrected(tmp_path, text, '--tool', '1=0,0,0.25,0,0,0', **how)
    assert said.code == 2 and 'is 0.25 mm long' in said.err
    said = corrected(tmp_path, SEAM, '--tool', 'torch=0,0,0.25,0,0,0')
    assert said.code == 0, said.err
    assert "no move names the tool 'torch' that was given" in said.out
    said = corrected(tmp_path, text, '--tool', '1=0,0,250,0,0,0', '--force', **how)
    assert said.code == 0 and 'no move names' not in said.out


def test_two_tools_that_the_program_only_names_are_not_both_that_of_the_robot_file(tmp_path):
    robot = tmp_path / 'torch.yaml'
    write_robot_yaml(robot, wt.load('fanuc_m10ia').with_frames(tool=along(2, 0.25)))
    text = (MADE / 'bracket.ls').read_text()
    other = text.replace('UT : 1', 'UT : 2', 1)
    (tmp_path / 'off.yaml').write_text('- {effect: joint_offset, joint: joint_2, offset: 8e-4}\n')
    for each, more, said_of in (
        (text, (), 'the tool of the robot file was taken'),
        (other, (), 'numbers of tools 1, 2 are not in the program'),
        (other, ('--tool', '2=0,0,90,0,0,0'), 'the tool of the robot file was taken'),
        (other, ('--tool', '1=0,0,250,0,0,0'), 'the tool of the robot file is tool 1'),
    ):
        (tmp_path / 'p.ls').write_text(each)
        asked = words(tmp_path / 'p.ls', robot, tmp_path / 'out', tmp_path / 'off.yaml')
        said = weld_twin(*asked, '--force', *more)
        assert said_of in said.out + said.err


def test_that_the_program_sets_no_tool_and_which_was_taken_is_said(tmp_path):
    for head, said_of in (('', True), ('  set_tcp(p[0, 0, 0.25, 0, 0, 0])\n', False)):
        said = corrected(tmp_path, SEAM.replace(':\n', f':\n{head}', 1), '--force')
        assert said.code == 0 and ('the program sets no tool' in said.out) == said_of


def test_a_seam_beyond_the_cap_is_left_whole(tmp_path):
    said = corrected(tmp_path, SEAM, '--max-correction', '0.2mm', '1deg', offset=5e-4)
    assert said.code == 0, said.err
    assert 'would move by' in said.out and 'line 2' in said.out
    lines = (tmp_path / 'out' / 'seam.script').read_text().splitlines()
    assert lines[:4] == SEAM.splitlines()[:4]


def test_nothing_within_the_cap_is_an_error_that_says_so(tmp_path):
    said = corrected(tmp_path, SEAM, '--max-correction', '0.01mm', '1deg')
    assert said.code == 2 and 'nothing in' in said.err and 'line 2' in said.err
    assert not (tmp_path / 'out').exists()


@pytest.mark.parametrize(
    'line',
    [
        '  movel(pose_add(get_actual_tcp_pose(), next_shift))',
        '  movel(pose_add(get_actual_tcp_pose(), p[0, 0, 0.05, 0, 0, 0.1]))',
        '  clean()  movel(pose_trans(get_actual_tcp_pose(), p[0, 0, 0.05, 0, 0, 0]))',
        '  movel(next_point)',
        '  speedl([0.1, 0, 0, 0, 0, 0], 0.5, 1)',
    ],
)
def test_a_seam_with_a_move_that_is_worked_out_is_left_whole(line, tmp_path):
    rows = SEAM.splitlines()
    text = '\n'.join([*rows[:3], line, *rows[3:], ''])
    said = corrected(tmp_path, text)
    assert said.code == 0, said.err
    assert 'left as it was' in said.out and 'line 4' in said.out
    assert (tmp_path / 'out' / 'seam.script').read_text().splitlines()[:5] == text.splitlines()[:5]


def test_a_weld_of_increments_is_written_in_full_and_goes_where_it_meant(tmp_path):
    name, _, reader, near = CELLS['krl']
    robot = wt.load(name)
    tool = tool_of(robot, 'krl')
    first = tool_pose(robot, np.radians(near), tool) @ along(2, 0.02)
    turned = Rotation.from_matrix(first[:3, :3]).as_euler('ZYX', degrees=True)
    values = zip('XYZABC', [*first[:3, 3] * 1e3, *turned], strict=True)
    axes = ','.join(f'A{k + 1} {value}' for k, value in enumerate(near))
    lines = [
        'DEF seam( )',
        '$BASE = $NULLFRAME',
        '$TOOL = {X 0,Y 0,Z 250,A 0,B 0,C 0}',
        f'PTP {{{axes}}}',
        f'LIN {{{",".join(f"{key} {value:.6f}" for key, value in values)}}}',
        'LIN_REL {Y 150} C_DIS ; weld',
        'LIN_REL {Z -50.0} #TOOL ; away',
        'END',
    ]
    model, path = tmp_path / 'found.yaml', tmp_path / 'seam.src'
    model.write_text(effects(robot))
    path.write_text('\n'.join(lines))
    assert 'seam.src line 6' in done(*words(path, name, tmp_path / 'out', model))
    (text,) = texts(tmp_path / 'out', ['seam.src'])
    assert ' C_DIS ; weld ; was LIN_REL {Y 150}\n' in text
    assert ' ; away ; was LIN_REL {Z -50.0} #TOOL\n' in text
    weld = first.copy()
    weld[1, 3] += 0.15
    goals = [first, weld, weld @ along(2, -0.05)]
    real = driven(robot, tool, reader([text]), near)[1:]
    assert max(np.abs(g - r)[:3].max() for g, r in zip(goals, real, strict=True)) < 4e-6


@pytest.mark.parametrize(
    'away',
    [
        'pose_trans(there, p[0, 0, -0.05, 0, 0, 0])',
        'pose_trans(get_target_tcp_pose(), p[0, 0, -0.05, 0, 0, 0])',
        'pose_add(get_actual_tcp_pose(), p[0, 0, 0.05, 0, 0, 0])',
    ],
)
def test_a_weld_is_corrected_as_ever_where_the_way_out_counts_from_its_end(away, tmp_path):
    rows = SEAM.splitlines()
    there = f'  there = {rows[3][8 : rows[3].index("]") + 1]}'
    rows[3] = '  movel(there, v=0.1)'
    rows.insert(1, there)
    (tmp_path / 'plain').mkdir()
    assert corrected(tmp_path / 'plain', '\n'.join([*rows, ''])).code == 0
    rows[5:5] = ['  set_digital_out(1, False)', '  sleep(0.5)', f'  movel({away})']
    assert 'left as it was' not in corrected(tmp_path, '\n'.join([*rows, ''])).out
    told = [
        (folder / 'out' / 'seam.script').read_text().splitlines()
        for folder in (tmp_path / 'plain', tmp_path)
    ]
    assert told[1][5:8] == rows[5:8] and told[1][1] != there
    numbers = [np.array(readers.re.findall(readers.NUMBER, row[1]), float) for row in told]
    np.testing.assert_allclose(numbers[0], numbers[1], atol=2e-7)


FANUC_TURN = """/PROG  P
/MN
   1:  J P[1] 20% FINE    ;
   2:  J P[2] 20% FINE    ;
/POS
P[1]{{
   GP1:
	UF : 0, UT : 1,
	J1= {q[0]} deg, J2= {q[1]} deg, J3= -10.0 deg, J4= {q[3]} deg, J5= {q[4]} deg, J6= {q[5]} deg
}};
P[2]{{
   GP1:
	UF : 0, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X = {0} mm, Y = {1} mm, Z = {2} mm,
	W = {3} deg, P = {4} deg, R = {5} deg
}};
/END
"""
KUKA_TURN = """DEF P()
$TOOL=$NULLFRAME
$BASE=$NULLFRAME
PTP {{A1 8, A2 -85, A3 100, A4 5, A5 {q[4]}, A6 {q[5]}}}
PTP {{X {0}, Y {1}, Z {2}, A {5}, B {4}, C {3}, S 2, T {turn}}}
END
"""

ABB_TURN = """MODULE P
PROC main()
ConfJ\\On;
MoveAbsJ [{q},[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;
MoveJ [[{0},{1},{2}],{quat},[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;
ENDPROC
ENDMODULE
"""
INFORM_TURN = """/JOB
//NAME P
//POS
///TOOL 1
///POSTYPE PULSE
C00000=8000,15000,5000,{q[3]}E3,-75000,3000
///POSTYPE ROBOT
C00001={0},{1},{2},{3},{4},{5}
//INST
NOP
MOVJ C00000 VJ=10.00
MOVJ C00001 VJ=10.00
END
"""
TURNS = {'/PRO': '.ls', 'DEF ': '.src', 'MODU': '.mod', '/JOB': '.jbi'}


@pytest.mark.parametrize(
    ('robot', 'text', 'axis', 'angle', 'turn', 'left'),
    [
        ('kuka_kr16_2', KUKA_TURN, 6, 0.02, 2, True),
        ('kuka_kr16_2', KUKA_TURN, 6, -0.02, 34, False),
        ('kuka_kr16_2', KUKA_TURN, 6, 0.0, 34, False),
        ('kuka_kr16_2', KUKA_TURN, 6, 0.0, 2, True),
        ('kuka_kr16_2', KUKA_TURN, 6, 3.0, 2, False),
        ('fanuc_m10ia', FANUC_TURN, 6, -179.98, 0, True),
        ('fanuc_m10ia', FANUC_TURN, 6, -179.9, 0, False),
        ('fanuc_m10ia', FANUC_TURN, 5, 0.02, 0, True),
        ('fanuc_m10ia', FANUC_TURN, 5, 3.0, 0, False),
        ('abb_irb1600', ABB_TURN, 5, 0.02, 0, True),
        ('abb_irb1600', ABB_TURN.replace('On', 'Off'), 5, 0.02, 0, False),
        ('yaskawa_ma1440', INFORM_TURN, 4, 90.02, 0, True),
        ('yaskawa_ma1440', INFORM_TURN, 4, 95.0, 0, False),
    ],
)
def test_an_axis_that_would_pass_where_a_flag_changes_is_left(
    robot, text, axis, angle, turn, left, tmp_path
):
    # The axis stands off by 0.057 degrees, and is to be commanded that much lower.
    arm, name = wt.load(robot), f'p{TURNS[text[:4]]}'
    near = [8, -85, 100, 5, 70, 3] if robot == 'kuka_kr16_2' else [8, 15, 5, 4, -75, 3]
    near[axis - 1] = angle
    where = tool_pose(arm, np.radians(near), arm.T_flange_tool)
    height = 0.45 if name in ('p.ls', 'p.jbi') else 0.0
    x, y, z, w = Rotation.from_matrix(where[:3, :3]).as_quat().tolist()
    turned = Rotation.from_matrix(where[:3, :3]).as_euler('xyz', degrees=True)
    place = [*(where[:3, 3] - [0.0, 0.0, height]) * 1e3, *turned]
    (tmp_path / name).write_text(
        text.format(*(f'{value:.4f}' for value in place), q=near, turn=turn, quat=[w, x, y, z])
    )
    off = f'- {{effect: joint_offset, joint: {arm.joint_names[axis - 1]}, offset: 1e-3}}'
    (tmp_path / 'off.yaml').write_text(off)
    more = ['--tool', '1=0,0,0,0,0,0'] if height else []
    more += ['--pulses-per-degree', ','.join(['1000'] * 6)] if name == 'p.jbi' else []
    asked = words(tmp_path / name, robot, tmp_path / 'out', tmp_path / 'off.yaml')
    said = done(*asked, *more)
    assert (f'axis {axis} would pass an angle at which the flags' in said) == left, said


def test_the_start_is_given_as_the_pendant_shows_it(tmp_path):
    # FANUC counts J3 from the ground: with J2 at 15 degrees, 260 is beyond the 264 of the joint.
    text = (MADE / 'bracket.ls').read_text().replace('   4:J P[1:home] 20% FINE    ;\n', '')
    more = ('--tool', '1=0,0,250,0,0,0', '--start')
    how = {'name': 'p.ls', 'robot': 'fanuc_m10ia'}
    said = corrected(tmp_path, text, *more, '8,15,260,4,-75,-6', **how)
    assert said.code == 2 and "'joint_3' is at 4.79966" in said.err
    said = corrected(tmp_path, text, *more, '8,15,-10,4,-75,-6', **how)
    assert said.code == 0, said.err


def test_a_point_that_the_program_changes_itself_is_left(tmp_path):
    text = SEAM.replace('def seam():', 'def seam():\n  P = p[-0.52, -0.20, 0.25, 2.12, 2.31, 0.0]')
    text = text.replace('movel(p[-0.52, -0.20, 0.25, 2.12, 2.31, 0.0]', 'P[2] = 0.3\n  movel(P')
    said = corrected(tmp_path, text)
    assert 'P is used at seam.script line 4' in said.out


def test_a_point_of_a_seam_that_is_left_is_not_moved_for_another(tmp_path):
    # The first seam runs with a tool that nobody knows, and shares a point with the second.
    rows = SEAM.splitlines()
    named = rows[2].replace('movel(p', 'P = p').replace(', v=0.1)', '')
    shared = rows[1], '  movel(P, v=0.1)', rows[3]
    known = '  set_tcp(p[0, 0, 0, 0, 0, 0])'
    lines = [rows[0], named, '  set_tcp(Torch)', *shared, known, *shared, *rows[1:], '']
    said = corrected(tmp_path, '\n'.join(lines))
    assert said.code == 0, said.err
    assert 'belongs to one that is left' in said.out and 'tool Torch' in said.out
    out = (tmp_path / 'out' / 'seam.script').read_text().splitlines()
    assert out[:10] == lines[:10] and out[10:13] != lines[10:13]


def test_the_model_of_another_robot_and_of_unsound_data_is_refused(tmp_path):
    (tmp_path / 'seam.script').write_text(SEAM)
    content = {'schema': 'weld_twin/diagnosis/1', 'model': {'robot': 'ur10', 'kinematics': 'x'}}
    unsound = {'schema': 'weld_twin/diagnosis/1', 'unsound': [{'sentence': 'joints are swapped'}]}
    model = tmp_path / 'diagnosis.json'
    for data, told in ((content, "of the robot 'ur10'"), (unsound, 'were unsound: joints are')):
        model.write_text(json.dumps(data))
        assert told in refused(*words(tmp_path / 'seam.script', 'ur5', tmp_path / 'out', model))


def a_line_on_which_a_joint_turns_around(tmp_path, found):
    """Correct a line past the robot's front, shoulder and elbow there and back, by a model."""
    robot, tool = wt.load('ur5'), np.array(wt.load('ur5').T_flange_tool)
    q = np.array([0.0, -1.39, 1.65, -1.83, -1.57, 0.08])
    front = tool_pose(robot, q, tool)
    along = np.array([-front[1, 3], front[0, 3], 0.0]) / np.hypot(*front[:2, 3])
    turn = readers.Rotation.from_matrix(front[:3, :3]).as_rotvec()
    lines = [[*(front[:3, 3] + way * along), *turn] for way in (-0.01, 0.3)]
    front[:3, 3] -= 0.045 * along
    places = [', '.join(f'{v:.7f}' for v in [*joints_for(robot, front, tool, q)])]
    places += [', '.join(f'{v:.7f}' for v in line) for line in lines]
    text = f'def seam():\n  movej([{places[0]}])\n  movel(p[{places[1]}], v=0.02)\n'
    text += f'  movel(p[{places[2]}], v=0.02)\nend\n'
    (tmp_path / 'seam.script').write_text(text)
    model = tmp_path / 'found.yaml'
    model.write_text(yaml.safe_dump(found))
    said = weld_twin(*words(tmp_path / 'seam.script', 'ur5', tmp_path / 'out', model))
    reach = np.hypot(*front[:2, 3])
    return said, [reach, *(np.hypot(line[0], line[1]) for line in lines)]


PLAY = {'effect': 'backlash', 'joint': 'shoulder_lift_joint', 'width': 6e-4}
ZERO = {'effect': 'joint_offset', 'joint': 'shoulder_pan_joint', 'offset': 3e-4}


def test_a_seam_is_left_where_play_turns_around_between_its_points(tmp_path):
    said, _ = a_line_on_which_a_joint_turns_around(tmp_path, [PLAY])
    assert said.code == 2 and 'too little is gained' in said.err
    assert not (tmp_path / 'out').exists()


@pytest.mark.parametrize(
    ('found', 'note', 'turned'), [([ZERO, PLAY], 'without play', 3e-4), ([], 'no point was', 0.0)]
)
def test_what_play_spoils_is_corrected_without_it_and_what_errs_in_nothing_stays(
    found, note, turned, tmp_path
):
    said, reaches = a_line_on_which_a_joint_turns_around(tmp_path, found)
    assert said.code == 0, said.err
    told = json.loads((tmp_path / 'out' / 'correction.json').read_text())
    assert any(note in each for each in told['notes'])
    # The play of 6e-4 would have moved them by another 0.15 mm up and down.
    moved = [move['moved_m'] for move in told['moves']]
    assert moved == pytest.approx([turned * reach for reach in reaches], rel=0.01, abs=1e-6)


def test_a_correction_finer_than_the_language_writes_is_none(tmp_path):
    found = [{'effect': 'joint_offset', 'joint': 'joint_2_l', 'offset': 4e-6}]
    model = tmp_path / 'found.yaml'
    model.write_text(yaml.safe_dump(found))
    asked = words(MADE / 'bracket.jbi', 'yaskawa_ma1440', tmp_path / 'out', model)
    said = refused(*asked, *OPTIONS['inform'])
    assert 'too little is gained' in said


def test_slips_are_told_of_a_file_by_hand_and_not_of_what_a_diagnosis_leaves_open(
    elbow_found, tmp_path
):
    def told(model):
        return weld_twin(*words(MADE / 'bracket.script', 'ur5', tmp_path / 'out', model)).err

    assert 'below zero' not in told(Path(elbow_found) / 'diagnosis.json')
    spring = '- {effect: joint_compliance, joint: elbow_joint, compliance: -1.0e-6}\n'
    (tmp_path / 'by_hand.yaml').write_text(2 * spring)
    said = told(tmp_path / 'by_hand.yaml')
    assert 'below zero' in said and 'is there 2 times' in said


def test_a_program_for_the_arm_of_a_later_recording_is_corrected_by_what_changed(tmp_path):
    robot, frame, file = wt.load('ur5'), np.eye(4).tolist(), tmp_path / 'diagnosis.json'
    slipped = {'effect': 'joint_offset', 'joint': 'elbow_joint'}
    content = {
        'schema': 'weld_twin/diagnosis/2',
        'model': {'tool': frame, 'bases': [frame, frame], 'found': []},
        'changed': [{**slipped, 'recording': 1, 'value': 5e-4, 'std': 1e-5}],
    }
    file.write_text(json.dumps(content))
    assert correcting.program_model(robot, file).effects == ()
    (own,) = correcting.program_model(robot, file, setup=1).effects
    assert own.to_mapping() == {**slipped, 'offset': 5e-4}


def test_a_torch_that_was_hit_is_told_as_left_out_of_a_program_with_another_tool(tmp_path):
    """Its tool was fitted, so that no program has it to the digit; the hit was told as a cause."""
    robot, rng, t = wt.load('ur5'), np.random.default_rng(5), 10.0 * np.arange(40.0)
    q = np.array([0.0, -1.4, 1.5, -1.5, -1.4, 0.3]) + rng.uniform(-0.7, 0.7, (40, 6))
    tip = np.eye(4)
    tip[:3, 3] = 0.03, 0.0, 0.15
    torch = robot.with_frames(tool=tip)
    hit = wt.effects.ToolSlip(xyz=(1.2e-3, -8e-4, 5e-4), time=195.0)
    stations = wt.Recording('stations', wt.JointMotion(t, q, static=True))
    seen = wt.Twin(torch, [hit]).poses(stations).position + rng.normal(scale=3e-5, size=(40, 3))
    head = ','.join(['time', *robot.joint_names, 'x [m]', 'y [m]', 'z [m]'])
    rows = [','.join(f'{v:.8f}' for v in row) for row in np.column_stack([t, q, seen])]
    (tmp_path / 'cell.csv').write_text('\n'.join([head, *rows]))
    asked = ('--robot', 'ur5', '--align', 'base,tool', '--angle-unit', 'rad')
    done('diagnose', tmp_path / 'cell.csv', *asked, '--out', tmp_path / 'found')
    program = tmp_path / 'seam.script'
    moves = [f'  movej([{", ".join(f"{v:.5f}" for v in row)}])' for row in q[:3]]
    head = ['def seam():', '  set_tcp(p[0.03,0,0.15,0,0,0])']
    program.write_text('\n'.join([*head, *moves, 'end', '']))
    out, model = tmp_path / 'out', tmp_path / 'found' / 'diagnosis.json'
    weld_twin('correct', program, '--robot', 'ur5', '--model', model, '--out', out)
    notes = json.loads((out / 'correction.json').read_text())['notes']
    assert any('what was found of the tool was left out' in note for note in notes)
