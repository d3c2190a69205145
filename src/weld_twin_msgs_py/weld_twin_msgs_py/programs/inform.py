# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
INFORM of Yaskawa: a job, ``.jbi``, with its points before its instructions.

Points are ``C00000=...`` in pulses (``///POSTYPE PULSE``) or in mm and degrees. Three ``MOVC`` after
each other are an arc: the first is where it begins. Speeds ``V=`` are mm/s, ``VJ=`` per cent. Pulses
are turned into degrees by numbers that only the controller has: ``--pulses-per-degree``.

References
----------
.. [1] Yaskawa Motoman, "DX100 Options, Instructions for Data Transmission Function", HW0482494,
   4.1 Job data format; "INFORM Header Fields", knowledge.motoman.com.

"""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from weld_twin_core.errors import DataError
from weld_twin_core.motion.programs.travel import Kind

from .build import TURNS, Program, Ref, Step, flags_kept
from .controllers import Context, Frame
from .reader import LEAST_SPEED, Blocks, Handler, Reader, unclear_shift
from .source import YASKAWA_POSE, Notation, Number, Source

_NAMED = re.compile(r'^//NAME[ \t]+([^\r\n]*\S)', re.M)
_HEAD = re.compile(r'^///(\w+)(?:[ \t]+([^\r\n]*))?', re.M)
_POINT = re.compile(r'^(B?P|B?C|EC|EX)(\d+)[ \t]*=[ \t]*([^\r\n]*)', re.M)
_MOVE = re.compile(r'^[ \t]*(\+?[A-Z]*MOV[A-Z]*)\b[ \t]*([^\r\n]*)', re.M)
"""Also moves that go along with another robot, a positioner or a conveyor: SMOVL, EMOVL, SYMOVL."""
_SHIFT = re.compile(r'^[ \t]*(?:(SFTON|COMARCON)|(SFTOF|COMARCOF)|MULMAT|GETPOS|SETUALM)\b', re.M)
"""What shifts moves or lets them follow a sensor, and what ends that; others part an arc."""
_BLOCK = re.compile(
    r'^[ \t]*(?:(IF(?=THEN)|WHILE|FOR|SWITCH)|(ELSE(?:IF)?|CASE|DEFAULT)|(END(?:IF|WHILE|SWITCH)|NEXT)'
    r')(?:THEN)?(?:EXP)?\b',
    re.M,
)
"""Where the job branches or goes round, another branch, and where they come together."""
_LABEL = re.compile(r'^[ \t]*\*\w', re.M)
_FRAME_SET = re.compile(r'^[ \t]*(?:MFRAME|SETTOOL)[ \t]+(UF|TL)#\((\d*)', re.M)
_TIMER = re.compile(r'^[ \t]*TIMER[ \t]+T=([^\s]+)', re.M)
_KINDS: dict[str, Kind] = {'MOVJ': 'joint', 'MOVL': 'linear', 'MOVC': 'circular'}
SPEED, JOINT_SPEED = 0.1, 0.1
"""m/s, and share of full speed, where a move does not say."""
FLAGS = (*TURNS, (4, 0.5, 1.0))
"""Of RCONF; the wrist counts as flipped by the side on which axis 4 is, which changes at 90 degrees."""
POSTURE = 3
"""First flags of RCONF, for wrist, elbow and side; those behind count turns."""
CM_PER_MIN = 0.01 / 60.0
"""m/s of a speed in cm/min, as ``V=50cm/min`` has it on arc welding controllers."""


class InformReader(Reader):
    """Goes through a job once."""

    comments, routine, call = (r"'[^\r\n]*",), _NAMED, r'\bCALL[ \t]+JOB:({})(?![\w-])'

    def __init__(self, sources: Sequence[Source], context: Context) -> None:
        super().__init__(sources, context)
        self.points: dict[str, int] = {}
        self.frames: dict[int, tuple[Frame, Frame]] = {}
        self.tool, self.base, self.form = Frame(''), Frame('', np.eye(4)), 'PULSE'
        self.user = self.flags = ''
        self.config: dict[int, str] = {}
        self.blocks = Blocks(self.program, shift=unclear_shift)
        self.arc: list[Step] = []

    def read(self) -> Program:
        self.numbered_set(_FRAME_SET)
        result = re.search(r'^//INST\b', self.text, re.M)
        cut = len(self.text) if result is None else result.start()
        self.in_order({_HEAD: self._head, _POINT: self._point}, 0, cut)
        found: dict[re.Pattern[str], Handler] = {
            _MOVE: self._move,
            _SHIFT: self._shift,
            _TIMER: self._timer,
            _BLOCK: self._block,
        }
        calls = self.calls(self.routines_named(), _displaces)
        shifts = calls or any(match[1] for match in _SHIFT.finditer(self.text))
        labels = {_LABEL: self._label} if shifts else {}
        self.in_order(found | labels, cut, more=[(self.displacing, calls)])
        self._close_arc()
        return self.program

    def _head(self, result: re.Match[str]) -> None:
        word, value = result[1].upper(), (result[2] or '').strip()
        if word == 'TOOL':
            self.tool = self.numbered('TL', value)
        elif word == 'USER':
            self.user = value
        elif word == 'RCONF':
            self.flags = ','.join(value.split(',')[:POSTURE])
        elif word == 'POSTYPE':
            self.form = value.upper()
        named = self.numbered('UF', self.user or 'USER')
        self.base = named if self.form == 'USER' else Frame('', np.eye(4))

    def _point(self, result: re.Match[str]) -> None:
        if result[1] == 'BC' and re.search('[1-9]', result[3]):
            self.program.beside = self.program.beside or self.where(result)
        if result[1] != 'C':
            return  # Variables and other axes: a move that uses them is not understood.
        name = f'C{int(result[2]):05d}'
        where = self.where(result)
        if name in self.points:
            raise DataError(f'{where}: {name} is defined twice')
        parts = self.pieces(*result.span(3))
        notation = self._notation(where)
        numbers = [self.number(*part, f'a coordinate of {name}') for part in parts]
        count = self.context.robot.n if notation.joints else 6
        if len(numbers) < count:
            raise DataError(f'{where}: {name} needs {count} numbers, it has {len(numbers)}')
        self.points[name] = self._added(name, numbers, count, notation)
        self.frames[self.points[name]] = self.tool, self.base
        self.config[self.points[name]] = self.flags

    def _added(self, name: str, numbers: list[Number], count: int, notation: Notation) -> int:
        point = self.program.add_point(name, numbers[:count], notation)
        self.program.stands_beside(point, [number.value for number in numbers[count:]])
        return point

    def _notation(self, where: str) -> Notation:
        if self.form in ('USER', 'BASE', 'ROBOT'):
            return YASKAWA_POSE
        if self.form != 'PULSE':
            raise DataError(f'{where}: positions of type {self.form} are not understood')
        pulses = self.context.pulses_per_degree
        if pulses is None:
            raise DataError(
                f'{where}: positions are in pulses; give --pulses-per-degree, as the parameters '
                'of the controller have it, or export the job as a relative job'
            )
        unit = np.radians(1.0 / pulses)
        return self.context.shown(unit, 0, 'pulses')

    def _timer(self, result: re.Match[str]) -> None:
        self._close_arc()
        self.dwell(result.span(1))

    def _shift(self, result: re.Match[str]) -> None:
        self._close_arc()
        if result[1]:
            self.shift = Frame('', why=f'{result[1]} at {self.where(result)} shifts it')
        elif result[2]:
            self.shift = Frame('')

    def _label(self, result: re.Match[str]) -> None:
        self._close_arc()
        self.shift = unclear_shift(self.where(result))

    def _block(self, result: re.Match[str]) -> None:
        self._close_arc()
        (self.shift,) = self.blocks.follow(self.where(result), result.groups(), (self.shift,))

    def _move(self, result: re.Match[str]) -> None:
        word, rest = result[1], result[2]
        where, kind = self.where(result), _KINDS.get(result[1], 'linear')
        if kind != 'circular':
            self._close_arc()
        named = re.match(r'C(\d+)\b', rest)
        point = None if named is None else self.points.get(f'C{int(named[1]):05d}')
        other = re.search(r'(?<![A-Z])(?:BC|EC|BP|EX)\d+|\+MOV', rest)
        what = rest.split()[0] if rest.split() else 'nothing'
        why = f'{word} to {what!r} is not understood'
        if point is None:
            self._close_arc()
            self.unknown(kind, result, why)
            return
        step = self._step(kind, where, point, rest)
        if word not in _KINDS or other:
            self._close_arc()
            self.program.add(replace(step, kind='linear', shift=Frame('', why=why)))
            return
        if kind == 'circular':
            self.arc.append(step)
        else:
            self.program.add(step)

    def _close_arc(self) -> None:
        """Add the arc of the MOVC so far: where it begins, what it passes, where it ends."""
        arc, self.arc = self.arc, []
        if not arc:
            return
        if len(arc) != 3:
            why = f'{len(arc)} MOVC after each other are not understood, an arc has 3'
            for step in arc:
                self.program.add(replace(step, kind='linear', shift=Frame('', why=why)))
            return
        first, middle, last = arc
        self.program.add(replace(first, kind='linear'))
        self.program.add(replace(last, via=middle.end, where=middle.where))

    def _step(self, kind: Kind, where: str, point: int, rest: str) -> Step:
        level = re.search(r'\bPL=(\d+)', rest)
        tool, base = self.frames[point]
        why = self.another_posture(kind, point, self.config[point])
        return Step(
            kind,
            where,
            Ref(point),
            None,
            tool,
            base,
            _speed(kind, rest),
            level is not None and level[1] == '0',
            astray=flags_kept(kind, self.program.points[point], FLAGS),
            shift=Frame('', why=why) if why else self.shift,
        )


def _displaces(text: str) -> bool:
    """Return whether points are displaced after a job, by its text."""
    last = [bool(match[1]) for match in _SHIFT.finditer(text) if match[1] or match[2]][-1:]
    return any(last)


def _speed(kind: Kind, rest: str) -> float:
    joint = re.search(r'\bVJ=([\d.]+)', rest)
    straight = re.search(r'\bV=([\d.]+)(cm/min|mm/sec|cm/m)?', rest)
    try:
        if kind == 'joint':
            return JOINT_SPEED if joint is None else max(float(joint[1]) / 100.0, LEAST_SPEED)
        if straight is None:
            return SPEED
        unit = CM_PER_MIN if (straight[2] or '').startswith('cm') else 1e-3
        return max(float(straight[1]) * unit, LEAST_SPEED)
    except ValueError:
        return SPEED
