# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the readers of programs make of numbers, of rarer forms, and of broken texts."""

import random
import re
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

import weld_twin_core as wt
from weld_twin_core.arm.rotation import transform
from weld_twin_core.errors import TwinError
from weld_twin_msgs_py.programs import (
    Context,
    check_written,
    controller_of,
    read_sources,
    rewritten,
    to_moves,
)
from weld_twin_msgs_py.programs.build import quadrants
from weld_twin_msgs_py.programs.source import (
    ABB_POSE,
    FANUC_POSE,
    KUKA_POSE,
    NUMBER,
    UR_POSE,
    YASKAWA_POSE,
    Source,
)

MADE = Path(__file__).parent / 'made'
PROGRAMS = {
    'krl': ('kuka_kr16_2', ('bracket.src', 'bracket.dat')),
    'rapid': ('abb_irb1600', ('bracket.mod',)),
    'urscript': ('ur5', ('bracket.script',)),
    'inform': ('yaskawa_ma1440', ('bracket.jbi',)),
    'fanuc-ls': ('fanuc_m10ia', ('bracket.ls',)),
    'joint-trajectory': ('ur5', ('bracket.yaml',)),
    'csv': ('ur5', ('bracket.csv',)),
}
FUZZED = 50
"""Broken texts a language."""


def context(robot, language):
    pulses = np.array([1000.0, -1200.0, 1100.0, 900.0, -800.0, 700.0])
    return Context(wt.load(robot), controller_of(wt.load(robot), language), pulses)


def read(language, texts, robot=None):
    robot = robot or PROGRAMS[language][0]
    sources = [Source(f'file{k}', text) for k, text in enumerate(texts)]
    return read_sources(sources, context(robot, language), language)


def moves_of(language, *texts):
    """Return the moves of a program, piece after piece."""
    robot = PROGRAMS[language][0]
    own = context(robot, language)
    pieces = to_moves(read(language, texts), own.robot, own.controller).pieces
    return [move for piece in pieces for move in piece]


def bracket(language):
    """Return the texts of the bracket's program."""
    return [(MADE / name).read_bytes().decode('latin-1') for name in PROGRAMS[language][1]]


def bracket_with(language, lines):
    """Return these texts with more lines where the seam begins."""
    source, *beside = bracket(language)
    text = source.replace(BEFORE[language], lines + BEFORE[language], 1)
    assert text != source
    return [text, *beside]


def table(text):
    """
    Return the rows of a table, a tuple of its columns each.

    A column with a slash is lines of a program of the first column's language, where a word with @
    stands for what `WORDS` has.
    """
    rows = [[part.strip() for part in f'{row} '.split(' | ')] for row in text.strip().splitlines()]
    return [tuple(row) for row in rows]


def lines_of(language, text):
    """Return lines that are parted by slashes in a table, with `WORDS` in place of their names."""
    words = WORDS[language]
    text = re.sub(r'@(\w+)', lambda match: words.get(match[1], match[0]), text)
    return text.split(' / ')


def yes(text):
    """Return which words of a text are yes."""
    return [word == 'yes' for word in text.split()]


# Expected with scipy: capital letters turn about axes that turn along, small ones about fixed axes.
@pytest.mark.parametrize(
    ('notation', 'numbers', 'turn'),
    [
        (KUKA_POSE, (30.0, 20.0, 10.0), Rotation.from_euler('ZYX', [30, 20, 10], degrees=True)),
        (FANUC_POSE, (10.0, 20.0, 30.0), Rotation.from_euler('xyz', [10, 20, 30], degrees=True)),
        (YASKAWA_POSE, (10.0, 20.0, 30.0), Rotation.from_euler('xyz', [10, 20, 30], degrees=True)),
        (ABB_POSE, (0.5, 0.5, 0.5, 0.5), Rotation.from_rotvec(np.full(3, 2 * np.pi / 27**0.5))),
        (UR_POSE, (0.0, 0.0, 0.5), Rotation.from_euler('z', 0.5)),
    ],
)
def test_orientations_are_written_as_each_maker_does(notation, numbers, turn):
    pose = notation.value((1000.0, 0.0, 0.0, *numbers))
    np.testing.assert_allclose(pose[:3, :3], turn.as_matrix(), atol=1e-12)
    assert pose[0, 3] == (1000.0 if notation is UR_POSE else 1.0)


@pytest.mark.parametrize('notation', [KUKA_POSE, FANUC_POSE, UR_POSE, ABB_POSE])
@given(
    vector=arrays(float, 3, elements=st.floats(-3.1, 3.1)), far=st.sampled_from([0.0, 1e-9, 1e-4])
)
@settings(max_examples=15, deadline=None)
def test_a_pose_is_written_next_to_the_numbers_it_replaces(notation, vector, far):
    turn = Rotation.from_rotvec(vector)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn.as_matrix(), [0.5, -0.25, 1.0]
    first = notation.numbers(pose, [0.0] * 7)
    moved = pose.copy()
    moved[:3, :3] = Rotation.from_rotvec([far, 0.0, 0.0]).as_matrix() @ pose[:3, :3]
    again = notation.numbers(moved, first)
    np.testing.assert_allclose(notation.value(again), moved, atol=1e-9)
    same = notation.numbers(pose, first)
    np.testing.assert_allclose(same, first, atol=1e-5)


@pytest.mark.parametrize('pitch', [90.0, -90.0])
@pytest.mark.parametrize(('notation', 'about_z'), [(KUKA_POSE, 3), (FANUC_POSE, 5)])
def test_where_two_angles_turn_about_one_axis_that_about_z_stays_as_it_was(
    notation, about_z, pitch
):
    old = [1.0, 2.0, 3.0, 20.0, pitch, -40.0]
    pose = notation.value(old)
    np.testing.assert_allclose(notation.numbers(pose, old), old, atol=1e-6)
    old[about_z] += 5.0
    again = notation.numbers(pose, old)
    assert again[about_z] == old[about_z]
    np.testing.assert_allclose(notation.value(again), pose, atol=1e-9)


@pytest.mark.parametrize('turns', [0, 1, -2])
@pytest.mark.parametrize('off', [0.3, -0.3])
def test_a_rotation_vector_of_more_than_a_turn_stays_next_to_the_old_one(turns, off):
    axis, angle = np.array([0.6, 0.0, 0.8]), 3.0 + 2.0 * np.pi * turns
    pose = UR_POSE.value([0.0, 0.0, 0.0, *(angle * axis)])
    found = UR_POSE.numbers(pose, [0.0, 0.0, 0.0, *((angle + off) * axis)])
    np.testing.assert_allclose(found[3:], angle * axis, atol=1e-9)


