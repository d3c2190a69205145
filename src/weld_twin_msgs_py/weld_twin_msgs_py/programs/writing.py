# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The writers of new programs, one for every language, and the sheets that go with them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

from ..files.csv_text import guarded
from .controllers import Context, ExternalAxis
from .source import ABB_POSE, KUKA_POSE, UR_POSE


class ExportMove(NamedTuple):
    """One move."""

    kind: Literal['joint', 'linear']  # 'joint' or 'linear'
    q: Array  # joint positions of the model at its end, shape (n,)
    pose: Array  # the tool there, in the controller's robot frame, shape (4, 4) [m]
    speed: float
    """Of the tool [m/s]; of a joint move what its share of joint speed makes of it."""
    share: float  # of the joints' speeds
    stop: bool = True
    dwell: float = 0.0  # [s]
    duration: float = 1.0  # how long it takes [s]
    comment: str = ''


@dataclass(frozen=True, eq=False)
class Exported:
    name: str  # letters, digits and underscores, as all controllers take it
    moves: tuple[ExportMove, ...]
    context: Context
    tool: Array  # on the controller's flange, shape (4, 4) [m]
    trigger: int  # number of the digital output that tells the instrument when to measure
    stations: bool
    """The output is on while the arm stands; else from the first to the last move."""
    comments: tuple[str, ...] = ()

    def joints(self, move: ExportMove) -> list[float]:
        """Return the joints of a move as the controller shows them, degrees or mm."""
        return self.context.degrees().numbers(move.q, [0.0] * self.context.robot.n)

    @property
    def external(self) -> tuple[ExternalAxis, ...]:
        return self.context.controller.external

    def labelled(self, move: ExportMove, own: str) -> dict[str, float]:
        """Return the joints of a move as shown, called ``own`` with a number, then external axes."""
        names = [own.format(k + 1) for k in range(self.context.axes)]
        labels = [*names, *(axis.label for axis in self.external)]
        shown = list(zip(labels, self.joints(move), strict=True))
        return dict(shown[: len(names)] + sorted(shown[len(names) :]))


def comma(values: list[float], digits: int) -> str:
    """Return numbers with commas between, no minus before a zero."""
    return ', '.join(f'{0.0 if abs(v) < 0.5 * 10.0**-digits else v:.{digits}f}' for v in values)


LOADING: dict[str, tuple[str, str, str]] = {
    'urscript': (
        'Copy the file to the controller (USB stick, or SFTP to /programs). Put a Script node with '
        'this file into a program, or send it to port 30002.',
        'Record actual_q over RTDE (port 30004), such as with the RTDE client of Universal Robots, '
        'at 125 Hz or 500 Hz.',
        'digital output {trigger} (standard)',
    ),
    'krl': (
        'Copy the file to KRC:\\R1\\Program (USB stick, or WorkVisual), in the user group Expert.',
        'Record $AXIS_ACT_MEAS with the oscilloscope (trace) of the controller, or over RSI.',
        '$OUT[{trigger}]',
    ),
    'rapid': (
        'Load the module into task T_ROB1 (FlexPendant: Program Editor, or RobotStudio). Define the '
        'signal doTracker{trigger} first, and enter mass and centre of the tool into tMeasured.',
        'Record the joints with Test Signal Viewer, or poll Robot Web Services.',
        'signal doTracker{trigger}',
    ),
    'inform': (
        'Load the job from a USB stick (EX. MEMORY, LOAD, JOB). Tool 0 must hold the numbers below. '
        'Compare one point in the job with the pulses that the pendant shows.',
        'Record pulses over the Ethernet server (HSES), or with MotoROS2.',
        'OT#({trigger})',
    ),
    'fanuc-ls': (
        'Load the file from a USB stick or by FTP. A .ls needs the option ASCII Upload; without it, '
        'translate it to .tp with MakeTP of RoboGuide. UTOOL 1 must hold the numbers below.',
        'Record the joints with the data monitor, or over the stream motion or PC interface.',
        'DO[{trigger}]',
    ),
    'joint-trajectory': (
        'ros2 topic pub --once /TOPIC trajectory_msgs/msg/JointTrajectory "$(cat FILE)", or read the '
        'file in a node of yours. Send the arm to the first point before.',
        'ros2 bag record /joint_states, and the poses of the instrument.',
        'no output: a trajectory has none; measure by time',
    ),
    'csv': (
        'A table: one line is one move. Bring it into your own software.',
        'Record joint positions with their stamps.',
        'no output: a table has none',
    ),
}
"""For every language: how to load a program, how to record joints, what triggers the instrument."""


