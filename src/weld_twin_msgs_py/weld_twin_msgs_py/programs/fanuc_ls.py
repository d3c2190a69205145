# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
TP programs of FANUC as text, ``.ls``: instructions under ``/MN``, points under ``/POS``.

Points are in mm with W P R, or in joints, J3 counted from the ground. Every point names its user
frame UF (0 is the robot's own) and its tool frame UT. FANUC writes thousandths.

References
----------
.. [1] TP programs in public backups of cells (repositories JuniorNatalin/VASC and
   Creearc/welding_project); "Common robot data formats", docs.transfertech.cn: W P R.

"""

import re
from collections.abc import Sequence

import numpy as np

from weld_twin_core.errors import DataError
from weld_twin_core.motion.programs.travel import Kind

from .build import TURNS, WRIST, Program, Ref, Step, flags_kept
from .controllers import Context, Frame
from .reader import LEAST_SPEED, Blocks, Reader, same_frame, unclear_shift
from .source import FANUC_POSE, NUMBER, Notation, Number, Source, closing

POSE_KEYS = ('X', 'Y', 'Z', 'W', 'P', 'R')
_NAMED = re.compile(r'^/PROG[ \t]+([\w-]+)', re.M)
_PART = re.compile(r'^/(MN|POS|END)\b', re.M)
_POINT = re.compile(r'^[ \t]*P\[\s*(\d+)\s*(?::[^\]\r\n]*)?\]\s*(\{)', re.M)
_STATEMENT = re.compile(r'^[ \t]*(\d*)[ \t]*:[ \t]*([^;]*);', re.M)
_MOVE = re.compile(r'^([JLCAS])[ \t]+@?(P|PR)\[\s*([^\]]*)\](.*)', re.S)
_NEXT = re.compile(r'^\s*:?\s*@?(P|PR)\[\s*([^\]]*)\](.*)', re.S)
_INDEX = re.compile(r'(\d+)\s*(?::.*)?\Z', re.S)
_KINDS: dict[str, Kind] = {'J': 'joint', 'L': 'linear', 'C': 'circular'}
_SHIFTING = re.compile(
    r'\b(?:Tool_)?Offset\b|\bINC\b|\bVOFFSET\b|\bTOUCH|\bPTH_|\bRTCP\b|\bTA_REF\b', re.I
)
"""What lets a move go elsewhere; RTCP is a tool that stands still."""
_DISPLACING = re.compile(
    r'(?:\A|:[ \t]*)(?:(?:Touch|MP) Offset|Track|SOFTFLOAT)\b ?(End\b)?', re.I
)
"""What shifts moves, lets them follow a sensor or give way, and what ends that."""
_CONFIG = re.compile(r"\bCONFIG\s*:\s*'([A-Z ]*)")
_IN_PLACE = re.compile(r'(?:!|//|\Z|(?:[DRGA]O|R)\[|(?:WAIT|Arc|Weld)\b)')
"""Statements in which no arm moves, and which are no other line's aim."""
_COORD = re.compile(r'\bCOORD\b')
_TRACKING = re.compile(r'^[ \t]*LINE_TRACK_SCHEDULE_NUMBER[ \t]*:[ \t]*[1-9]', re.M)
"""Head of a program whose points move with a conveyor; the schedule 0 is none."""
_BLOCK = re.compile(r'(?:(IF(?=\b.*\bTHEN\Z)|FOR)\b|(ELSE)\Z|(END(?:IF|FOR))\Z|(LBL)\[)', re.S)
"""Where the program branches or goes round, another branch, where they come together; a label."""
_FRAME_SET = re.compile(r':[ \t]*(UFRAME|UTOOL)\[\s*(\d*)(?!\d)[^=\r\n]*=')
_SPEED = re.compile(r'([\d.]+)[ \t]*(%|mm/sec|cm/min|inch/min|deg/sec|sec|msec)')
_UNITS = {'mm/sec': 1e-3, 'cm/min': 0.01 / 60.0, 'inch/min': 0.0254 / 60.0}
SPEED = 0.1
"""m/s, and share of full speed, where a speed stands in a register."""


class FanucReader(Reader):
    """Goes through a program once."""

    comments, routine, call = (r'"[^"\r\n]*"',), _NAMED, r'\bCALL[ \t]+({})(?![\w-])'

    def __init__(self, sources: Sequence[Source], context: Context) -> None:
        super().__init__(sources, context)
        self.points: dict[int, int] = {}
        self.frames: dict[int, tuple[Frame, Frame]] = {}
        self.untaught: dict[int, str] = {}
        self.config: dict[int, str] = {}
        self.blocks = Blocks(self.program, shift=unclear_shift)
        self.still = False
        """Whether nothing since the last move moves the arm, and no other line leads here."""

    def read(self) -> Program:
        parts = {result[1]: result.start() for result in _PART.finditer(self.text)}
        moves, points = parts.get('MN', 0), parts.get('POS', len(self.text))
        self.numbered_set(_FRAME_SET)
        for result in _POINT.finditer(self.text, points):
            self._point(result)
        calls = self.calls(self.routines_named(), _displaces)
        self.in_order({_STATEMENT: self._statement}, moves, points, [(self.displacing, calls)])
        self._refuse_open(moves, points)
        self.shift_all(_TRACKING, 'it goes along with the conveyor of {}')
        return self.program

    def _refuse_open(self, start: int, end: int) -> None:
        """Refuse a move that no semicolon ends: what it says would be lost."""
        rest = _STATEMENT.sub(lambda result: ' ' * len(result[0]), self.text[start:end])
        lost = re.search(r'^[ \t]*\d+[ \t]*:[ \t]*[JLCAS][ \t]+PR?\[', rest, re.M)
        if lost is not None:
            where = self.source.where(start + lost.start())
            raise DataError(f'{where}: the move is not closed by ;')

    # Points ----------------------------------------------------------------------------------

    def _point(self, result: re.Match[str]) -> None:
        index, where = int(result[1]), self.where(result)
        if index in self.points or index in self.untaught:
            raise DataError(f'{where}: P[{index}] is defined twice')
        end = closing(self.source, self.text, result.start(2))
        groups = [m.start() for m in re.finditer(r'\bGP\d+\s*:', self.text[result.end() : end])]
        first = result.end() + groups[0] if groups else result.end()
        last = result.end() + groups[1] if len(groups) > 1 else end
        fields = self._fields(first, last, index)
        if fields is None:
            self.untaught[index] = f'P[{index}] is not taught'
            return
        fields, starred = self._with_groups(fields, last, end, index)
        keys, notation = self._form(fields, where, index)
        if self.context.controller.external and not notation.joints:
            self.untaught[index] = (
                f'P[{index}] is in X Y Z, and what that frame goes along with is not in the program; '
                'teach it as joints'
            )
            return
        point = self.program.add_point(f'P[{index}]', [fields[k] for k in keys], notation)
        self.points[index] = point
        self.frames[point] = self._frames(first, last, where)
        config = _CONFIG.search(self.text, first, last)
        self.config[point] = '' if config is None else ' '.join(config[1].replace(' ', ''))
        known = [axis.label for axis in self.context.controller.external]
        outer = [key for key in fields if key[0] in 'EG' and key not in known]
        self.program.stands_beside(point, [1.0] * starred + [fields[key].value for key in outer])

    def _with_groups(
        self, fields: dict[str, Number], start: int, end: int, index: int
    ) -> tuple[dict[str, Number], bool]:
        """Return the fields of all groups, of further ones as GP2.J1, and whether one is not taught."""
        out, starred = dict(fields), False
        heads = list(re.finditer(r'\b(GP\d+)\s*:', self.text[start:end]))
        for k, head in enumerate(heads):
            last = start + heads[k + 1].start() if k + 1 < len(heads) else end
            group = self._fields(start + head.end(), last, index)
            starred |= group is None
            out |= {f'{head[1]}.{key}': number for key, number in (group or {}).items()}
        return out, starred

    def _fields(self, start: int, end: int, index: int) -> dict[str, Number] | None:
        fields: dict[str, Number] = {}
        for result in re.finditer(r'\b(J\d|E\d|[XYZWPR])\s*=\s*([^\s,]+)', self.text[start:end]):
            key, place = result[1], (start + result.start(2), start + result.end(2))
            if result[2].startswith('*'):
                return None
            if key in fields:
                where = self.source.where(place[0])
                raise DataError(f'{where}: {key} of P[{index}] is given twice')
            fields[key] = self.number(*place, f'{key} of P[{index}]')
        return fields

    def _form(
        self, fields: dict[str, Number], where: str, index: int
    ) -> tuple[tuple[str, ...], Notation]:
        external = [axis.label for axis in self.context.controller.external]
        axes = (*(f'J{k + 1}' for k in range(self.context.axes)), *external)
        for keys, notation in ((POSE_KEYS, FANUC_POSE), (axes, self.context.degrees(3))):
            if all(key in fields for key in keys):
                return keys, notation
        raise DataError(f'{where}: P[{index}] needs X Y Z W P R, or {", ".join(axes)}')

    def _frames(self, start: int, end: int, where: str) -> tuple[Frame, Frame]:
        result = re.search(r'\bUF\s*:\s*(\w+)\s*,\s*UT\s*:\s*(\w+)', self.text[start:end])
        if result is None:
            raise DataError(f'{where}: a point needs UF and UT')
        user, tool = result[1], result[2]
        base = Frame('', np.eye(4)) if user == '0' else self.numbered('UFRAME', user)
        return self.numbered('UTOOL', tool), base

    def numbered(self, table: str, index: str) -> Frame:
        """Return a frame of a table; F is the one that holds when the move runs."""
        why = f'{table} F is whichever {table}_NUM says when the move runs'
        return Frame(index, why=why) if index == 'F' else super().numbered(table, index)

    # Moves -----------------------------------------------------------------------------------

    def _statement(self, result: re.Match[str]) -> None:
        text, where = result[2].strip(), self.where(result, 2)
        wait = re.match(rf'WAIT\s+({NUMBER})\s*\(sec\)', text)
        if wait is not None:
            self.program.dwell(max(float(wait[1]), 0.0))
        offset = _DISPLACING.match(text)
        if offset is not None:
            self.shift = Frame(
                '', why='' if offset[1] else f'{offset[0].strip()} at {where} shifts it'
            )
        block = _BLOCK.match(text)
        if block is not None and block[4] and _DISPLACING.search(self.text):
            self.shift = unclear_shift(where)
        elif block is not None and not block[4]:
            (self.shift,) = self.blocks.follow(where, block.groups()[:3], (self.shift,))
        move = _MOVE.match(text)
        self._hold_used(text, where, move is not None)
        if move is None:
            self.still &= _IN_PLACE.match(text) is not None
        else:
            self._move(move, where)
            self.still = True

    def _move(self, move: re.Match[str], where: str) -> None:
        kind, via = _KINDS.get(move[1], 'linear'), None
        name, index, tail = move[2], move[3], move[4]
        if kind == 'circular':
            via = self._index(name, index)
            end = _NEXT.match(tail)
            if end is None:
                raise DataError(f'{where}: a circular move needs two points')
            name, index, tail = end[1], end[2], end[3]
        point = self._index(name, index)
        found = _SHIFTING.search(tail)
        if point is None or (kind == 'circular' and via is None):
            self.program.unknown(kind, where, self._why(name, index))
            return
        beside = self._beside(kind, point, tail) if self.still else None
        why = f'{found[0]} shifts it' if found and beside is None else ''
        why = why or (f'{move[1]} is not understood' if move[1] not in _KINDS else '')
        why = why or self.another_posture(kind, point, self.config[point])
        if _COORD.search(tail) and not self.context.controller.external:
            why = 'COORD lets it go along with a group that the robot file does not have'
        self._add(kind, where, via, point, tail, Frame('', why=why) if why else self.shift, beside)

    def _beside(self, kind: Kind, point: int, tail: str) -> Ref | None:
        """Return where an increment leads that shifts the tool from where the last move led."""
        before, value = self.program.pieces[-1][-1:], self.program.points[point].value
        if kind != 'linear' or [word.upper() for word in _SHIFTING.findall(tail)] != ['INC']:
            return None
        if not before or before[0].end is None or before[0].shift.why or value.ndim == 1:
            return None
        old = self.program.points[before[0].end.point].value
        tool, base = self.frames[point]
        alike = same_frame(tool, before[0].tool) and same_frame(base, before[0].base)
        plain = old.ndim == 2 and np.array_equal(value[:3, :3], np.eye(3))
        return before[0].end.beside(before=value) if alike and plain else None

    def _hold_used(self, text: str, where: str, moves: bool) -> None:
        if re.search(r'(?<![A-Z])P\[\s*(?:A?R)\[', text):
            for point in self.points.values():
                self.program.hold(point, f'a register chooses the point at {where}')
        elif not moves and not text.startswith(('!', '//')):
            for result in re.finditer(r'(?<![A-Z])P\[\s*(\d+)', text):
                point = self.points.get(int(result[1]), -1)
                if point >= 0:
                    self.program.hold(point, f'P[{result[1]}] is used at {where} by no move')

    def _add(
        self,
        kind: Kind,
        where: str,
        via: int | None,
        point: int,
        tail: str,
        shift: Frame,
        beside: Ref | None = None,
    ) -> None:
        tool, base = self.frames[point]
        step = Step(
            kind,
            where,
            beside or Ref(point),
            None if via is None else Ref(via),
            tool,
            base,
            _speed(kind, tail),
            re.search(r'\bFINE\b', tail) is not None,
            along=_COORD.search(tail) is not None,
            astray=flags_kept(kind, self.program.points[point], (*TURNS, WRIST)),
            shift=shift,
        )
        self.program.add(step)

    def _index(self, name: str, text: str) -> int | None:
        result = _INDEX.match(text)
        return self.points.get(int(result[1])) if name == 'P' and result is not None else None

    def _why(self, name: str, index: str) -> str:
        result = _INDEX.match(index)
        if name == 'P' and result is not None and int(result[1]) in self.untaught:
            return self.untaught[int(result[1])]
        return f'{name}[{index}] is not given here'


def _displaces(text: str) -> bool:
    """Return whether points are displaced after a program, by its text."""
    return any(not end for end in _DISPLACING.findall(text)[-1:])


def _speed(kind: Kind, tail: str) -> float:
    result = _SPEED.search(tail)
    if result is None:
        return SPEED
    try:
        value = float(result[1])
    except ValueError:
        return SPEED
    if kind == 'joint':
        return max(value / 100.0, LEAST_SPEED) if result[2] == '%' else SPEED
    return max(value * _UNITS[result[2]], LEAST_SPEED) if result[2] in _UNITS else SPEED