def test_both_euler_triples_of_one_turn_are_left_as_the_program_wrote_them():
    one, other = [0.0] * 3 + [170.0, 100.0, -20.0], [0.0] * 3 + [-10.0, 80.0, 160.0]
    np.testing.assert_allclose(KUKA_POSE.value(one), KUKA_POSE.value(other), atol=1e-12)
    for written in (one, other):
        np.testing.assert_allclose(
            KUKA_POSE.numbers(KUKA_POSE.value(written), written), written, atol=1e-9
        )


def test_frames_of_a_taught_kuka_point_come_from_its_data():
    src = 'DEF a()\nFDAT_ACT=FP1\nPTP XP1\nFDAT_ACT=FP2\nLIN XP2\nEND\n'
    dat = (
        'DEFDAT A\nDECL E6POS XP1={X 1,Y 2,Z 3,A 0,B 0,C 0,S 2,T 2}\n'
        'DECL E6POS XP2={X 1,Y 2,Z 3,A 0,B 0,C 0,S 2,T 2}\n'
        'DECL FDAT FP1={TOOL_NO 2,BASE_NO 0,IPO_FRAME #BASE}\n'
        'DECL FDAT FP2={TOOL_NO 2,BASE_NO 3,IPO_FRAME #BASE}\n'
        'BASE_DATA[3]={X 100.0,Y 0.0,Z 0.0,A 90.0,B 0.0,C 0.0}\nENDDAT\n'
    )
    program = read('krl', (src, dat))
    first, second = program.steps
    assert (first.tool.name, first.tool.value) == ('2', None)
    np.testing.assert_allclose(first.base.value, np.eye(4))
    np.testing.assert_allclose(second.base.value[:3, 3], [0.1, 0.0, 0.0])
    np.testing.assert_allclose(second.base.value[:3, 0], [0.0, 1.0, 0.0], atol=1e-12)


def test_a_spline_move_of_kuka_brings_its_own_tool_base_and_speed():
    point = 'DECL E6POS XP1={X 1,Y 2,Z 3,A 0,B 0,C 0}\n'
    data = 'DECL FDAT FP1={TOOL_NO 4,BASE_NO 2,IPO_FRAME #BASE}\n'
    move = (
        'SLIN XP1 WITH $VEL=SVEL_CP(0.25, , LCPDAT1), $TOOL=STOOL2(FP1), $BASE=SBASE(FP1.BASE_NO),'
        '$IPO_MODE=SIPO_MODE(FP1.IPO_FRAME), $LOAD=SLOAD(FP1.TOOL_NO), $APO=SAPO(LCPDAT1) C_SPL\n'
    )
    text = 'DEF a()\n' + point + data + move + 'SLIN XP1 WITH $TOOL={X 1}\nEND\n'
    step, other = read('krl', (text,)).steps
    assert (step.tool.name, step.base.name, step.speed, step.stop) == ('4', '2', 0.25, False)
    assert 'tool or base' in other.tool.why


def test_the_moves_of_a_spline_have_its_tool_and_base_where_they_bring_none():
    point = 'DECL E6POS XP1={X 1,Y 2,Z 3,A 0,B 0,C 0}\n'
    data = 'DECL FDAT FP{0}={{TOOL_NO {0},BASE_NO {0},IPO_FRAME #BASE}}\n'
    own = ' WITH $TOOL=STOOL2(FP{0}), $BASE=SBASE(FP{0}.BASE_NO)\n'
    block = f'SPLINE{own.format(4)}SLIN XP1\nSLIN XP1{own.format(5)}ENDSPLINE\nSLIN XP1\n'
    text = f'DEF a()\n{point}{data.format(4)}{data.format(5)}{KRL["long"]}\n{block}END\n'
    steps = read('krl', (text,)).steps
    assert [step.tool.name for step in steps[:2]] == [step.base.name for step in steps[:2]]
    assert [step.tool.name for step in steps[:2]] == ['4', '5']
    assert steps[2].tool.value[2, 3] == 0.25


def test_an_abb_move_that_switches_an_output_has_its_tool_before_it():
    frame = 'PERS wobjdata w:=[FALSE,TRUE,"",[[500,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n'
    moves = (
        f'MoveLDO {POINT}, v9, fine, tool0\\WObj:=w, doArc, 1;\n'
        f'MoveCSync {POINT}, {POINT}, v9, z1, tool0\\WObj:=w, "stir";\n'
    )
    text = f'MODULE m\n{frame}PROC main()\n{moves}ENDPROC\nENDMODULE\n'
    steps = read('rapid', (text,)).steps
    assert [step.stop for step in steps] == [True, False]
    assert all(step.base.value[0, 3] == 0.5 and step.tool.value is not None for step in steps)


@pytest.mark.parametrize(
    ('speed', 'told'), [('[18.30, 50,50,50]', 0.0183), ('v200', 0.2), ('[1.5E2,500,0,0]', 0.15)]
)
def test_an_abb_move_is_as_fast_as_its_line_says(speed, told):
    text = f'MODULE m\nPROC main()\nMoveL {POINT}, {speed}, fine, tool0;\nENDPROC\nENDMODULE\n'
    (step,) = read('rapid', (text,)).steps
    assert abs(step.speed - told) < 1e-9


@pytest.mark.parametrize(
    'line',
    [
        'LIN_REL {X 5}',
        'PTP_REL {A1 5}',
        'LIN {X 5,Y 1}',
        'LIN XP1:XP2',
        'SPL XP1',
        'PTP HOME',
        'CIRC XP1,XP2,CA 90',
        'LIN XP1 : XP2',
        'LIN XP1 : {Z 5}',
    ],
)
def test_kuka_moves_that_are_not_understood_say_so(line):
    point = 'DECL E6POS {}={{X 1,Y 2,Z 3,A 0,B 0,C 0}}\n'
    text = 'DEF a()\n' + point.format('XP1') + point.format('XP2') + f'{line}\nEND\n'
    (step,) = read('krl', (text,)).steps
    assert step.end is None and step.why