def sheet(program: Exported, language: str, file: str, speeds: str, notes: Sequence[str]) -> str:
    load, record, output = (text.format(trigger=program.trigger) for text in LOADING[language])
    when = 'while the arm stands' if program.stations else 'from the first to the last move'
    minutes = sum(m.duration + m.dwell for m in program.moves) / 60.0
    x, y, z = program.tool[:3, 3] * 1e3
    parts = [
        f'# {file}',
        f'{len(program.moves)} moves, about {minutes:.1f} minutes. {speeds}',
        '\n'.join(f'- {text}' for text in program.comments),
        f'## Load it\n\n{load}',
        f'The tool must be {x:.3f} {y:.3f} {z:.3f} mm from the flange, as in the robot file.',
        '## Run it first',
        '1. Check every point for collisions: the file knows the arm, not your cell.\n'
        '2. Run it in manual mode at reduced speed, with a hand on the enabling switch.\n'
        '3. Only then run it in automatic mode and record.',
        '\n'.join(f'- {note}' for note in notes),
        f'## Record\n\n{record}',
        f'The instrument measures at: {output}, on {when}.',
        'Bring joints and measured positions into one table, a column for every joint and x, y, z,\n'
        'and read it with `weld-twin import TABLE.csv --robot ROBOT --out BAG`.\n',
    ]
    return '\n\n'.join(filter(None, parts))


BLEND = 1e-3
"""Corners are rounded within this much [m] where the arm goes on."""
SETTLE = 0.3
"""Time [s] between the stop and the trigger."""
UR_ACCELERATION = (0.5, 0.3)
"""Of joint moves [rad/s^2] and of the tool [m/s^2], a fraction of what the manual has."""


def written(program: Exported, language: str) -> str:
    return WRITERS[language](program)


def _urscript(program: Exported) -> str:
    rows = [f'def {program.name}():', *(f'  # {text}' for text in program.comments)]
    rows.append(f'  set_tcp(p[{comma(UR_POSE.numbers(program.tool, [0.0] * 7), 7)}])')
    on, off = (f'  set_digital_out({program.trigger}, {word})' for word in ('True', 'False'))
    fastest = float(program.context.robot.planned_velocity.max())
    old = [0.0] * 7

    def move(_: int, step: ExportMove) -> list[str]:
        nonlocal old
        radius = 0.0 if step.stop else BLEND
        if step.kind == 'joint':
            target = f'[{comma(step.q.tolist(), 7)}]'
            speed = f'a={UR_ACCELERATION[0]}, v={step.share * fastest:.4f}'
            return [f'  movej({target}, {speed}, r={radius:g})']
        old = UR_POSE.numbers(step.pose, old)
        speed = f'a={UR_ACCELERATION[1]}, v={step.speed:.4f}'
        return [f'  movel(p[{comma(old, 7)}], {speed}, r={radius:g})']

    rows += _body(program, move, on, off, lambda s: f'  sleep({s:.2f})', '  # {}')
    return '\n'.join([*rows, 'end', ''])


def _krl(program: Exported) -> str:
    rows = ['&ACCESS RVP', '&REL 1', f'DEF {program.name}( )']
    rows += [f'; {text}' for text in program.comments]
    rows += [
        ';FOLD INI',
        'GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM ( )',
        'INTERRUPT ON 3',
        'BAS (#INITMOV,0 )',
        ';ENDFOLD (INI)',
        '$BASE = $NULLFRAME',
        f'$TOOL = {{FRAME: {_krl_pose(KUKA_POSE.numbers(program.tool, [0.0] * 6))}}}',
        f'$APO.CDIS = {BLEND * 1e3:.1f}',
    ]
    share = speed = -1.0
    old = [0.0] * 6

    def move(_: int, step: ExportMove) -> list[str]:
        nonlocal share, speed, old
        out = []
        if step.kind == 'joint':
            if abs(step.share - share) > 5e-4:
                share = step.share
                out.append(f'BAS(#VEL_PTP,{100.0 * share:.3f})')
            values = (f'{n} {v:.5f}' for n, v in program.labelled(step, 'A{}').items())
            return [*out, f'PTP {{{",".join(values)}}}' + ('' if step.stop else ' C_PTP')]
        if abs(step.speed - speed) > 1e-6:
            speed = step.speed
            out.append(f'$VEL.CP = {speed:.5f}')
        old = KUKA_POSE.numbers(step.pose, old)
        target = f'LIN {{{_krl_pose(old)}}}'
        return [*out, target + ('' if step.stop else ' C_DIS')]

    on, off = (f'$OUT[{program.trigger}] = {word}' for word in ('TRUE', 'FALSE'))
    rows += _body(program, move, on, off, lambda s: f'WAIT SEC {s:.2f}', '; {}')
    return '\r\n'.join([*rows, 'END', ''])


