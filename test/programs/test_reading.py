# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the readers of programs make of numbers, of rarer forms, and of broken texts."""

import random
import re
import time
from pathlib import Path

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


def read(language, texts, robot):
    sources = [Source(f'file{k}', text) for k, text in enumerate(texts)]
    return read_sources(sources, context(robot, language), language)


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
    program = read('krl', (src, dat), 'kuka_kr16_2')
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
    step, other = read('krl', (text,), 'kuka_kr16_2').steps
    assert (step.tool.name, step.base.name, step.speed, step.stop) == ('4', '2', 0.25, False)
    assert 'tool or base' in other.tool.why


def test_the_moves_of_a_spline_have_its_tool_and_base_where_they_bring_none():
    point = 'DECL E6POS XP1={X 1,Y 2,Z 3,A 0,B 0,C 0}\n'
    data = 'DECL FDAT FP{0}={{TOOL_NO {0},BASE_NO {0},IPO_FRAME #BASE}}\n'
    own = ' WITH $TOOL=STOOL2(FP{0}), $BASE=SBASE(FP{0}.BASE_NO)\n'
    block = f'SPLINE{own.format(4)}SLIN XP1\nSLIN XP1{own.format(5)}ENDSPLINE\nSLIN XP1\n'
    text = 'DEF a()\n' + point + data.format(4) + data.format(5) + KRL_LONG + block + 'END\n'
    steps = read('krl', (text,), 'kuka_kr16_2').steps
    assert [step.tool.name for step in steps[:2]] == [step.base.name for step in steps[:2]]
    assert [step.tool.name for step in steps[:2]] == ['4', '5']
    assert steps[2].tool.value[2, 3] == 0.25


def test_an_abb_move_that_switches_an_output_has_its_tool_before_it():
    point = '[[900,0,800],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]'
    frame = 'PERS wobjdata w:=[FALSE,TRUE,"",[[500,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];\n'
    moves = (
        f'MoveLDO {point}, v9, fine, tool0\\WObj:=w, doArc, 1;\n'
        f'MoveCSync {point}, {point}, v9, z1, tool0\\WObj:=w, "stir";\n'
    )
    text = f'MODULE m\n{frame}PROC main()\n{moves}ENDPROC\nENDMODULE\n'
    steps = read('rapid', (text,), 'abb_irb1600').steps
    assert [step.stop for step in steps] == [True, False]
    assert all(step.base.value[0, 3] == 0.5 and step.tool.value is not None for step in steps)


@pytest.mark.parametrize(
    ('speed', 'told'), [('[18.30, 50,50,50]', 0.0183), ('v200', 0.2), ('[1.5E2,500,0,0]', 0.15)]
)
def test_an_abb_move_is_as_fast_as_its_line_says(speed, told):
    point = '[[900,0,800],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]'
    text = f'MODULE m\nPROC main()\nMoveL {point}, {speed}, fine, tool0;\nENDPROC\nENDMODULE\n'
    (step,) = read('rapid', (text,), 'abb_irb1600').steps
    assert abs(step.speed - told) < 1e-9