@pytest.mark.parametrize(
    ('between', 'move', 'why'),
    [
        ('$OUT[5]=TRUE\nWAIT SEC 0.4\n$VEL.CP=0.01\n', 'LIN_REL {X 5, A 0}', ''),
        ('', 'SLIN_REL {X -5} C_DIS #BASE', ''),
        ('', 'LIN_REL {A 5}', 'turns the tool'),
        ('', 'LIN_REL {X 5, E1 10}', 'external axes'),
        ('', 'LIN_REL XP1', 'worked out'),
        ('$BASE = {X 1,Y 2,Z 3,A 0,B 0,C 0}\n', 'LIN_REL {X 5}', 'in this tool and base'),
        ('PTP {A1 0,A2 -90,A3 90,A4 0,A5 5,A6 0}\n', 'LIN_REL {X 5}', 'in this tool and base'),
        ('IF $IN[1] THEN\n', 'LIN_REL {X 5}', 'from elsewhere'),
        ('LOOP\n', 'LIN_REL {X 5}', 'from elsewhere'),
        ('again:\n', 'LIN_REL {X 5}', 'from elsewhere'),
        ('clean()\n', 'LIN_REL {X 5}', 'from elsewhere'),
        ('LIN XP2\n', 'LIN_REL {X 5}', 'from elsewhere'),
        ('END\nDEF b()\n', 'LIN_REL {X 5}', 'from elsewhere'),
    ],
)
def test_a_kuka_move_counts_from_the_point_before_where_nothing_else_leads_there(
    between, move, why
):
    lines = f'LIN {{X 1,Y 2,Z 3,A 0,B 0,C 0}}\n{between}{move}\n'
    last = read('krl', (f'DEF a()\n$TOOL=$NULLFRAME\n$BASE=$NULLFRAME\n{lines}END\n',)).steps[-1]
    assert (why in last.why) if why else (last.end is not None and not last.why)


@pytest.mark.parametrize(
    ('move', 'moved'),
    [
        ('XP1 : {X 10,Y 0,Z 0,A 0,B 0,C 0}', [0.001, 0.012, 0.003]),
        ('XP1:{X 0,Y 10,Z 5,A 5,B 0,C 0} C_DIS', [-0.009, 0.002, 0.008]),
    ],
)
def test_kuka_places_beside_a_point_go_along_with_it(move, moved):
    text = f'DEF a()\nDECL E6POS XP1={{X 1,Y 2,Z 3,A 90,B 0,C 0}}\nLIN XP1\nLIN {move}\nEND\n'
    program = read('krl', (text,))
    end = program.steps[-1].end
    assert not end.leads and not program.fixed
    np.testing.assert_allclose((program.points[end.point].value @ end.after)[:3, 3], moved)


BEFORE = {
    'krl': 'LIN XP2 ;',
    'rapid': '        ArcLStart pStart',
    'urscript': '    movel(Waypoint_1_p',
    'inform': 'MOVL C00001',
    'fanuc-ls': '   5:L P[2]',
}
"""Where the bracket's seam begins, in each language."""
POINT = '[[900,0,800],[0.7,0,0.714,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]'
WORDS = {
    'krl': {
        'frame': '{X 10,Y 0,Z 0,A 0,B 0,C 0}',
        'based': 'BASE_DATA[2] = {X 10,Y 0,Z 0,A 0,B 0,C 0} / $BASE = BASE_DATA[2]',
        'long': '$TOOL = {X 0,Y 0,Z 250,A 0,B 0,C 0}',
        'short': '$TOOL = {X 0,Y 0,Z 90,A 0,B 0,C 0}',
        'seam': 'LIN {X 900,Y 0,Z 800,A 0,B 90,C 0}',
        'move': 'LIN {X 1,Y 2,Z 3,A 0,B 0,C 0}',
        'said': 'LIN {X 1,Y 2,Z 3,A 0,B 0,C 0,E1 0}',
    },
    'rapid': {'move': 'MoveL p1,v100,fine,tool0;', 'on': 'PDispSet x;', 'off': 'PDispOff;'},
    'urscript': {
        'in_frame': 'movel(pose_trans(F, p[-0.5,-0.2,0.02,2.1,2.3,0]))',
        'long': 'set_tcp(p[0,0,0.25,0,0,0])',
        'short': 'set_tcp(p[0,0,0.09,0,0,0])',
        'seam': 'movel(p[0.3,0.2,0.1,0,3.1,0])',
        'home': 'movej([0,-1.4,1.6,-1.8,-1.5,0])',
        'on': 'track_conveyor_linear(p[1,0,0,0,0,0], 9)',
        'off': 'stop_conveyor_tracking()',
    },
    'fanuc-ls': {
        'move': 'L P[1] 9mm/sec FINE',
        'on': 'Touch Offset PR[1]',
        'off': 'Touch Offset End',
    },
    'inform': {'move': 'MOVL C00001 V=9.0', 'on': 'SFTON P001', 'off': 'SFTOF'},
}
"""Lines that stand in many a case, and what stands in such lines."""
KRL = WORDS['krl']
RAPID_HEAD = (
    f'MODULE m\nCONST robtarget p1 := {POINT};\n'
    'CONST robtarget p2 := [[0,0,9],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\nPROC main()\n'
)
JOB_HEAD = (
    '/JOB\n//NAME A\n//POS\n///TOOL 1\n///POSTYPE ROBOT\nC00001=900,0,300,180,0,0\n//INST\nNOP\n'
)
TP_TAIL = (
    '/POS\nP[1]{\n GP1:\n UF : 0, UT : 1,\n X = 900 mm, Y = 0 mm, Z = 300 mm,\n W = 180 deg, '
    'P = 0 deg, R = 0 deg\n};\n/END\n'
)
AROUND = {
    'rapid': (RAPID_HEAD, '{}\n', 'ENDPROC\nENDMODULE\n'),
    'fanuc-ls': ('/PROG A\n/MN\n', '   1:{} ;\n', TP_TAIL),
    'inform': (JOB_HEAD, '{}\n', 'END\n'),
    'urscript': ('def a():\n', '{}\n', 'end\n'),
    'krl': ('DEF a()\n', '{}\n', 'END\n'),
}
"""What stands before the lines of a program, how one is written, and what stands after them."""


def program_of(language, lines):
    """Return the text of a program with lines of a table."""
    head, form, tail = AROUND[language]
    return head + ''.join(form.format(line) for line in lines_of(language, lines)) + tail