def _krl_pose(values: list[float]) -> str:
    parts = [*comma(values[:3], 4).split(', '), *comma(values[3:], 5).split(', ')]
    return ','.join(f'{name} {part}' for name, part in zip('XYZABC', parts, strict=True))


def _rapid(program: Exported) -> str:
    away = '[9E9,9E9,9E9,9E9,9E9,9E9]'
    rows = [f'MODULE {program.name}', *(f'  ! {text}' for text in program.comments)]
    old = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    position, turn = _rapid_pose(ABB_POSE.numbers(program.tool, old))
    load = '[0.001,[0,0,0.001],[1,0,0,0],0,0,0]'
    rows += [
        f'  PERS tooldata tMeasured := [TRUE,[{position},{turn}],{load}];',
        '  PROC main()',
        '    ConfJ \\On;',
        '    ConfL \\Off;',
    ]

    def move(_: int, step: ExportMove) -> list[str]:
        nonlocal old
        zone = 'fine' if step.stop else 'z1'
        speed = f'[{max(step.speed * 1e3, 1.0):.2f},50,50,50]'
        if step.kind == 'joint':
            values = program.labelled(step, 'rax_{}')
            own = [v for name, v in values.items() if name.startswith('rax')]
            places = (values.get(f'eax_{letter}') for letter in 'abcdef')
            outer = ','.join('9E9' if v is None else comma([v], 5) for v in places)
            target = f'[[{comma(own, 5)}],[{outer}]]'
            return [f'    MoveAbsJ {target}, {speed}, {zone}, tMeasured;']
        old = ABB_POSE.numbers(step.pose, old)
        position, turn = _rapid_pose(old)
        q = np.degrees(step.q)
        conf = ','.join(f'{np.floor(q[k] / 90.0) + 0.0:.0f}' for k in (0, 3, 5)) + ',0'
        target = f'[{position},{turn},[{conf}],{away}]'
        return [f'    MoveL {target}, {speed}, {zone}, tMeasured;']

    on, off = (f'    SetDO doTracker{program.trigger}, {word};' for word in '10')
    wait = '    WaitTime \\InPos, {:.2f};'
    rows += _body(program, move, on, off, lambda s: wait.format(s), '    ! {}')
    return '\n'.join([*rows, '  ENDPROC', 'ENDMODULE', ''])


def _rapid_pose(values: list[float]) -> tuple[str, str]:
    return (f'[{comma(values[:3], 4)}]', f'[{comma(values[3:], 8)}]')


def _inform(program: Exported) -> str:
    pulses = program.context.pulses_per_degree
    if pulses is None:
        raise DataError(
            'a job of Yaskawa has its points in pulses; give --pulses-per-degree, as the '
            'parameters of the controller have it'
        )
    rows = ['/JOB', f'//NAME {program.name[:32].upper()}', '//POS']
    rows += [
        f'///NPOS {len(program.moves)},0,0,0,0,0',
        '///TOOL 0',
        '///POSTYPE PULSE',
        '///PULSE',
    ]
    for k, step in enumerate(program.moves):
        values = np.round(np.array(program.joints(step)) * pulses)
        rows.append(f'C{k:05d}=' + ','.join(f'{v:.0f}' for v in values + 0.0))
    rows += ['//INST', '///DATE 2000/01/01 00:00', '///ATTR SC,RW', '///GROUP1 RB1', 'NOP']
    rows += [f"'{text[:32]}" for text in program.comments]

    def move(k: int, step: ExportMove) -> list[str]:
        level = ' PL=0' if step.stop else ' PL=1'
        if step.kind == 'joint':
            return [f'MOVJ C{k:05d} VJ={max(100.0 * step.share, 0.01):.2f}{level}']
        return [f'MOVL C{k:05d} V={max(step.speed * 1e3, 0.1):.1f}{level}']

    on, off = (f'DOUT OT#({program.trigger}) {word}' for word in ('ON', 'OFF'))
    rows += _body(program, move, on, off, lambda s: f'TIMER T={s:.2f}', "'{}")
    return '\r\n'.join([*rows, 'END', ''])