@pytest.mark.parametrize(
    'line',
    [
        'LIN_REL {X 5}',
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
    (step,) = read('krl', (text,), 'kuka_kr16_2').steps
    assert step.end is None and step.why


BEFORE = {
    'krl': 'LIN XP2 ;',
    'rapid': '        ArcLStart pStart',
    'urscript': '    movel(Waypoint_1_p',
    'inform': 'MOVL C00001',
    'fanuc-ls': '   5:L P[2]',
}
"""Where the bracket's seam begins, in each language."""
FRAME = '{X 10,Y 0,Z 0,A 0,B 0,C 0}'
IN_FRAME = 'movel(pose_trans(F, p[-0.5,-0.2,0.02,2.1,2.3,0]))\n'


@pytest.mark.parametrize(
    ('language', 'lines', 'reason'),
    [
        ('krl', '$TOOL.Z = 300\n', 'set in parts'),
        ('krl', '$BASE.X = 10\n', 'set in parts'),
        ('krl', f'BASE_DATA[2] = {FRAME}\n$BASE = BASE_DATA[2]\nBASE_DATA[2].X = 5\n', 'set anew'),
        ('krl', f'BASE_DATA[2] = {FRAME}\n$BASE = BASE_DATA[2]\nBASE_DATA[i] = F\n', 'set anew'),
        ('krl', f'FRAME F={FRAME}\n$BASE = F\nF.X = F.X + 10\n', 'set anew'),
        ('krl', f'POS F={FRAME}\nF = XP1\n$BASE = F\n', 'set anew'),
        ('krl', f'BASE_DATA[2] = {FRAME}\n$BASE = BASE_DATA[2]\nbase_data[2] = F\n', 'set anew'),
        ('krl', '$IPO_MODE = #TCP\n', 'the tool stands still'),
        (
            'krl',
            'DECL FDAT FX={TOOL_NO 0,BASE_NO 0,IPO_FRAME #TCP}\nFDAT_ACT=FX\n',
            'stands still',
        ),
        ('rapid', 'tTorch.tframe.trans.z := 300;\n', 'set anew'),
        ('rapid', 'wobjTable.oframe := DefFrame(p10, p20, p30);\n', 'set anew'),
        ('rapid', 'wobjTable := wobjOther;\n', 'set anew'),
        ('rapid', 'TTORCH := tOther;\n', 'set anew'),
        ('urscript', f'F = p[0,0,0.1,0,0,0]\nF[2] = 0.3\n{IN_FRAME}', 'worked out'),
        ('urscript', f'F = p[0,0,0.1,0,0,0]\nF = pose_add(F, F)\n{IN_FRAME}', 'worked out'),
        ('urscript', 'T = p[0,0,0.1,0,0,0]\nT[2] = 0.3\nset_tcp(T)\n', 'numbers of T are set'),
        (
            'urscript',
            'movej(get_inverse_kin(Waypoint_1_p, Start_q, tcp=p[0,0,1,0,0,0]))\n',
            'worked out',
        ),
        ('fanuc-ls', '   5:  UTOOL[1]=PR[3] ;\n', 'UTOOL 1 are set'),
        ('fanuc-ls', '   5:  UTOOL[R[2]]=PR[3] ;\n', 'UTOOL 1 are set'),
        ('fanuc-ls', '   5:  Touch Offset PR[1] ;\n', 'Touch Offset'),
        ('inform', 'SETTOOL TL#(1) P001\n', 'TL 1 are set'),
        ('krl', f'DECL FRAME F={FRAME}\nmeasured(F)\n$BASE = F\n', 'set anew'),
        ('rapid', 'Measured wobjTable;\n', 'set anew'),
        ('rapid', 'GetSysData tTorch;\n', 'set anew'),
        ('krl', '$WORLD.Z = 100\n', 'what bases count from'),
        ('krl', f'$ROBROOT={FRAME}\n', 'what bases count from'),
    ],
)
def test_what_a_program_sets_on_its_way_is_not_taken_for_known(language, lines, reason):
    robot, files = PROGRAMS[language]
    source, *beside = [(MADE / name).read_bytes().decode('latin-1') for name in files]
    start = BEFORE[language]
    text = source.replace(start, lines + start, 1)
    assert text != source
    program = read(language, (text, *beside), robot)
    own = context(robot, language).controller
    moves = [move for piece in to_moves(program, wt.load(robot), own).pieces for move in piece]
    assert any(move.kind == 'unknown' and reason in move.why for move in moves)


def test_a_block_of_ur_that_is_not_known_ends_no_routine_before_its_end():
    inside = 'switch(a):\ncase 1:\nb()\nend\nend\n'
    text = 'def p():\nset_tcp(p[0,0,0.1,0,0,0])\n{}movel(p[0.3,0.2,0.1,0,3.1,0])\nend\n'
    with pytest.raises(TwinError, match="line 7: this 'end' closes no routine"):
        read('urscript', (text.format(inside),), 'ur5')
    own = 'sec s():\nset_digital_out(1, True)\nend\n'
    (step,) = read('urscript', (text.format(own),), 'ur5').steps
    assert step.tool.value is not None and step.tool.value[2, 3] == 0.1


def test_a_program_that_goes_along_with_a_conveyor_is_left():
    text = (MADE / 'bracket.ls').read_text()
    for schedule, along in ((0, False), (2, True)):
        head = f'/APPL\nLINE_TRACK;\n  LINE_TRACK_SCHEDULE_NUMBER : {schedule};\n'
        steps = read('fanuc-ls', (text.replace('/APPL\n', head),), 'fanuc_m10ia').steps
        assert {'conveyor' in step.shift.why for step in steps} == {along}


@pytest.mark.parametrize(('line', 'known'), [('t.robhold := TRUE;', False), ('x := 5;', True)])
def test_a_tool_is_known_after_a_routine_that_does_not_set_it(line, known):
    text = (MADE / 'bracket.mod').read_text().replace('ConfL', 'sub tTorch;\nConfL')
    sub = f'PROC sub(PERS tooldata t)\n{line}\nENDPROC\nENDMODULE'
    step = read('rapid', (text.replace('ENDMODULE', sub),), 'abb_irb1600').steps[-1]
    assert (step.tool.why == '') == known


KRL_TOOL = '$TOOL = {{X 0,Y 0,Z {},A 0,B 0,C 0}}\n'
KRL_CALLED = 'DEF sub()\n$VEL.CP = 0.1\nLIN {X 900,Y 0,Z 800,A 0,B 90,C 0}\nEND\n'
UR_CALLED = 'def sub():\n  movel(p[0.3,0.2,0.1,0,3.1,0])\nend\n'
UR_TOOL = 'set_tcp(p[0,0,{},0,0,0])\n'


@pytest.mark.parametrize(
    ('language', 'text', 'length'),
    [
        ('krl', 'DEF a()\n' + KRL_TOOL.format(250) + 'sub()\nEND\n' + KRL_CALLED, 0.25),
        (
            'krl',
            'DEF a()\n'
            + KRL_TOOL.format(250)
            + 'sub()\n'
            + KRL_TOOL.format(90)
            + 'END\n'
            + KRL_CALLED,
            None,
        ),
        ('urscript', f'def a():\n{UR_CALLED}{UR_TOOL.format(0.25)}sub()\nend\n', 0.25),
        (
            'urscript',
            f'def a():\n{UR_CALLED}{UR_TOOL.format(0.25)}sub()\n{UR_TOOL.format(0.1)}end\n',
            None,
        ),
        (
            'urscript',
            f'def a():\n{UR_TOOL.format(0.25)}def sub():\nif (g):\nset_tcp(T)\nend\nend\n'
            + UR_CALLED.splitlines()[1]
            + '\nend\n',
            0.25,
        ),
    ],
)
def test_a_routine_has_the_tool_of_its_program_where_that_is_one(language, text, length):
    robot = PROGRAMS[language][0]
    own = context(robot, language).controller
    ((move,),) = to_moves(read(language, (text,), robot), wt.load(robot), own).pieces
    if length is None:
        assert move.kind == 'unknown' and 'other routines' in move.why
    else:
        away = np.linalg.norm(move.tool[:3, 3] - own.flange[:3, 3])
        np.testing.assert_allclose(away, length, atol=1e-12)


KRL_SEAM = 'LIN {X 900,Y 0,Z 800,A 0,B 90,C 0}\n'
UR_SEAM = 'movel(p[0.3,0.2,0.1,0,3.1,0])\n'
KRL_LONG, KRL_SHORT = KRL_TOOL.format(250), KRL_TOOL.format(90)
UR_LONG, UR_SHORT = UR_TOOL.format(0.25), UR_TOOL.format(0.09)


@pytest.mark.parametrize(
    ('language', 'parts', 'known'),
    [
        ('krl', ['IF x THEN', KRL_SHORT, 'ENDIF', KRL_SEAM], [False]),
        ('krl', ['IF x THEN', KRL_LONG, 'ENDIF', KRL_SEAM], [True]),
        ('krl', ['IF x THEN', KRL_SHORT, KRL_SEAM, 'ELSE', KRL_SEAM, 'ENDIF'], [True, True]),
        ('krl', ['IF x THEN', KRL_SHORT, 'ELSE', KRL_SHORT, 'ENDIF', KRL_SEAM], [True]),
        (
            'krl',
            ['SWITCH n', 'CASE 1', KRL_SHORT, 'DEFAULT', KRL_LONG, 'ENDSWITCH', KRL_SEAM],
            [False],
        ),
        (
            'krl',
            ['SWITCH n', 'CASE 1', KRL_SHORT, 'DEFAULT', KRL_SHORT, 'ENDSWITCH', KRL_SEAM],
            [True],
        ),
        ('krl', ['LOOP', KRL_SEAM, KRL_SHORT, KRL_SEAM, 'ENDLOOP'], [False, True]),
        ('krl', ['LOOP', KRL_SHORT, KRL_SEAM, 'ENDLOOP', KRL_LONG, KRL_SEAM], [True, True]),
        ('krl', ['WHILE x', KRL_SHORT, KRL_SEAM, 'ENDWHILE', KRL_SEAM], [True, False]),
        ('krl', ['IF x THEN', '$IPO_MODE = #TCP', 'ENDIF', KRL_SEAM], [False]),
        ('krl', ['IF x THEN', '$BASE.X = 5', 'ENDIF', KRL_SEAM], [False]),
        ('krl', ['LOOP', KRL_SEAM, '$IPO_MODE = #TCP', 'ENDLOOP'], [False]),
        ('urscript', ['if (x):', UR_SHORT, 'end', UR_SEAM], [False]),
        ('urscript', ['if (x):', UR_SHORT, 'else:', UR_SHORT, 'end', UR_SEAM], [True]),
        (
            'urscript',
            ['if (x):', UR_SHORT, 'elif (y):', UR_SEAM, 'else:', UR_SHORT, 'end', UR_SEAM],
            [True, False],
        ),
        ('urscript', ['while (True):', UR_SEAM, UR_SHORT, UR_SEAM, 'end'], [False, True]),
        ('urscript', ['while (True):', UR_SHORT, UR_SEAM, 'end'], [True]),
        # A loop that is left halfway: the tool of its end is not what holds after it.
        (
            'krl',
            ['LOOP', KRL_SHORT, 'IF x THEN', 'EXIT', 'ENDIF', KRL_LONG, 'ENDLOOP', KRL_SEAM],
            [False],
        ),
        (
            'krl',
            ['LOOP', KRL_LONG, 'IF x THEN', 'EXIT', 'ENDIF', KRL_SEAM, 'ENDLOOP', KRL_SEAM],
            [True, True],
        ),
        (
            'urscript',
            ['while (x):', UR_SHORT, 'if (y):', 'break', 'end', UR_LONG, 'end', UR_SEAM],
            [False],
        ),
        (
            'urscript',
            ['while (x):', UR_SEAM, UR_SHORT, 'if (y):', 'continue', 'end', UR_LONG, 'end'],
            [False],
        ),
    ],
)
def test_a_frame_that_not_every_way_sets_is_not_known_after_it(language, parts, known):
    head, first, end = {
        'krl': ('DEF a()\n$BASE = $NULLFRAME\n', KRL_LONG, 'END\n'),
        'urscript': ('def a():\n', UR_LONG, 'end\n'),
    }[language]
    text = head + first + ''.join(part.rstrip('\n') + '\n' for part in parts) + end
    robot = PROGRAMS[language][0]
    own = context(robot, language).controller
    (moves,) = to_moves(read(language, (text,), robot), wt.load(robot), own).pieces
    assert [move.kind != 'unknown' for move in moves] == known


KRL_SETS = f'DEF sub()\nother()\nEND\nDEF other()\n{KRL_SHORT}END\n'
UR_SETS = f'def sub():\n{UR_SHORT}end\n'
RAPID_SEAM = (
    'MODULE m\n'
    'CONST robtarget p1 := [[900,0,800],[0.7,0,0.714,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n'
    'CONST robtarget p2 := [[0,0,9],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n'
    'PROC main()\nsub;\nMoveL p1,v100,fine,tool0;\nENDPROC\nPROC sub()\n{}ENDPROC\nENDMODULE\n'
)


@pytest.mark.parametrize(
    ('language', 'text', 'reason'),
    [
        ('krl', f'DEF a()\n{KRL_LONG}sub()\n{KRL_SEAM}END\n{KRL_SETS}', 'other routines'),
        ('krl', f'DEF a()\n{KRL_LONG}sub()\n{KRL_LONG}{KRL_SEAM}END\n{KRL_SETS}', ''),
        ('krl', f'DEF a()\n{KRL_SHORT}sub()\n{KRL_SEAM}END\n{KRL_SETS}', ''),
        ('krl', f'DEF a()\n{KRL_LONG}up:\n{KRL_SEAM}{KRL_SHORT}GOTO up\nEND\n', 'other routines'),
        ('krl', f'DEF a()\n{KRL_LONG}up:\n{KRL_SEAM}GOTO up\nEND\n', ''),
        ('urscript', f'def a():\n{UR_SETS}{UR_LONG}sub()\n{UR_SEAM}end\n', 'other routines'),
        ('urscript', f'def a():\n{UR_SETS}{UR_LONG}{UR_SEAM}sub()\nend\n', ''),
        ('rapid', RAPID_SEAM.format('PDispSet x;\n'), 'sub, called at'),
        ('rapid', RAPID_SEAM.format('PDispSet x;\nMoveL p2,v9,fine,tool0;\nPDispOff;\n'), ''),
    ],
)
def test_what_a_routine_sets_holds_after_its_call(language, text, reason):
    robot = PROGRAMS[language][0]
    own = context(robot, language).controller
    move = to_moves(read(language, (text,), robot), wt.load(robot), own).pieces[0][0]
    assert (move.kind == 'unknown') == bool(reason) and reason in move.why


RAPID_CALLS = RAPID_SEAM.partition('PROC sub')[0] + 'ENDMODULE\n'
RAPID_OTHER = 'MODULE n\nPROC {}()\n{}ENDPROC\nENDMODULE\n'
RAPID_TOOL = RAPID_CALLS.replace(
    'PROC main',
    'PERS tooldata t:=[TRUE,[[0,0,9],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\nPROC main',
).replace('tool0', 't')
KRL_CALLS = f'DEF a()\n{KRL_LONG}sub()\n{KRL_SEAM}END\n'


@pytest.mark.parametrize(
    ('language', 'text', 'others', 'known'),
    [
        ('krl', KRL_CALLS, [KRL_SETS], False),
        (
            'krl',
            KRL_CALLS,
            [KRL_SETS.partition('DEF other')[0], f'DEF other()\n{KRL_SHORT}END\n'],
            False,
        ),
        ('krl', KRL_CALLS, ['DEF sub()\nEND\n', f'DEF other()\n{KRL_SHORT}END\n'], True),
        ('krl', KRL_CALLS + 'DEF sub()\nEND\n', [KRL_SETS], True),
        ('rapid', RAPID_CALLS, [RAPID_OTHER.format('sub', 'PDispSet x;\n')], False),
        ('rapid', RAPID_CALLS, [RAPID_OTHER.format('x', 'PDispSet x;\n')], True),
        ('rapid', RAPID_TOOL, [RAPID_OTHER.format('sub', 't.tframe.trans.z := 5;\n')], False),
        ('rapid', RAPID_TOOL, [RAPID_OTHER.format('sub', '')], True),
        ('fanuc-ls', ['CALL SUB', 'L P[1] 9mm/sec FINE'], ['Touch Offset PR[1]'], False),
        ('fanuc-ls', ['CALL SUB', 'L P[1] 9mm/sec FINE'], ['UTOOL[1]=PR[3]'], False),
        (
            'fanuc-ls',
            ['CALL SUB', 'L P[1] 9mm/sec FINE'],
            ['Touch Offset PR[1]', 'Touch Offset End'],
            True,
        ),
        ('inform', ['CALL JOB:SUB', 'MOVL C00001 V=9.0'], ['SFTON P001'], False),
        ('inform', ['CALL JOB:SUB', 'MOVL C00001 V=9.0'], ['SETTOOL TL#(1) P003'], False),
        ('inform', ['CALL JOB:SUB-2', 'MOVL C00001 V=9.0'], ['SFTON P001'], True),
    ],
)
def test_what_a_routine_of_another_file_sets_holds_after_its_call(language, text, others, known):
    if isinstance(text, list):
        head, form, tail = {
            'fanuc-ls': ('/PROG {}\n/MN\n', '   1:{} ;\n', TP_TAIL),
            'inform': (JOB_HEAD.replace('NAME A', 'NAME {}'), '{}\n', 'END\n'),
        }[language]
        text, *others = (
            head.format(name) + ''.join(map(form.format, lines)) + tail
            for name, lines in (('A', text), ('SUB', others))
        )
    robot = PROGRAMS[language][0]
    beside = tuple(Source(f'other{k}', other) for k, other in enumerate(others))
    own = context(robot, language)._replace(beside=beside)
    step = read_sources([Source('file', text)], own, language).steps[-1]
    assert bool(step.tool.why or step.shift.why) != known


ABB_MOVE, ABB_ON, ABB_OFF = 'MoveL p1,v100,fine,tool0;', 'PDispSet x;', 'PDispOff;'
TP_MOVE, TP_ON, TP_OFF = 'L P[1] 9mm/sec FINE', 'Touch Offset PR[1]', 'Touch Offset End'
JOB_MOVE, JOB_ON, JOB_OFF = 'MOVL C00001 V=9.0', 'SFTON P001', 'SFTOF'
KRL_MOVE = 'LIN {X 1,Y 2,Z 3,A 0,B 0,C 0}'
UR_MOVE, UR_HOME = 'movel(p[0.3,0.2,0.1,0,3.1,0])', 'movej([0,-1.4,1.6,-1.8,-1.5,0])'
UR_ON, UR_OFF = 'track_conveyor_linear(p[1,0,0,0,0,0], 9)', 'stop_conveyor_tracking()'
JOB_HEAD = (
    '/JOB\n//NAME A\n//POS\n///TOOL 1\n///POSTYPE ROBOT\nC00001=900,0,300,180,0,0\n//INST\nNOP\n'
)
TP_TAIL = (
    '/POS\nP[1]{\n GP1:\n UF : 0, UT : 1,\n X = 900 mm, Y = 0 mm, Z = 300 mm,\n W = 180 deg, '
    'P = 0 deg, R = 0 deg\n};\n/END\n'
)


@pytest.mark.parametrize(
    ('language', 'lines', 'known'),
    [
        ('rapid', [ABB_ON, 'IF a THEN', ABB_OFF, 'ENDIF', ABB_MOVE], [False]),
        ('rapid', [ABB_ON, f'IF a {ABB_OFF}', ABB_MOVE], [False]),
        ('rapid', [ABB_ON, 'IF a THEN', ABB_OFF, 'ELSE', ABB_OFF, 'ENDIF', ABB_MOVE], [True]),
        ('rapid', ['TEST n', 'CASE 1:', ABB_ON, 'DEFAULT:', 'ENDTEST', ABB_MOVE], [False]),
        ('rapid', ['WHILE a DO', ABB_MOVE, ABB_ON, 'ENDWHILE', ABB_OFF, ABB_MOVE], [False, True]),
        ('rapid', ['FOR i FROM 1 TO 3 DO', ABB_ON, ABB_OFF, ABB_MOVE, 'ENDFOR'], [True]),
        ('rapid', ['up:', ABB_MOVE, ABB_ON, 'GOTO up;'], [False]),
        ('rapid', ['up:', ABB_MOVE, 'GOTO up;'], [True]),
        ('rapid', ['sub;', ABB_ON, 'IF a sub;', 'ENDPROC', 'PROC sub()', ABB_MOVE], [False]),
        ('rapid', [ABB_ON, ABB_OFF, 'sub;', 'ENDPROC', 'PROC sub()', ABB_MOVE], [True]),
        (
            'rapid',
            [ABB_ON, 'a;', 'ENDPROC', 'PROC a()', 'sub;', 'ENDPROC', 'PROC sub()', ABB_MOVE],
            [False],
        ),
        ('fanuc-ls', [TP_ON, 'IF (DI[1]=ON) THEN', TP_OFF, 'ENDIF', TP_MOVE], [False]),
        ('fanuc-ls', [TP_ON, 'IF DI[1]=ON,JMP LBL[1]', TP_OFF, 'LBL[1]', TP_MOVE], [False]),
        ('fanuc-ls', [TP_ON, TP_OFF, TP_MOVE], [True]),
        ('fanuc-ls', ['LBL[1:up]', TP_MOVE], [True]),
        ('fanuc-ls', ['L @P[1] 9mm/sec FINE'], [True]),
        ('inform', [JOB_ON, 'IFTHENEXP I001=1', JOB_OFF, 'ENDIF', JOB_MOVE], [False]),
        ('inform', [JOB_ON, 'JUMP *A IF IN#(1)=ON', JOB_OFF, '*A', JOB_MOVE], [False]),
        ('inform', [JOB_ON, JOB_OFF, JOB_MOVE], [True]),
        ('inform', ['*A', JOB_MOVE], [True]),
        (
            'rapid',
            ['CONNECT i WITH t;', ABB_MOVE, 'ENDPROC', 'TRAP t', ABB_ON, 'ENDTRAP', 'PROC b()'],
            [False],
        ),
        ('urscript', [UR_ON, UR_HOME, UR_MOVE], [True, False, False]),
        ('urscript', [UR_ON, UR_OFF, UR_MOVE], [True, True, True]),
        ('urscript', ['path_offset_set(x, 2)', UR_HOME, UR_MOVE], [True, False, False]),
        ('urscript', ['if a:', UR_ON, 'end', UR_MOVE], [True, False]),
        ('urscript', ['def b():', UR_ON, 'end', 'b()', UR_MOVE], [True, False]),
        ('urscript', ['def b():', UR_MOVE, 'end', UR_ON, 'b()'], [False, True]),
        ('urscript', ['def b():', UR_MOVE, 'end', 'b()'], [True]),
        ('fanuc-ls', ['MP Offset PR[1] RPM[1]', TP_MOVE], [False]),
        ('fanuc-ls', ['Track TAST[1]', TP_MOVE, 'Track End', TP_MOVE], [False, True]),
        ('fanuc-ls', ['CALL TRACK_PART', TP_MOVE, f'{TP_MOVE} COORD'], [True, False]),
        ('inform', ['COMARCON ASF#(1)', JOB_MOVE, 'COMARCOF', JOB_MOVE], [False, True]),
        ('rapid', ['SoftAct 2,50;', ABB_MOVE, 'SoftDeact;', ABB_MOVE], [False, True]),
        ('rapid', [ABB_MOVE.replace(';', '\\Corr;'), ABB_MOVE], [False, True]),
        ('krl', ['RET=RSI_ON(#RELATIVE)', KRL_MOVE, 'RET=RSI_OFF()', KRL_MOVE], [False, True]),
    ],
)
def test_a_displacement_holds_wherever_one_of_the_ways_brings_it(language, lines, known):
    head, form, tail = {
        'rapid': (RAPID_SEAM.partition('sub;')[0], '{}\n', 'ENDPROC\nENDMODULE\n'),
        'fanuc-ls': ('/PROG A\n/MN\n', '   1:{} ;\n', TP_TAIL),
        'inform': (JOB_HEAD, '{}\n', 'END\n'),
        'urscript': ('def a():\n', '{}\n', 'end\n'),
        'krl': ('DEF a()\n', '{}\n', 'END\n'),
    }[language]
    text = head + ''.join(form.format(line) for line in lines) + tail
    steps = read(language, (text,), PROGRAMS[language][0]).steps
    assert [not step.shift.why for step in steps] == known


@pytest.mark.parametrize(
    ('language', 'text'),
    [
        (
            'rapid',
            RAPID_SEAM.partition('PROC')[0]
            + 'PERS tooldata t:=[TRUE,[[0,0,9],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\n'
            'PROC weld(PERS tooldata t)\nMoveL p1,v9,fine,t;\nENDPROC\nENDMODULE\n',
        ),
        ('krl', f'DEF a(F:IN)\nFRAME F={FRAME}\n{KRL_LONG}$BASE = F\n{KRL_SEAM}END\n'),
        ('urscript', f'T = p[0,0,0.1,0,0,0]\ndef sub(T):\nset_tcp(T)\n{UR_SEAM}end\n'),
    ],
)
def test_what_a_routine_is_handed_is_not_the_frame_of_that_name(language, text):
    robot = PROGRAMS[language][0]
    own = context(robot, language).controller
    ((move,),) = to_moves(read(language, (text,), robot), wt.load(robot), own).pieces
    assert move.kind == 'unknown'


def test_a_tool_that_stands_still_is_not_that_of_the_robot_file():
    source = (MADE / 'bracket.mod').read_text().replace('[TRUE, [[0,0,250]', '[FALSE, [[0,0,250]')
    robot = wt.load('abb_irb1600')
    torch = robot.T_flange_tool @ transform(np.eye(3), np.array([0.0, 0.0, 0.2]))
    own = controller_of(robot.with_frames(tool=torch), 'rapid')
    program = read('rapid', (source,), 'abb_irb1600')
    moves = [move for piece in to_moves(program, robot, own).pieces for move in piece]
    assert {move.kind for move in moves} == {'unknown'}


@pytest.mark.parametrize(
    ('language', 'tool', 'reason'),
    [
        ('krl', '$TOOL = TOOL_DATA[1]', ''),
        ('krl', '$TOOL = TORCH', ''),
        ('krl', '$TOOL = TOOL_DATA[I]', 'worked out'),
        ('krl', 'BAS(#TOOL, I)', 'worked out'),
        ('krl', '$TOOL = TOOL_DATA[1]:WEAR', 'worked out'),
        ('krl', 'TORCH = BARE:WEAR\n$TOOL = TORCH', 'are set at file0 line 2'),
        ('rapid', 'tTorch', ''),
        ('rapid', 'tTorches{i}', 'worked out'),
        ('rapid', 'CTool()', 'worked out'),
        ('rapid', 'tSet', 'are set at file0 line'),
        ('urscript', 'set_tcp(TCP_1)', ''),
        ('urscript', 'set_tcp(tcps[i])', 'worked out'),
        ('urscript', 'T = tool_of(2)\nset_tcp(T)', 'are set at file0 line 2'),
    ],
)
def test_a_tool_that_is_worked_out_is_not_that_of_the_robot_file(language, tool, reason):
    text = {
        'krl': f'DEF a()\n{tool}\n$BASE = $NULLFRAME\n{KRL_MOVE}\nEND\n',
        'rapid': RAPID_SEAM.partition('sub;')[0]
        + f'tSet := tOther;\nMoveL p1,v9,fine,{tool};\nENDPROC\nENDMODULE\n',
        'urscript': f'def a():\n{tool}\n{UR_MOVE}\nend\n',
    }[language]
    robot = wt.load(PROGRAMS[language][0])
    torch = robot.T_flange_tool @ transform(np.eye(3), np.array([0.0, 0.0, 0.2]))
    own = controller_of(robot.with_frames(tool=torch), language)
    *_, move = to_moves(read(language, (text,), PROGRAMS[language][0]), robot, own).pieces[-1]
    assert (move.kind == 'unknown') == bool(reason) and reason in move.why


@pytest.mark.parametrize(
    ('language', 'line'),
    [
        ('rapid', 'TriggLDPO p10, v100, fine, tTorch;\n'),
        ('rapid', 'MovePnP pElsewhere, v100, fine, tElsewhere;\n'),
        ('rapid', 'SearchL di1, pHere, p10, v10, tTorch;\n'),
        ('rapid', 'EGMRunJoint egm1, EGM_STOP_HOLD;\n'),
        ('urscript', 'servoc(p[0,0,0.1,0,0,0])\n'),
        ('inform', 'SMOVL C00001 V=100.0\n'),
        ('inform', 'SYMOVL C00001 V=100.0 CV#(1)\n'),
        ('inform', 'MOVL C00001 V=100.0\n  +MOVJ C00002 VJ=10.0\n'),
        ('fanuc-ls', '   5:L P[3] 8mm/sec FINE RTCP    ;\n'),
    ],
)
def test_moves_of_another_kind_end_what_is_known(language, line):
    robot, files = PROGRAMS[language]
    source, *beside = [(MADE / name).read_bytes().decode('latin-1') for name in files]
    start = BEFORE[language]
    text = source.replace(start, line + start, 1)
    assert text != source
    before, after = (read(language, (each, *beside), robot).steps for each in (source, text))
    unknown = [
        sum(step.end is None or step.shift.why != '' for step in each) for each in (before, after)
    ]
    assert unknown[1] == unknown[0] + 1


def test_instructions_that_move_nothing_end_nothing():
    source = (MADE / 'bracket.mod').read_text()
    calls = 'TPWrite "at " \\Pos:=p10.trans;\npNow := CRobT(\\Tool:=tTorch);\nVelSet 50, 800;\nRETURN;\n'
    weighed = 'tTorch.tload.mass := 3;\n'
    start = BEFORE['rapid']
    text = source.replace(start, calls + weighed + start, 1)
    program, own = read('rapid', (text,), 'abb_irb1600'), context('abb_irb1600', 'rapid')
    pieces = to_moves(program, own.robot, own.controller).pieces
    assert all(move.kind != 'unknown' for piece in pieces for move in piece)


def test_joints_of_several_axes_beside_a_trajectory_are_no_second_one():
    robot, (name,) = PROGRAMS['joint-trajectory']
    text = (MADE / name).read_text()
    beside = 'multi_dof_joint_trajectory:\n  joint_names: []\n  points: []\n'
    steps = read('joint-trajectory', (beside + text,), robot).steps
    assert len(steps) == len(read('joint-trajectory', (text,), robot).steps) > 1
    with pytest.raises(TwinError, match='several trajectories'):
        read('joint-trajectory', (text + text,), robot)


@pytest.mark.parametrize('line', ['  Foo a,\n', 'a ' + 'x , ' * 9 + '\n', '  a{\n'])
def test_what_ends_no_statement_is_read_in_the_time_of_other_lines(line):
    source = (MADE / 'bracket.mod').read_text().replace('MODULE', line * 20_000 + 'MODULE', 1)
    begin = time.process_time()
    read('rapid', (source,), 'abb_irb1600')
    assert time.process_time() - begin < 20.0  # some seconds; minutes where a statement may go on


def test_places_count_their_lines():
    source = Source('a', 'x\r\ny\n\nz')
    assert [source.line(place) for place in range(7)] == [1, 1, 1, 2, 2, 3, 4]


def test_several_trajectories_in_a_file_are_refused():
    source = (MADE / 'bracket.yaml').read_text()
    with pytest.raises(TwinError, match='several trajectories'):
        read('joint-trajectory', (f'{source}\n---\n{source}',), 'ur5')


@pytest.mark.parametrize('before', ['\xef\xbb\xbf', '# \xc3\x85land, \x85\n', '\xef\xbb\xbf# a\n'])
def test_marks_and_letters_of_other_alphabets_part_no_lines(before):
    source = (MADE / 'bracket.csv').read_text()
    assert len(read('csv', (before + source,), 'ur5').steps) == len(
        read('csv', (source,), 'ur5').steps
    )


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
    program = read('rapid', (text,), 'abb_irb1600')
    (step,) = program.steps
    assert not step.end.leads
    before = np.eye(4) if step.end.before is None else step.end.before
    after = np.eye(4) if step.end.after is None else step.end.after
    place = before @ program.points[step.end.point].value @ after
    np.testing.assert_allclose(place[:3, 3], moved, atol=1e-12)


def test_abb_targets_under_a_displacement_are_not_touched():
    text = (
        'MODULE M\nPROC main()\nPDispOn p5, tool0;\n'
        'MoveJ [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\n'
        'PDispOff;\n'
        'MoveJ [[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\n'
        'ENDPROC\nENDMODULE\n'
    )
    displaced, plain = read('rapid', (text,), 'abb_irb1600').steps
    assert 'displaces' in displaced.shift.why and not plain.shift.why


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
    program = read('fanuc-ls', (text,), 'fanuc_m10ia')
    assert {program.points[k].name for k in program.fixed} == held


@pytest.mark.parametrize(
    ('language', 'place', 'seconds'),
    [('krl', 1, 0.4), ('rapid', 5, 0.3), ('urscript', 1, 0.3), ('inform', 1, 0.3), ('fanuc-ls', 1, 0.3)],
)  # fmt: skip
def test_a_wait_makes_the_move_before_it_last_longer(language, place, seconds):
    robot, files = PROGRAMS[language]
    texts = [(MADE / name).read_bytes().decode('latin-1') for name in files]
    steps = read(language, texts, robot).steps
    assert [step.dwell for step in steps] == [seconds * (k == place) for k in range(len(steps))]
    assert steps[place].stop


KRL_SAID = KRL_MOVE.replace('}', ',E1 0}')


@pytest.mark.parametrize(
    ('language', 'lines', 'held'),
    [
        ('krl', ['PTP {A1 1,A2 2,A3 3,A4 4,A5 5,A6 6,E1 500}', KRL_MOVE, KRL_SAID], [0, 1]),
        ('krl', ['PTP {E1 500}', KRL_MOVE, KRL_SAID], [0]),
        ('krl', ['PTP {A1 1,A2 2,A3 3,A4 4,A5 5,A6 6,A7 7}', KRL_MOVE], [0, 1]),
        ('krl', ['XHOME.E1 = RAIL', KRL_MOVE, KRL_SAID], [0]),
        ('krl', ['PTP {A1 1,A2 2,A3 3,A4 4,A5 5,A6 6,E1 0.0}', KRL_MOVE, KRL_SAID], []),
        ('rapid', ['MoveExtJ rail,v100,fine;', ABB_MOVE], [0, 1]),
        ('rapid', [ABB_MOVE], []),
        ('inform', ['BC00000=500000\n//INST', 'MOVJ BC00000 VJ=9.0', JOB_MOVE], [0]),
        ('inform', ['BC00000=0\n//INST', JOB_MOVE], []),
    ],
)
def test_points_that_do_not_say_where_a_rail_stands_that_moves_are_left(language, lines, held):
    head, tail = {
        'rapid': (RAPID_SEAM.partition('sub;')[0], 'ENDPROC\nENDMODULE\n'),
        'inform': (JOB_HEAD.partition('//INST')[0], 'END\n'),
        'krl': ('DEF a()\n', 'END\n'),
    }[language]
    text = head + ''.join(f'{line}\n' for line in lines) + tail
    assert sorted(read(language, (text,), PROGRAMS[language][0]).fixed) == held


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
    points = [f'DECL {word}POS {name}={KRL_MOVE[4:]}\n' for name, word in where.items()]
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
    assert not read('csv', ('\n'.join(lines),), 'ur5').notes
    head, *rows = lines[1:]
    text = '\n'.join([f'rail,{head}', *(f'{k},{row}' for k, row in enumerate(rows))])
    assert 'the numbers of rail are not read' in read('csv', (text,), 'ur5').notes[0]


def test_a_wait_is_of_its_own_routine_and_one_before_any_move_of_none():
    axes = 'A2 -85.0,A3 100.0,A4 5.0,A5 70.0,A6 -3.0'
    one, two, three = (f'PTP {{A1 {k},{axes}}}\n' for k in (1, 2, 3))
    text = f'DEF a()\n{one}END\nDEF b()\nWAIT SEC 9\n{two}{three}WAIT SEC 1.5\nEND\n'
    steps = read('krl', (text,), 'kuka_kr16_2').steps
    assert [step.dwell for step in steps] == [0.0, 0.0, 1.5]
    assert [step.where for step in steps] == [f'file0 line {k}' for k in (2, 6, 7)]


def test_a_point_that_is_declared_twice_is_refused_with_its_line():
    text = 'MODULE M\n' + 2 * (
        'CONST robtarget p1:=[[1,2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n'
    )
    with pytest.raises(TwinError, match='file0 line 3: p1 is declared twice'):
        read('rapid', (text,), 'abb_irb1600')


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
    robot, names = PROGRAMS[language]
    whole = [(MADE / name).read_bytes().decode('latin-1') for name in names]
    draw, refused = random.Random(language), 0
    for _ in range(FUZZED):
        texts = [broken(text, draw) for text in whole]
        try:
            program = read(language, texts, robot)
        except TwinError as error:
            assert re.search(r'file\d line \d+: ', str(error)), error
            refused += 1
            continue
        points = [point.value.copy() for point in program.points]
        assert rewritten(program, points, range(len(points))) == texts
        for point in points:
            point[..., -1] += [1e-4, -2e-4, 3e-4, 0.0] if point.ndim == 2 else 1e-4
        again = rewritten(program, points, range(len(points)))
        check_written(program, read(language, again, robot), points)
        assert [re.sub(NUMBER, '', t) for t in again] == [re.sub(NUMBER, '', t) for t in texts]
    assert 0.05 * FUZZED < refused < 0.95 * FUZZED