SET_ON_THE_WAY = r"""
krl | $TOOL.Z = 300 | set in parts
krl | $BASE.X = 10 | set in parts
krl | @based / BASE_DATA[2].X = 5 | set anew
krl | @based / BASE_DATA[i] = F | set anew
krl | FRAME F=@frame / $BASE = F / F.X = F.X + 10 | set anew
krl | POS F=@frame / F = XP1 / $BASE = F | set anew
krl | @based / base_data[2] = F | set anew
krl | $BASE = BASE_DATA[2] / BASE_DATA[2] = @frame | set anew
krl | DECL FRAME F=@frame / measured(F) / $BASE = F | set anew
krl | $IPO_MODE = #TCP | the tool stands still
krl | DECL FDAT FX={TOOL_NO 0,BASE_NO 0,IPO_FRAME #TCP} / FDAT_ACT=FX | stands still
krl | $WORLD.Z = 100 | what bases count from
krl | $ROBROOT=@frame | what bases count from
rapid | tTorch.tframe.trans.z := 300; | set anew
rapid | wobjTable.oframe := DefFrame(p10, p20, p30); | set anew
rapid | wobjTable := wobjOther; | set anew
rapid | TTORCH := tOther; | set anew
rapid | Measured wobjTable; | set anew
rapid | GetSysData tTorch; | set anew
urscript | F = p[0,0,0.1,0,0,0] / F[2] = 0.3 / @in_frame | worked out
urscript | F = p[0,0,0.1,0,0,0] / F = pose_add(F, F) / @in_frame | worked out
urscript | T = p[0,0,0.1,0,0,0] / T[2] = 0.3 / set_tcp(T) | numbers of T are set
urscript | movej(get_inverse_kin(Waypoint_1_p, Start_q, tcp=p[0,0,1,0,0,0])) | worked out
fanuc-ls | 5:  UTOOL[1]=PR[3] ; | UTOOL 1 are set
fanuc-ls | 5:  UTOOL[R[2]]=PR[3] ; | UTOOL 1 are set
fanuc-ls | 5:  Touch Offset PR[1] ; | Touch Offset
inform | SETTOOL TL#(1) P001 | TL 1 are set
"""


@pytest.mark.parametrize(('language', 'lines', 'reason'), table(SET_ON_THE_WAY))
def test_what_a_program_sets_on_its_way_is_not_taken_for_known(language, lines, reason):
    more = ''.join(f'{line}\n' for line in lines_of(language, lines))
    moves = moves_of(language, *bracket_with(language, more))
    assert any(move.kind == 'unknown' and reason in move.why for move in moves)


def test_a_block_of_ur_that_is_not_known_ends_no_routine_before_its_end():
    inside = 'switch(a):\ncase 1:\nb()\nend\nend\n'
    text = 'def p():\nset_tcp(p[0,0,0.1,0,0,0])\n{}movel(p[0.3,0.2,0.1,0,3.1,0])\nend\n'
    with pytest.raises(TwinError, match="line 7: this 'end' closes no routine"):
        read('urscript', (text.format(inside),))
    own = 'sec s():\nset_digital_out(1, True)\nend\n'
    (step,) = read('urscript', (text.format(own),)).steps
    assert step.tool.value is not None and step.tool.value[2, 3] == 0.1


def test_a_program_that_goes_along_with_a_conveyor_is_left():
    text = (MADE / 'bracket.ls').read_text()
    for schedule, along in ((0, False), (2, True)):
        head = f'/APPL\nLINE_TRACK;\n  LINE_TRACK_SCHEDULE_NUMBER : {schedule};\n'
        steps = read('fanuc-ls', (text.replace('/APPL\n', head),)).steps
        assert {'conveyor' in step.shift.why for step in steps} == {along}


@pytest.mark.parametrize(('line', 'known'), [('t.robhold := TRUE;', False), ('x := 5;', True)])
def test_a_tool_is_known_after_a_routine_that_does_not_set_it(line, known):
    text = (MADE / 'bracket.mod').read_text().replace('ConfL', 'sub tTorch;\nConfL')
    sub = f'PROC sub(PERS tooldata t)\n{line}\nENDPROC\nENDMODULE'
    step = read('rapid', (text.replace('ENDMODULE', sub),)).steps[-1]
    assert (step.tool.why == '') == known


CALLED = """
krl | @long / sub() / END / DEF sub() / $VEL.CP = 0.1 / @seam | yes
krl | @long / sub() / @short / END / DEF sub() / $VEL.CP = 0.1 / @seam | no
urscript | def sub(): / @seam / end / @long / sub() | yes
urscript | def sub(): / @seam / end / @long / sub() / @short | no
urscript | @long / def sub(): / if (g): / set_tcp(T) / end / end / @seam | yes
"""


@pytest.mark.parametrize(('language', 'lines', 'known'), table(CALLED))
def test_a_routine_has_the_tool_of_its_program_where_that_is_one(language, lines, known):
    (move,) = moves_of(language, program_of(language, lines))
    if known == 'no':
        assert move.kind == 'unknown' and 'other routines' in move.why
    else:
        flange = context(PROGRAMS[language][0], language).controller.flange
        away = np.linalg.norm(move.tool[:3, 3] - flange[:3, 3])
        np.testing.assert_allclose(away, 0.25, atol=1e-12)


WAYS = """
krl | IF x THEN / @short / ENDIF / @seam | no
krl | IF x THEN / @long / ENDIF / @seam | yes
krl | IF x THEN / @short / @seam / ELSE / @seam / ENDIF | yes yes
krl | IF x THEN / @short / ELSE / @short / ENDIF / @seam | yes
krl | SWITCH n / CASE 1 / @short / DEFAULT / @long / ENDSWITCH / @seam | no
krl | SWITCH n / CASE 1 / @short / DEFAULT / @short / ENDSWITCH / @seam | yes
krl | LOOP / @seam / @short / @seam / ENDLOOP | no yes
krl | LOOP / @short / @seam / ENDLOOP / @long / @seam | yes yes
krl | WHILE x / @short / @seam / ENDWHILE / @seam | yes no
krl | IF x THEN / $IPO_MODE = #TCP / ENDIF / @seam | no
krl | IF x THEN / $BASE.X = 5 / ENDIF / @seam | no
krl | LOOP / @seam / $IPO_MODE = #TCP / ENDLOOP | no
urscript | if (x): / @short / end / @seam | no
urscript | if (x): / @short / else: / @short / end / @seam | yes
urscript | if (x): / @short / elif (y): / @seam / else: / @short / end / @seam | yes no
urscript | while (True): / @seam / @short / @seam / end | no yes
urscript | while (True): / @short / @seam / end | yes
krl | LOOP / @short / IF x THEN / EXIT / ENDIF / @long / ENDLOOP / @seam | no
krl | LOOP / @long / IF x THEN / EXIT / ENDIF / @seam / ENDLOOP / @seam | yes yes
urscript | while (x): / @short / if (y): / break / end / @long / end / @seam | no
urscript | while (x): / @seam / @short / if (y): / continue / end / @long / end | no
"""
"""The last four leave a loop halfway: the tool of its end is not what holds after it."""


@pytest.mark.parametrize(('language', 'ways', 'known'), table(WAYS))
def test_a_frame_that_not_every_way_sets_is_not_known_after_it(language, ways, known):
    first = '$BASE = $NULLFRAME / ' if language == 'krl' else ''
    moves = moves_of(language, program_of(language, f'{first}@long / {ways}'))
    assert [move.kind != 'unknown' for move in moves] == yes(known)