def _fanuc(program: Exported) -> str:
    body: list[str] = [f'!{text[:32]}' for text in program.comments]
    body += ['UFRAME_NUM=0', 'UTOOL_NUM=1']

    def move(k: int, step: ExportMove) -> list[str]:
        end = 'FINE' if step.stop else 'CNT5'
        if step.kind == 'joint':
            return [f'J P[{k + 1}] {max(round(100.0 * step.share), 1)}% {end}']
        return [f'L P[{k + 1}] {max(step.speed * 1e3, 1.0):.0f}mm/sec {end}']

    on, off = (f'DO[{program.trigger}]={word}' for word in ('ON', 'OFF'))
    body += _body(program, move, on, off, lambda s: f'WAIT {s:6.2f}(sec)', '!{}')
    rows = [f'/PROG  {program.name[:32].upper()}', '/ATTR', 'OWNER\t\t= MNEDITOR;']
    rows += [f'LINE_COUNT\t= {len(body)};', 'PROTECT\t\t= READ_WRITE;']
    further = {axis.label[:3] for axis in program.external if axis.label[0] == 'G'}
    groups = ','.join('1' if f'GP{k}' in further or k == 1 else '*' for k in range(1, 6))
    rows += [f'DEFAULT_GROUP\t= {groups};', 'CONTROL_CODE\t= 00000000 00000000;', '/MN']
    for k, text in enumerate(body, start=1):
        motion = text.startswith(('J P[', 'L P['))
        rows.append(f'{k:4d}:{text}    ;' if motion else f'{k:4d}:  {text} ;')
    rows.append('/POS')
    for k, step in enumerate(program.moves, start=1):
        rows += [f'P[{k}]{{', *_fanuc_groups(program, step), '};']
    return '\r\n'.join([*rows, '/END', ''])


def _fanuc_groups(program: Exported, step: ExportMove) -> list[str]:
    """Return the joints of a point, group by group; extended axes are of the arm's group."""
    robot = program.context.robot
    slides = {axis.label for axis in program.external if robot.prismatic[axis.joint]}
    of: dict[str, list[str]] = {'GP1': []}
    for label, value in program.labelled(step, 'J{}').items():
        group, _, name = label.rpartition('.')
        unit = 'mm' if label in slides else 'deg'
        of.setdefault(group or 'GP1', []).append(f'{name}= {value:9.3f} {unit}')
    rows = []
    for group, values in sorted(of.items()):
        lines = [',\t'.join(values[i : i + 3]) for i in range(0, len(values), 3)]
        rows += [f'   {group}:', '\tUF : 0, UT : 1,\t', *(f'\t{line},' for line in lines[:-1])]
        rows.append(f'\t{lines[-1]}')
    return rows


def _trajectory(program: Exported) -> str:
    rows = [f'# {text}' for text in program.comments]
    rows += ['joint_names:', *(f'- {name}' for name in program.context.robot.joint_names)]
    rows.append('points:')
    clock = 0.0
    for k, step in enumerate(program.moves):
        clock += step.duration if k else 0.0
        rows += _trajectory_point(step, clock)
        if step.dwell > 0.0:
            clock += step.dwell
            rows += _trajectory_point(step, clock)
    return '\n'.join([*rows, ''])


def _trajectory_point(step: ExportMove, clock: float) -> list[str]:
    whole, part = divmod(round(clock * 1e9), 10**9)
    return [
        f'- positions: [{comma(step.q.tolist(), 9)}]',
        f'  time_from_start: {{sec: {whole}, nanosec: {part}}}',
    ]


def _csv(program: Exported) -> str:
    rows = [f'# {text}' for text in program.comments]
    names = map(guarded, program.context.robot.joint_names)
    rows.append(','.join(['move', *names, 'speed', 'dwell']))
    for step in program.moves:
        speed = step.share if step.kind == 'joint' else step.speed
        dwell = max(step.dwell, 0.001) if step.stop else 0.0
        values = comma(step.q.tolist(), 9).replace(' ', '')
        rows.append(f'{step.kind},{values},{speed:.5f},{dwell:.3f}')
    return '\n'.join([*rows, ''])


def _body(
    program: Exported,
    move: Callable[
        [int, ExportMove], list[str]
    ],  # takes the number of a move, from 0, and the move
    on: str,
    off: str,
    wait: Callable[[float], str],
    remark: str,
) -> list[str]:
    rows: list[str] = []
    for k, step in enumerate(program.moves):
        rows += [remark.format(step.comment)] if step.comment else []
        rows += move(k, step)
        if program.stations and step.dwell > 0.0:
            rows += [wait(SETTLE), on, wait(step.dwell), off]
        elif not program.stations and k == 0:
            rows += [wait(SETTLE), on, wait(max(step.dwell, SETTLE))]
        elif step.dwell > 0.0:
            rows.append(wait(step.dwell))
    return rows if program.stations else [*rows, wait(SETTLE), off]


WRITERS: dict[str, Callable[[Exported], str]] = {
    'urscript': _urscript,
    'krl': _krl,
    'rapid': _rapid,
    'inform': _inform,
    'fanuc-ls': _fanuc,
    'joint-trajectory': _trajectory,
    'csv': _csv,
}
"""By the names that ``--controller`` takes."""