SUB = {
    'krl': 'END / DEF sub() / other() / END / DEF other() / @short',
    'urscript': 'def sub(): / @short / end',
    'rapid': 'sub; / @move / ENDPROC / PROC sub()',
}
"""A routine that sets something; where one may stand below the program, or what calls it."""
AFTER_A_CALL = f"""
krl | @long / sub() / @seam / {SUB['krl']} | other routines
krl | @long / sub() / @long / @seam / {SUB['krl']} |
krl | @short / sub() / @seam / {SUB['krl']} |
krl | @long / up: / @seam / @short / GOTO up | other routines
krl | @long / up: / @seam / GOTO up |
urscript | {SUB['urscript']} / @long / sub() / @seam | other routines
urscript | {SUB['urscript']} / @long / @seam / sub() |
rapid | {SUB['rapid']} / @on | sub, called at
rapid | {SUB['rapid']} / @on / MoveL p2,v9,fine,tool0; / @off |
"""


@pytest.mark.parametrize(('language', 'lines', 'reason'), table(AFTER_A_CALL))
def test_what_a_routine_sets_holds_after_its_call(language, lines, reason):
    move = moves_of(language, program_of(language, lines))[0]
    assert (move.kind == 'unknown') == bool(reason) and reason in move.why


RAPID_CALLS = f'{RAPID_HEAD}sub;\nMoveL p1,v100,fine,tool0;\nENDPROC\nENDMODULE\n'
RAPID_OTHER = 'MODULE n\nPROC {}()\n{}ENDPROC\nENDMODULE\n'
IN_ANOTHER_FILE = """
krl | @long / sub() / @seam | DEF sub() / other() / END / DEF other() / @short / END | no
krl | @long / sub() / @seam | DEF sub() / other() / END // DEF other() / @short / END | no
krl | @long / sub() / @seam | DEF sub() / END // DEF other() / @short / END | yes
krl | @long / sub() / @seam / END / DEF sub() | DEF sub() / @short / END | yes
rapid | sub; / @move | PROC sub() / @on / ENDPROC | no
rapid | sub; / @move | PROC x() / @on / ENDPROC | yes
rapid | sub; / MoveL p1,v9,fine,t; | PROC sub() / t.tframe.trans.z := 5; / ENDPROC | no
rapid | sub; / MoveL p1,v9,fine,t; | PROC sub() / ENDPROC | yes
fanuc-ls | CALL SUB / @move | @on | no
fanuc-ls | CALL SUB / @move | UTOOL[1]=PR[3] | no
fanuc-ls | CALL SUB / @move | @on / @off | yes
inform | CALL JOB:SUB / @move | @on | no
inform | CALL JOB:SUB / @move | SETTOOL TL#(1) P003 | no
inform | CALL JOB:SUB-2 / @move | @on | yes
"""
TORCH = 'PERS tooldata t:=[TRUE,[[0,0,9],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\n'


@pytest.mark.parametrize(('language', 'lines', 'others', 'known'), table(IN_ANOTHER_FILE))
def test_what_a_routine_of_another_file_sets_holds_after_its_call(language, lines, others, known):
    text = program_of(language, lines).replace('PROC main', f'{TORCH}PROC main')
    beside = []
    for k, other in enumerate(others.split(' // ')):
        if language in ('krl', 'rapid'):
            other = ''.join(f'{line}\n' for line in lines_of(language, other))
            other = other if language == 'krl' else f'MODULE n\n{other}ENDMODULE\n'
        else:
            other = program_of(language, other)
            other = other.replace('PROG A', 'PROG SUB').replace('NAME A', 'NAME SUB')
        beside.append(Source(f'other{k}', other))
    own = context(PROGRAMS[language][0], language)._replace(beside=tuple(beside))
    step = read_sources([Source('file', text)], own, language).steps[-1]
    assert [not (step.tool.why or step.shift.why)] == yes(known)


DISPLACED = r"""
rapid | @on / IF a THEN / @off / ENDIF / @move | no
rapid | @on / IF a @off / @move | no
rapid | @on / IF a THEN / @off / ELSE / @off / ENDIF / @move | yes
rapid | TEST n / CASE 1: / @on / DEFAULT: / ENDTEST / @move | no
rapid | WHILE a DO / @move / @on / ENDWHILE / @off / @move | no yes
rapid | FOR i FROM 1 TO 3 DO / @on / @off / @move / ENDFOR | yes
rapid | up: / @move / @on / GOTO up; | no
rapid | up: / @move / GOTO up; | yes
rapid | sub; / @on / IF a sub; / ENDPROC / PROC sub() / @move | no
rapid | @on / @off / sub; / ENDPROC / PROC sub() / @move | yes
rapid | @on / a; / ENDPROC / PROC a() / sub; / ENDPROC / PROC sub() / @move | no
rapid | CONNECT i WITH t; / @move / ENDPROC / TRAP t / @on / ENDTRAP / PROC b() | no
rapid | SoftAct 2,50; / @move / SoftDeact; / @move | no yes
rapid | MoveL p1,v100,fine,tool0\Corr; / @move | no yes
rapid | PDispOn p5, tool0; / @move / @off / @move | no yes
fanuc-ls | @on / IF (DI[1]=ON) THEN / @off / ENDIF / @move | no
fanuc-ls | @on / IF DI[1]=ON,JMP LBL[1] / @off / LBL[1] / @move | no
fanuc-ls | @on / @off / @move | yes
fanuc-ls | LBL[1:up] / @move | yes
fanuc-ls | L @P[1] 9mm/sec FINE | yes
fanuc-ls | MP Offset PR[1] RPM[1] / @move | no
fanuc-ls | Track TAST[1] / @move / Track End / @move | no yes
fanuc-ls | CALL TRACK_PART / @move / @move COORD | yes no
inform | @on / IFTHENEXP I001=1 / @off / ENDIF / @move | no
inform | @on / JUMP *A IF IN#(1)=ON / @off / *A / @move | no
inform | @on / @off / @move | yes
inform | *A / @move | yes
inform | COMARCON ASF#(1) / @move / COMARCOF / @move | no yes
urscript | @on / @home / @seam | yes no no
urscript | @on / @off / @seam | yes yes yes
urscript | path_offset_set(x, 2) / @home / @seam | yes no no
urscript | if a: / @on / end / @seam | yes no
urscript | def b(): / @on / end / b() / @seam | yes no
urscript | def b(): / @seam / end / @on / b() | no yes
urscript | def b(): / @seam / end / b() | yes
krl | RET=RSI_ON(#RELATIVE) / @move / RET=RSI_OFF() / @move | no yes
"""


@pytest.mark.parametrize(('language', 'lines', 'known'), table(DISPLACED))
def test_a_displacement_holds_wherever_one_of_the_ways_brings_it(language, lines, known):
    steps = read(language, (program_of(language, lines),)).steps
    assert [not step.shift.why for step in steps] == yes(known)


HANDED = {
    'rapid': f'{RAPID_HEAD.partition("PROC")[0]}{TORCH}PROC weld(PERS tooldata t)\n'
    'MoveL p1,v9,fine,t;\nENDPROC\nENDMODULE\n',
    'krl': 'DEF a(F:IN)\nFRAME F={frame}\n{long}\n$BASE = F\n{seam}\nEND\n',
    'urscript': 'T = p[0,0,0.1,0,0,0]\ndef sub(T):\nset_tcp(T)\n{seam}\nend\n',
}


@pytest.mark.parametrize('language', HANDED)
def test_what_a_routine_is_handed_is_not_the_frame_of_that_name(language):
    text = HANDED[language]
    for word, line in WORDS[language].items():
        text = text.replace(f'{{{word}}}', line)
    (move,) = moves_of(language, text)
    assert move.kind == 'unknown'


def test_a_tool_that_stands_still_is_not_that_of_the_robot_file():
    source = (MADE / 'bracket.mod').read_text().replace('[TRUE, [[0,0,250]', '[FALSE, [[0,0,250]')
    robot = wt.load('abb_irb1600')
    torch = robot.T_flange_tool @ transform(np.eye(3), np.array([0.0, 0.0, 0.2]))
    own = controller_of(robot.with_frames(tool=torch), 'rapid')
    program = read('rapid', (source,))
    moves = [move for piece in to_moves(program, robot, own).pieces for move in piece]
    assert {move.kind for move in moves} == {'unknown'}


WORKED_OUT = """
krl | $TOOL = TOOL_DATA[1] |
krl | $TOOL = TORCH |
krl | $TOOL = TOOL_DATA[I] | worked out
krl | BAS(#TOOL, I) | worked out
krl | $TOOL = TOOL_DATA[1]:WEAR | worked out
krl | TORCH = BARE:WEAR / $TOOL = TORCH | are set at file0 line 2
rapid | tTorch |
rapid | tTorches{i} | worked out
rapid | CTool() | worked out
rapid | tSet | are set at file0 line
urscript | set_tcp(TCP_1) |
urscript | set_tcp(tcps[i]) | worked out
urscript | T = tool_of(2) / set_tcp(T) | are set at file0 line 2
"""


@pytest.mark.parametrize(('language', 'tool', 'reason'), table(WORKED_OUT))
def test_a_tool_that_is_worked_out_is_not_that_of_the_robot_file(language, tool, reason):
    text = {
        'krl': f'{tool} / $BASE = $NULLFRAME / @move',
        'rapid': f'tSet := tOther; / MoveL p1,v9,fine,{tool};',
        'urscript': f'{tool} / @seam',
    }[language]
    robot = wt.load(PROGRAMS[language][0])
    torch = robot.T_flange_tool @ transform(np.eye(3), np.array([0.0, 0.0, 0.2]))
    own = controller_of(robot.with_frames(tool=torch), language)
    program = read(language, (program_of(language, text),))
    *_, move = to_moves(program, robot, own).pieces[-1]
    assert (move.kind == 'unknown') == bool(reason) and reason in move.why


OF_ANOTHER_KIND = """
rapid | TriggLDPO p10, v100, fine, tTorch;
rapid | MovePnP pElsewhere, v100, fine, tElsewhere;
rapid | SearchL di1, pHere, p10, v10, tTorch;
rapid | EGMRunJoint egm1, EGM_STOP_HOLD;
urscript | servoc(p[0,0,0.1,0,0,0])
inform | SMOVL C00001 V=100.0
inform | SYMOVL C00001 V=100.0 CV#(1)
inform | MOVL C00001 V=100.0 /   +MOVJ C00002 VJ=10.0
fanuc-ls | 5:L P[3] 8mm/sec FINE RTCP    ;
"""


@pytest.mark.parametrize(('language', 'lines'), table(OF_ANOTHER_KIND))
def test_moves_of_another_kind_end_what_is_known(language, lines):
    more = ''.join(f'{line}\n' for line in lines.split(' / '))
    before, after = (
        sum(step.end is None or step.shift.why != '' for step in read(language, texts).steps)
        for texts in (bracket(language), bracket_with(language, more))
    )
    assert after == before + 1


def test_instructions_that_move_nothing_end_nothing():
    calls = 'TPWrite "at " \\Pos:=p10.trans;\npNow := CRobT(\\Tool:=tTorch);\nVelSet 50, 800;\nRETURN;\n'
    weighed = 'tTorch.tload.mass := 3;\n'
    moves = moves_of('rapid', *bracket_with('rapid', calls + weighed))
    assert all(move.kind != 'unknown' for move in moves)


def test_joints_of_several_axes_beside_a_trajectory_are_no_second_one():
    robot, (name,) = PROGRAMS['joint-trajectory']
    text = (MADE / name).read_text()
    beside = 'multi_dof_joint_trajectory:\n  joint_names: []\n  points: []\n'
    steps = read('joint-trajectory', (beside + text,), robot).steps
    assert len(steps) == len(read('joint-trajectory', (text,), robot).steps) > 1
    with pytest.raises(TwinError, match='several trajectories'):
        read('joint-trajectory', (text + text,), robot)


@pytest.mark.parametrize(
    ('line', 'many'),
    [('  Foo a,\n', 2_000), ('a ' + 'x , ' * 9 + '\n', 2_000), ('  a{\n', 10_000)],
)
def test_what_ends_no_statement_is_read_in_the_time_of_other_lines(line, many):
    source = (MADE / 'bracket.mod').read_text().replace('MODULE', line * many + 'MODULE', 1)
    begin = time.process_time()
    read('rapid', (source,))
    assert time.process_time() - begin < 1.5  # a quarter; two where a statement may go on


def test_places_count_their_lines():
    source = Source('a', 'x\r\ny\n\nz')
    assert [source.line(place) for place in range(7)] == [1, 1, 1, 2, 2, 3, 4]


@pytest.mark.parametrize('before', ['\xef\xbb\xbf', '# \xc3\x85land, \x85\n', '\xef\xbb\xbf# a\n'])
def test_marks_and_letters_of_other_alphabets_part_no_lines(before):
    source = (MADE / 'bracket.csv').read_text()
    assert len(read('csv', (before + source,)).steps) == len(read('csv', (source,)).steps)


@pytest.mark.parametrize(
    ('call', 'moved'),
    [
        ('Offs(p1,0,0,50)', [0.1, 0.2, 0.35]),
        ('RelTool(p1,0,0,50)', [0.1, 0.2, 0.25]),  # the tool looks down
    ],
)
def test_abb_places_derived_from_a_point_go_along_with_it(call, moved):
    text = (
        'MODULE M\nCONST robtarget p1:=[[100,200,300],[0,1,0,0],[0,0,0,0],'
        '[9E9,9E9,9E9,9E9,9E9,9E9]];\nPROC main()\n'
        f'MoveL {call},v100,fine,tool0;\nENDPROC\nENDMODULE\n'
    )
    program = read('rapid', (text,))
    (step,) = program.steps
    assert not step.end.leads
    before = np.eye(4) if step.end.before is None else step.end.before
    after = np.eye(4) if step.end.after is None else step.end.after
    place = before @ program.points[step.end.point].value @ after
    np.testing.assert_allclose(place[:3, 3], moved, atol=1e-12)


@pytest.mark.parametrize(
    ('between', 'increment', 'known'),
    [
        ('DO[5]=ON', 'W = 0, P = 0, R = 0', True),
        ('WAIT .30(sec)', 'W = 0, P = 0, R = 0', True),
        ('CALL CLEAN', 'W = 0, P = 0, R = 0', False),
        ('LBL[1]', 'W = 0, P = 0, R = 0', False),
        ('UFRAME[1]=PR[2]', 'W = 0, P = 0, R = 0', False),
        ('DO[5]=ON', 'W = 0, P = 0, R = 5', False),
    ],
)
def test_a_fanuc_increment_goes_along_with_the_point_before(between, increment, known):
    point = "P[{}]{{\n GP1:\n UF : 0, UT : 1, CONFIG : 'N U T, 0, 0, 0',\n {}\n}};\n"
    text = (
        '/PROG A\n/MN\n   1:L P[1] 100mm/sec FINE ;\n'
        f'   2:  {between} ;\n   3:L P[2] 100mm/sec FINE INC ;\n/POS\n'
        + point.format(1, 'X = 800, Y = 0, Z = 300, W = 180, P = 0, R = 0')
        + point.format(2, f'X = 0, Y = 0, Z = 50, {increment}')
        + '/END\n'
    )
    program = read('fanuc-ls', (text,))
    last = program.steps[-1]
    if not known:
        assert last.shift.why
        return
    place = last.end.before @ program.points[last.end.point].value
    assert not last.end.leads and not last.shift.why
    np.testing.assert_allclose(place[:3, 3], [0.8, 0.0, 0.35])
    np.testing.assert_allclose(place[:3, :3], np.diag([1.0, -1.0, -1.0]), atol=1e-12)


@pytest.mark.parametrize(
    ('line', 'held'), [('PR[1]=P[2]', {'P[2]'}), ('L P[R[3]] 5mm/sec FINE', {'P[1]', 'P[2]'})]
)
def test_fanuc_points_that_something_else_uses_are_left(line, held):
    points = ''.join(
        f"P[{k}]{{\n GP1:\n UF : 0, UT : 1, CONFIG : 'N U T, 0, 0, 0',\n X = 900 mm, Y = 0 mm, "
        'Z = 300 mm,\n W = 180 deg, P = 0 deg, R = 0 deg\n};\n'
        for k in (1, 2)
    )
    text = f'/PROG A\n/MN\n 1:J P[1] 5% FINE ;\n 2:  !P[1] ;\n 3:{line} ;\n/POS\n{points}/END\n'
    program = read('fanuc-ls', (text,))
    assert {program.points[k].name for k in program.fixed} == held


@pytest.mark.parametrize(
    ('language', 'place', 'seconds'),
    [('krl', 1, 0.4), ('rapid', 5, 0.3), ('urscript', 1, 0.3), ('inform', 1, 0.3), ('fanuc-ls', 1, 0.3)],
)  # fmt: skip
def test_a_wait_makes_the_move_before_it_last_longer(language, place, seconds):
    steps = read(language, bracket(language)).steps
    assert [step.dwell for step in steps] == [seconds * (k == place) for k in range(len(steps))]
    assert steps[place].stop


RAILS = """
krl | PTP {A1 1,A2 2,A3 3,A4 4,A5 5,A6 6,E1 500} / @move / @said | 0 1
krl | PTP {E1 500} / @move / @said | 0
krl | PTP {A1 1,A2 2,A3 3,A4 4,A5 5,A6 6,A7 7} / @move | 0 1
krl | XHOME.E1 = RAIL / @move / @said | 0
krl | PTP {A1 1,A2 2,A3 3,A4 4,A5 5,A6 6,E1 0.0} / @move / @said |
rapid | MoveExtJ rail,v100,fine; / @move | 0 1
rapid | @move |
inform | BC00000=500000 / //INST / MOVJ BC00000 VJ=9.0 / @move | 0
inform | BC00000=0 / //INST / @move |
"""


@pytest.mark.parametrize(('language', 'lines', 'held'), table(RAILS))
def test_points_that_do_not_say_where_a_rail_stands_that_moves_are_left(language, lines, held):
    text = program_of(language, lines).replace('//INST\nNOP\nBC', 'BC')
    assert sorted(read(language, (text,)).fixed) == [int(k) for k in held.split()]


@pytest.mark.parametrize(
    ('other', 'held'),
    [
        ('p1.trans.z := 5;', True),
        ('MoveL P1,v9,fine,tool0;', True),
        ('VAR robtarget p1;\nMoveL p1,v9,fine,tool0;', False),
        ('MoveL p11,v9,fine,tool0; ! not p1', False),
    ],
)
@pytest.mark.parametrize('local', ['', 'LOCAL '])
def test_a_point_that_another_program_of_the_folder_uses_is_left(other, held, local):
    beside = (Source('other.mod', RAPID_OTHER.format('x', other)),)
    own = context('abb_irb1600', 'rapid')._replace(beside=beside)
    text = RAPID_CALLS.replace('CONST robtarget', f'{local}CONST robtarget')
    program = read_sources([Source('file', text)], own, 'rapid')
    assert bool(program.fixed) == (held and not local)
    where = {'XA': 'GLOBAL ', 'XB': ''}
    points = [f'DECL {word}POS {name}={KRL["move"][4:]}\n' for name, word in where.items()]
    sources = [Source('a.src', 'DEF a()\nLIN XA\nLIN XB\nEND\n'), Source('a.dat', ''.join(points))]
    own = context('kuka_kr16_2', 'krl')
    own = own._replace(beside=(Source('b.src', 'DEF b()\nLIN XA\nLIN XB\nEND\n'),))
    assert list(read_sources(sources, own, 'krl').fixed) == [0]


@pytest.mark.parametrize('language', ['fanuc-ls', 'inform'])
@pytest.mark.parametrize(
    ('moves', 'known'),
    [
        (['J1', 'J1', 'L1', 'J1'], [True] * 4),
        (['J1', 'J2', 'L2', 'J1'], [True, False, True, True]),
        (['L1', 'J2'], [True, False]),
        (['J1', 'J0', 'J2'], [True, True, True]),  # joints say themselves which posture it is
    ],
)
def test_flags_that_ask_for_another_posture_than_before_are_not_followed(language, moves, known):
    if language == 'fanuc-ls':
        joints = ', '.join(f'J{k} = 5 deg' for k in range(1, 7))
        pose = 'X = 900 mm, Y = 0 mm, Z = 300 mm,\n W = 180 deg, P = 0 deg, R = 0 deg'
        places = [f'UF : 0, UT : 1,\n {joints}']
        places += [f"UF : 0, UT : 1, CONFIG : '{c} U T, 0, 0, 0',\n {pose}" for c in 'NF']
        lines = [
            f'   1:{m[0]} P[{m[1]}] 9{"%" if m[0] == "J" else "mm/sec"} FINE ;' for m in moves
        ]
        points = [f'P[{k}]{{\n GP1:\n {place}\n}};' for k, place in enumerate(places)]
        text = '\n'.join(['/PROG A', '/MN', *lines, '/POS', *points, '/END', ''])
    else:
        head = ['/JOB', '//NAME A', '//POS', '///TOOL 1', '///POSTYPE PULSE', 'C00000=1,1,1,1,1,1']
        poses = [f'///RCONF {k},0,0,0\nC0000{k}=900,0,300,180,0,0' for k in (1, 2)]
        lines = [f'MOV{m[0]} C0000{m[1]} V{"J" if m[0] == "J" else ""}=9.0' for m in moves]
        text = '\n'.join([*head, '///POSTYPE ROBOT', *poses, '//INST', 'NOP', *lines, 'END', ''])
    steps = read(language, (text,), PROGRAMS[language][0]).steps
    assert ['not those of the poses before' not in step.shift.why for step in steps] == known


def test_numbers_of_a_table_that_are_not_read_are_told():
    (name,) = PROGRAMS['csv'][1]
    lines = (MADE / name).read_text().splitlines()
    assert not read('csv', ('\n'.join(lines),)).notes
    head, *rows = lines[1:]
    text = '\n'.join([f'rail,{head}', *(f'{k},{row}' for k, row in enumerate(rows))])
    assert 'the numbers of rail are not read' in read('csv', (text,)).notes[0]


def test_a_wait_is_of_its_own_routine_and_one_before_any_move_of_none():
    axes = 'A2 -85.0,A3 100.0,A4 5.0,A5 70.0,A6 -3.0'
    one, two, three = (f'PTP {{A1 {k},{axes}}}\n' for k in (1, 2, 3))
    text = f'DEF a()\n{one}END\nDEF b()\nWAIT SEC 9\n{two}{three}WAIT SEC 1.5\nEND\n'
    steps = read('krl', (text,)).steps
    assert [step.dwell for step in steps] == [0.0, 0.0, 1.5]
    assert [step.where for step in steps] == [f'file0 line {k}' for k in (2, 6, 7)]


RAPID_POINT = 'CONST robtarget p1:=[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];'


@pytest.mark.parametrize(
    ('language', 'first', 'line'),
    [
        ('rapid', 'MODULE M', RAPID_POINT),
        ('krl', 'DEFDAT A', 'DECL E6POS p1={X 1,Y 2,Z 3,A 0,B 0,C 0,S 2,T 2}'),
        ('krl', 'DEFDAT A', 'DECL FDAT p1={TOOL_NO 2,BASE_NO 0,IPO_FRAME #BASE}'),
    ],
)
def test_what_is_declared_twice_is_refused_with_its_line(language, first, line):
    with pytest.raises(TwinError, match='file0 line 3: p1 is declared twice'):
        read(language, (f'{first}\n{line}\n{line}\n',))


def broken(text, draw):
    """Return a text with a few of its characters lost, doubled or swapped."""
    for _ in range(draw.randint(1, 4)):
        at = draw.randrange(len(text))
        cut = at + draw.randint(1, 12)
        text = (
            draw.choice(
                [
                    text[:at] + text[cut:],
                    text[:at] + text[at:cut] * 2 + text[cut:],
                    text[:at] + draw.choice('[]{}(),;:.-+eE 0x"!#') + text[at + 1 :],
                    text[:cut],
                ]
            )
            or ' '
        )
    return text


@pytest.mark.parametrize('language', PROGRAMS)
def test_broken_programs_are_refused_in_words_or_change_in_moved_points_alone(language):
    whole, draw, refused = bracket(language), random.Random(language), 0
    for _ in range(FUZZED):
        texts = [broken(text, draw) for text in whole]
        try:
            program = read(language, texts)
        except TwinError as error:
            assert re.search(r'file\d line \d+: ', str(error)), error
            refused += 1
            continue
        points = [point.value.copy() for point in program.points]
        assert rewritten(program, points, range(len(points))) == texts
        for point in points:
            point[..., -1] += [1e-4, -2e-4, 3e-4, 0.0] if point.ndim == 2 else 1e-4
        again = rewritten(program, points, range(len(points)))
        check_written(program, read(language, again), points)
        assert [re.sub(NUMBER, '', t) for t in again] == [re.sub(NUMBER, '', t) for t in texts]
    assert 0.05 * FUZZED < refused < 0.95 * FUZZED


@pytest.mark.parametrize('external', [(), ('track',)])
def test_a_confdata_tells_the_quarter_turns_of_axes_1_4_and_6_within_half_a_degree(external):
    """Others may stand anywhere, and what its last number means depends on the arm."""
    posture = np.array([10.0, 80.0, -20.0, -100.0, 200.0, 190.0])
    off = {0: (-10.4, 80.4), 3: (-80.4, 10.4), 5: (-10.4, 80.4)}
    within = [posture + turn * np.eye(6)[axis] for axis in off for turn in off[axis]]
    beyond = [posture + 1.02 * turn * np.eye(6)[axis] for axis in off for turn in off[axis]]
    anywhere = [posture + 90.0 * np.eye(6)[axis] for axis in (1, 2, 4)]
    q = np.radians([*within, *anywhere, *beyond])
    q = np.hstack([np.full((len(q), len(external)), 7.0), q])
    controller, suits = SimpleNamespace(external=external), quadrants([0, -2, 2, 5])
    assert suits(controller, q).tolist() == [True] * 9 + [False] * 6
    assert suits(controller, q[:, :-1]).all()  # an arm of five axes has no such quarters
