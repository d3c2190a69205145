# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
KRL of KUKA: a ``.src`` with the moves and, beside it, a ``.dat`` with the points.

PTP, LIN and CIRC, and their spline forms, to points that stand in the move or are declared; LIN_REL
from a place that is known. Lengths are mm, angles degrees, ``$VEL.CP`` m/s. The bits of T are the
signs of the axes. ``$BASE = EK(root, type, frame)`` is a base on the flange of an external kinematic
system [2]_.

References
----------
.. [1] KUKA's expert programming manual as quoted at robot-forum.com, thread 7173 (Status, Turn);
   "Status and Turn in LIN motions", industrialmonitordirect.com: linear moves do not use them.
.. [2] robot-forum.com, thread 40359; posts of the Robots plug-in (visose/Robots, GitHub): EK.
.. [3] "KUKA LIN_REL vs Geometric Operator: E-Stop Behavior", industrialmonitordirect.com: along the base
   in force unless #TOOL stands there; ``XP1 : {X 0, Y 0, Z -100, A 0, B 0, C 0}``.

"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from weld_twin_core.arm.rotation import transform
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.motion.programs.travel import Kind

from .build import InFull, Program, Ref, Step, hold_if_used_elsewhere, signs_kept, turn_bits
from .controllers import Context, Frame
from .reader import LEAST_SPEED, Blocks, Frames, Reader, same_frame, unclear, unclear_shift
from .source import KUKA_POSE, NUMBER, Number, Source, closing, number_at, split_outside, stripped

KINDS: dict[str, Kind] = {'PTP': 'joint', 'LIN': 'linear', 'CIRC': 'circular'}
POSE_KEYS, EXTERNAL = ('X', 'Y', 'Z', 'A', 'B', 'C'), ('E1', 'E2', 'E3', 'E4', 'E5', 'E6')
SPEED = 0.1
"""m/s while the program has not said."""
_MOVE = re.compile(r'^[ \t]*S?(PTP|LIN|CIRC)(_REL)?\b', re.I | re.M)
_BESIDE = re.compile(r'(\w+)[ \t]*:[ \t]*\{')
"""A point and, by the geometric operator, what is added to it along its own axes [3]_."""
_COUNTED = re.compile(r'[ \t]*(\{[^\r\n]*\})(?:[ \t]*C_\w+)*[ \t]*(#(?:BASE|TOOL))?[ \t]*\Z', re.I)
"""What LIN_REL adds to where the arm stands, and along which axes [3]_."""
_IN_PLACE = re.compile(
    r'[ \t]*(?:\$?\w[\w.\[\]]*[ \t]*=[^(]*|(?:WAIT|PULSE|TRIGGER|CONTINUE)\b.*|BAS[ \t]*\([ \t]*#.*|)\Z',
    re.I,
)
"""A line in which no arm moves and no other line leads to."""
_EXTERNAL = re.compile(
    r'\b(E[1-6])(?:[ \t]*=[ \t]*|[ \t]+)(?=\S)(?![-+]?0*\.?0*(?:[,}\s]|\Z))', re.I
)
"""An external axis that stands elsewhere than at zero, in a point or set by itself."""
_SPLINE = re.compile(r'^[ \t]*(?:(?:PTP_)?SPLINE|ENDSPLINE)\b([^\r\n]*)', re.I | re.M)
"""Where a block of moves begins, with settings that all of them have, and where it ends."""
_OTHER = re.compile(r'^[ \t]*(SPL|SPTP_REL|ASYPTP)\b', re.I | re.M)
_DECLARED = re.compile(
    r'^[ \t]*(?:GLOBAL[ \t]+)?(?:DECL[ \t]+)?(?:GLOBAL[ \t]+)?(?:CONST[ \t]+)?'
    r'(E6POS|POS|FRAME|E6AXIS|AXIS|FDAT|LDAT|PDAT)[ \t]+([A-Za-z_]\w*)[ \t]*=[ \t]*(\{)',
    re.I | re.M,
)
_DECLARES = re.compile(r'\b(?:E6POS|POS|FRAME|E6AXIS|AXIS)[ \t]+([A-Za-z_]\w*)', re.I)
_SET = re.compile(
    r'^[ \t]*(\$(?:BASE|TOOL)(?:\.\w+)?|\$IPO_MODE|\$VEL\.CP|\$VEL_AXIS\[\w+\]|FDAT_ACT|LDAT_ACT|'
    r'PDAT_ACT|(?:BASE|TOOL)_DATA\[\d+\])[ \t]*=[ \t]*([^\r\n]*)',
    re.I | re.M,
)
_ASSIGNED = re.compile(
    r'^[ \t]*(?:(?:GLOBAL|DECL|CONST|FRAME|E6POS|POS|FDAT)[ \t]+)*([A-Z_]\w*(?:\[\s*\d+\s*\])?)'
    r'((?:\[[^\]\r\n]*\]|\.\w+)*)[ \t]*=(?!=)',
    re.I | re.M,
)
"""What may be a frame, or hold the number of one; and what part of it."""
_HANDS = re.compile(r'^[ \t]*(?!BAS\b|DEF)\w+[ \t]*\(([^)\r\n]*)\)', re.I | re.M)
"""A call of a routine, which may set what it is handed."""
_AFTER = re.compile(r'(?:[ \t]*C_\w+)*[ \t]*\Z', re.I)
"""What may stand behind a target."""
OTHER_TOOL, OTHER_BASE = (
    Frame(what, why=f'the numbers of {what} are set in other routines, and not to the same')
    for what in ('$TOOL', '$BASE')
)
"""Frames of a routine that has not set its own."""
STILL = Frame(
    '', why='the tool stands still there and the robot carries the workpiece ($IPO_MODE is #TCP)'
)
MOVING = Frame('')
"""Of a tool that moves."""
WORKED_OUT = Frame('', why='a setting of the move (WITH) has a tool or base that is worked out')
_BAS = re.compile(r'^[ \t]*BAS[ \t]*\([ \t]*#(\w+)[ \t]*,[ \t]*([^)\r\n]*)\)', re.I | re.M)
_WAIT = re.compile(r'^[ \t]*WAIT[ \t]+SEC[ \t]+([^\s;]+)', re.I | re.M)
_ROUTINE = re.compile(r'^[ \t]*(?:GLOBAL[ \t]+)?(?:DEF|DEFFCT)\b', re.I | re.M)
_NAMED = re.compile(
    r'^[ \t]*(?:GLOBAL[ \t]+)?(?:DEFFCT[ \t]+\w+|DEF)[ \t]+(\w+)[ \t]*\([^\r\n]*', re.I | re.M
)
_CALL = r'(?<![\w$.])(?<!DEF )(?<!DEF\t){}[ \t]*\('
_SETS = {
    what: re.compile(
        rf'^[ \t]*(?:\${what}(?:\.\w+)?[ \t]*=|FDAT_ACT[ \t]*=|BAS[ \t]*\([ \t]*#(?:EX_)?{what}\b)',
        re.I | re.M,
    )
    for what in ('TOOL', 'BASE')
}
"""What sets tool or base."""
_ROOT_SET = re.compile(r'^[ \t]*\$(?:WORLD|ROBROOT|ERSYSROOT)\b[^=\r\n]*=', re.I | re.M)
"""What bases count from, and where the arm stands in it."""
_WITH = re.compile(r'\bWITH\b', re.I)
_ALONG = re.compile(
    r'EK[ \t]*\([ \t]*MACHINE_DEF\[[ \t]*(\w+)[ \t]*\]\.ROOT[ \t]*,'
    r'[ \t]*MACHINE_DEF\[[ \t]*\1[ \t]*\]\.MECH_TYPE[ \t]*,(?=.*\)\Z)',
    re.I,
)
"""A base that goes along with a positioner; the frame on its flange follows, and a bracket."""
_SENSED = re.compile(r'\b((?:RSI|ST)_(?:ON|(OFF))\w*)[ \t]*\(', re.I)
"""What lets moves follow a sensor, and what ends that."""
_BLOCK = re.compile(
    r'^[ \t]*(?:(IF|SWITCH|LOOP|WHILE|FOR|REPEAT)|(ELSE|CASE|DEFAULT)|'
    r'(END(?:IF|SWITCH|LOOP|WHILE|FOR)|UNTIL)|EXIT)\b',
    re.I | re.M,
)
"""
Where the program branches or goes round, another branch, where they come together, and where a loop
is left.
"""
_AGGREGATE = re.compile(r'\{\s*(?:\w+\s*:)?')


class Aggregate(NamedTuple):
    """``{X 1, Y 2, ...}``: values by component, those that are numbers, and the texts of others."""

    numbers: dict[str, Number]
    others: dict[str, str]


@dataclass
class _State:
    """What the lines before have set."""

    tool: Frame = field(default_factory=lambda: Frame(''))
    base: Frame = field(default_factory=lambda: Frame(''))
    shift: Frame = MOVING
    speed: float = SPEED
    joint_speed: float = 0.1


class KrlReader(Reader):
    """Goes through the files once: the .src, then the .dat where there is one."""

    comments, routine, call = (r';[^\r\n]*', r'"[^"\r\n]*"'), _NAMED, _CALL

    def __init__(self, sources: Sequence[Source], context: Context) -> None:
        super().__init__(sources, context)
        self.names: dict[str, int] = {}
        self.data: dict[str, Aggregate] = {}
        self.frames: dict[str, Array] = {}
        self.used: list[set[int]] = [set() for _ in sources]
        self.turns: dict[int, int] = {}
        self.state = _State()
        self.tools: list[Frame] = []
        self.bases: list[Frame] = []
        self.blocks = Blocks(
            self.program, tool=unclear('$TOOL'), base=unclear('$BASE'), shift=unclear_shift
        )
        self.spline = ''
        self.reached = 0
        """Where the statement of the last move ends."""
        self.shared: list[str] = []
        """Points that other programs see, too."""

    def read(self) -> Program:
        self.again = self.set_again(_ASSIGNED)
        for call in _HANDS.finditer(self.text):
            for name in re.findall(r'\w+', call[1].lower()):
                self.again.setdefault(name, self.where(call))
        for file in range(len(self.sources)):
            for result in _DECLARED.finditer(self.texts[file]):
                self._declaration(file, result)
        self._frame_tables()
        routines = self.routines_named()
        labels = self.labels()
        tool, base = ([*labels, *self.calls(routines, sets.search)] for sets in _SETS.values())
        self.in_order(
            {
                _MOVE: self._move,
                _OTHER: self._other,
                _SET: self._set,
                _BAS: self._bas,
                _WAIT: lambda match: self.dwell(match.span(1)),
                _SENSED: self._sensed,
                _ROUTINE: self._routine,
                _BLOCK: self._block,
                _SPLINE: lambda match: setattr(self, 'spline', match[1].upper()),
            },
            more=[
                (lambda _: setattr(self.state, 'tool', OTHER_TOOL), tool),
                (lambda _: setattr(self.state, 'base', OTHER_BASE), base),
            ],
        )
        for text in (text for _, text in self.called):
            self.tools += [OTHER_TOOL] if _SETS['TOOL'].search(text) else []
            self.bases += [OTHER_BASE] if _SETS['BASE'].search(text) else []
        self.settle('tool', OTHER_TOOL, self.tools)
        self.settle('base', OTHER_BASE, self.bases)
        self.shift_all(_ROOT_SET, 'what bases count from is set at {}')
        self.moves_beside(_EXTERNAL)
        hold_if_used_elsewhere(self.program, self.names, self.texts, self.used)
        self.hold_shared({name: self.names[name] for name in self.shared}, _DECLARES)
        return self.program

    # Declarations ----------------------------------------------------------------------------

    def _declaration(self, file: int, result: re.Match[str]) -> None:
        kind, name = result[1].upper(), result[2].lower()
        where = self.sources[file].where(result.start(2))
        self.used[file].add(result.start(2))
        if name in self.names or name in self.data:
            raise DataError(f'{where}: {result[2]} is declared twice')
        end = closing(self.sources[file], self.texts[file], result.start(3)) + 1
        content = self._aggregate(file, result.start(3), end)
        if kind in ('FDAT', 'LDAT', 'PDAT'):
            self.data[name] = content
        else:
            point = self._point_of(file, content, result[2])
            if point is None:
                self.data[name] = content
            else:
                self.names[name] = point
                self.shared += [name] if 'GLOBAL' in result[0].upper() else []

    def _frame_tables(self) -> None:
        """Take in TOOL_DATA and BASE_DATA where they stand in one of the files."""
        for file, text in enumerate(self.texts):
            for result in _SET.finditer(text):
                if result[1].upper().endswith(']') and '_DATA' in result[1].upper():
                    value, name = self._frame_at(file, *result.span(2)), result[1].upper()
                    if value is not None:
                        self.frames[name] = value
                    # What is used above that has other numbers, of which nobody knows here.
                    if name in re.sub(r'\s', '', text[: result.start()].upper()):
                        where = self.sources[file].where(result.start(1))
                        self.again.setdefault(name.lower(), where)

    def _aggregate(self, file: int, start: int, end: int) -> Aggregate:
        """Return the components of ``{...}``; nested ones are left as text."""
        source, text = self.sources[file], self.texts[file]
        opening = _AGGREGATE.match(text, start)
        if opening is None or text[end - 1] != '}':
            raise DataError(f'{source.where(start)}: a point in braces was expected')
        numbers: dict[str, Number] = {}
        others: dict[str, str] = {}
        for first, last in split_outside(text, opening.end(), end - 1):
            first, last = stripped(text, first, last)
            named = re.match(r'([A-Za-z_]\w*)(?:\[[^\]]*\])?\s*', text[first:last])
            if named is None:
                raise DataError(
                    f'{source.where(first)}: a component and its value were expected, got '
                    f'{source.text[first:last]!r}'
                )
            key = named[1].upper()
            if key in numbers or key in others:
                raise DataError(f'{source.where(first)}: component {key} is given twice')
            piece = text[first + named.end() : last]
            if re.match(r'[-+.\d]', piece):
                numbers[key] = number_at(source, first + named.end(), last, f'{key}', file)
            else:
                others[key] = piece.strip()
        return Aggregate(numbers, others)

    def _point_of(self, file: int, content: Aggregate, name: str) -> int | None:
        """Add a point of all its components; None where some are missing or worked out."""
        external = self.context.controller.external
        known = [axis.label for axis in external]
        axes = (*(f'A{k + 1}' for k in range(self.context.axes)), *known)
        for keys, notation in ((POSE_KEYS, KUKA_POSE), (axes, self.context.degrees())):
            if all(key in content.numbers for key in keys):
                numbers = [content.numbers[key] for key in keys]
                numbered = [content.numbers.get(label) for label in known]
                point = self.program.add_point(
                    name, numbers, notation, file, self.context.external(numbered)
                )
                outer = [k for k in (*EXTERNAL, 'A7') if k in content.numbers and k not in axes]
                self.program.stands_beside(point, [content.numbers[k].value for k in outer])
                turn = content.numbers.get('T')
                if turn is not None and notation is KUKA_POSE:
                    self.turns[point] = int(turn.value)
                return point
        return None

    # Statements ------------------------------------------------------------------------------

    def _routine(self, result: re.Match[str]) -> None:
        self.new_piece(result)
        if self.routines > 1:
            self.state.tool, self.state.base = OTHER_TOOL, OTHER_BASE

    def _block(self, result: re.Match[str]) -> None:
        """Follow tool, base and whether the tool stands still, through branches and loops."""
        state = self.state
        now = (state.tool, state.base, state.shift)
        after = self.blocks.follow(self.where(result), result.groups(), now)
        state.tool, state.base, state.shift = after

    def _sensed(self, result: re.Match[str]) -> None:
        why = f'{result[1]} at {self.where(result)} lets a sensor displace it'
        self.state.shift = MOVING if result[2] else Frame('', why=why)

    def _use(self, tool: Frame | None, base: Frame | None) -> None:
        """Set tool and base for the moves that follow; None leaves one as it is."""
        if tool is not None:
            self.state.tool = tool
            self.tools.append(tool)
        if base is not None:
            self.state.base = base
            self.bases.append(base)

    def _other(self, result: re.Match[str]) -> None:
        self.unknown('linear', result, f'{result[1].upper()} is not understood')

    def _set(self, result: re.Match[str]) -> None:
        what = result[1].upper()
        start, end = stripped(self.text, *result.span(2))
        value = self.text[start:end]
        if what[:5] in ('$BASE', '$TOOL'):
            along = _ALONG.match(value) if what == '$BASE' else None
            if along is not None:
                self.take_positioner(along[1], 'it works with the external kinematic systems')
                start += along.end()
                end -= 1
                value = self.text[start:end].strip()
            frame = self._frame_at(0, start, end)
            unclear = along is None and re.match(r'EK\b', value, re.I)
            named = Frame(_bare(value) or value, frame, None if unclear else along is not None)
            if '.' in what:
                named = Frame(
                    what[:5],
                    why=f'the numbers of {what[:5]} are set in parts at {self.where(result)}',
                )
            elif where := self._again(value):
                named = Frame(named.name, why=f'the numbers of {value} are set anew at {where}')
            elif frame is None and not named.moving:
                named = self.named(named.name, value.lower())._replace(moving=named.moving)
            self._use(*((None, named) if what[:5] == '$BASE' else (named, None)))
        elif what == '$IPO_MODE':
            self.state.shift = MOVING if value.upper() == '#BASE' else STILL
        elif what == '$VEL.CP':
            self.state.speed = self._speed(start, end, self.state.speed)
        elif what.startswith('$VEL_AXIS'):
            self.state.joint_speed = self._speed(start, end, 10.0) / 100.0
        elif what == 'FDAT_ACT':
            self._use(*self._frames_of(value))
            self.state.shift = MOVING
        elif what == 'LDAT_ACT' and value.lower() in self.data:
            speed = self.data[value.lower()].numbers.get('VEL')
            self.state.speed = self.state.speed if speed is None else max(speed.value, LEAST_SPEED)

    def _bas(self, result: re.Match[str]) -> None:
        what = result[1].upper()
        start, end = stripped(self.text, *result.span(2))
        if what == 'EX_BASE':
            self._use(None, Frame(self.text[start:end], None, None))
        elif what in ('TOOL', 'BASE'):
            frame = self._numbered(what, self.text[start:end])
            self._use(*((frame, None) if what == 'TOOL' else (None, frame)))
        elif what == 'VEL_CP':
            self.state.speed = self._speed(start, end, self.state.speed)
        elif what == 'VEL_PTP':
            self.state.joint_speed = self._speed(start, end, 10.0) / 100.0

    def _frames_of(self, name: str) -> tuple[Frame, Frame]:
        """Return tool and base of the data of a taught point."""
        content = self.data.get(name.lower())
        if content is None or self._again(name):
            return Frame(name), Frame(name)
        numbers = [content.numbers.get(key) for key in ('TOOL_NO', 'BASE_NO')]
        tool, base = (
            Frame(name) if number is None else self._numbered(what, f'{number.value:g}')
            for what, number in zip(('TOOL', 'BASE'), numbers, strict=True)
        )
        fixed = content.others.get('IPO_FRAME', '#BASE').upper() != '#BASE'
        return STILL if fixed else tool, base

    def _again(self, name: str) -> str:
        """Return where a frame is set anew, of all of a table where its index is worked out; or ''."""
        name = re.sub(r'\s', '', name.lower())
        return self.again.get(name, self.again.get(name.partition('[')[0], ''))

    def _numbered(self, what: str, text: str) -> Frame:
        """Return a frame by its number; number 0 is the robot's own."""
        if text.strip() == '0':
            return Frame('', np.eye(4))
        key = f'{what}_DATA[{text.strip()}]'
        name = _bare(key) or key
        if where := self._again(key):
            return Frame(name, why=f'the numbers of {key} are set anew at {where}')
        # Numbered bases of an external kinematic system are taken as such by the controller alone.
        return Frame(name, self.frames.get(key), None if what == 'BASE' else False)

    def _frame_at(self, file: int, start: int, end: int) -> Array | None:
        """Return the frame that a piece of text stands for; None where it is worked out."""
        start, end = stripped(self.texts[file], start, end)
        text = self.texts[file][start:end]
        if text.upper() == '$NULLFRAME':
            return np.eye(4)
        if text.startswith('{'):
            last = closing(self.sources[file], self.texts[file], start) + 1
            content = self._aggregate(file, start, last)
            if last == end and all(key in content.numbers for key in POSE_KEYS):
                return KUKA_POSE.value([content.numbers[key].value for key in POSE_KEYS])
            return None
        point = self.names.get(text.lower())
        if point is not None and self.program.points[point].value.ndim == 2:
            self.program.hold(point, f'{text} is used as a frame')
            self.used[file].add(start)
            return self.program.points[point].value
        return self.frames.get(re.sub(r'\s', '', text.upper()))

    def _speed(self, start: int, end: int, default: float) -> float:
        return max(self.value((start, end), default), LEAST_SPEED)

    # Moves -----------------------------------------------------------------------------------

    def _move(self, result: re.Match[str]) -> None:
        word, kind = result[1].upper(), KINDS[result[1].upper()]
        text = self.text
        end = _line_end(text, result.end())
        since, self.reached = self.text[self.reached : result.start()], end
        if result[2]:
            why = 'which is not known here' if kind != 'linear' else self._counted(result, since)
            if why:
                self.unknown(kind, result, f'{word}_REL counts from where the arm stands, {why}')
            return
        wanted = 2 if kind == 'circular' else 1
        with_ = _WITH.search(text, result.end(), end)
        cut = end if with_ is None else with_.start()
        parts = self._parts(result.end(), cut)
        if len(parts) > wanted:
            self.unknown(kind, result, f'{word} with {len(parts)} arguments is not understood')
            return
        pieces = self.pieces(result.end(), cut)
        if any(
            not _AFTER.match(text, a, b) for (_, a), (_, b) in zip(parts, pieces, strict=False)
        ):
            self.unknown(
                kind, result, f'what stands behind the target of {word} is not understood'
            )
            return
        tail = text[parts[-1][1] : end].upper() if parts else ''
        refs = [self._ref(*part) for part in parts]
        if len(refs) < wanted or any(ref is None for ref in refs):
            what = self.source.text[result.end() : end].strip() or 'nothing'
            self.unknown(kind, result, f'{word} goes to {what!r}, which is not given here')
            return
        ends = [ref for ref in refs if ref is not None]
        joints = self.program.points[ends[-1].point].value.ndim == 1
        if joints and kind != 'joint':
            self.unknown(kind, result, f'{word} to axis positions is not understood')
            return
        frames = self._own_frames(self.spline, text[cut:end].upper())
        self.program.add(self._step(kind, self.where(result), ends, frames, tail))

    def _counted(self, result: re.Match[str], since: str) -> str:
        """Add a straight move that counts from the place before, or return why that is not known."""
        what = _COUNTED.match(self.text, result.end(), self.reached)
        content = what and self._aggregate(0, *what.span(1))
        if what is None or content is None or content.others or self.context.controller.external:
            return 'by what is worked out, or with external axes'
        way = {key: number.value for key, number in content.numbers.items()}
        if any(value and key not in 'XYZ' for key, value in way.items()):
            return 'and turns the tool or moves external axes'
        before, frames = self.program.pieces[-1][-1:], self._own_frames(self.spline)
        if not all(map(_IN_PLACE.match, since.splitlines())) or not before or not before[0].end:
            return 'and what comes before it may lead there from elsewhere'
        kept = (before[0].tool, before[0].base, before[0].shift)
        old = self.program.points[before[0].end.point]
        if old.value.ndim == 1 or not all(map(same_frame, kept, frames)):
            return 'which the move before does not say in this tool and base'
        axes = old.value[:3, :3] if (what[2] or '').upper() == '#TOOL' else np.eye(3)
        step = axes @ [1e-3 * way.get(key, 0.0) for key in 'XYZ']
        pose = transform(old.value[:3, :3], old.value[:3, 3] + step)
        numbers = KUKA_POSE.numbers(pose, [number.value for number in old.numbers])
        start = result.start(1)
        point = self.program.add_point(
            f'line {self.source.line(start)}',
            [Number(value, start, start) for value in numbers],
            KUKA_POSE,
            external=self.context.external(()),
            in_full=InFull(before[0].end.point, self._in_full(result, what)),
        )
        self.program.stands_beside(point, [])
        tail = self.text[what.end(1) : self.reached].upper()
        self.program.add(self._step('linear', self.where(result), [Ref(point)], frames, tail))
        return ''

    def _in_full(
        self, result: re.Match[str], what: re.Match[str]
    ) -> tuple[tuple[int, int, str], ...]:
        """Return how LIN_REL and what it adds become LIN to a place, with a remark of what it was."""
        numbers = ','.join(f'{key} {{{k}}}' for k, key in enumerate(POSE_KEYS))
        said = self.source.text[result.start(1) : max(what.span(1)[1], what.end(2))].strip()
        close = _line_end(self.source.text, self.reached)
        remark = f' ; was {said}'.replace('{', '{{').replace('}', '}}')
        axes = [] if what[2] is None else [(*what.span(2), '')]
        full = (result.start(2), what.end(1), f' {{{{{numbers}}}}}')
        return (full, *axes, (close, close, remark))

    def _own_frames(self, *settings: str) -> Frames:
        """Return tool, base and shift of a move, settings of its block and its own counted."""
        frames = [self.state.tool, self.state.base, self.state.shift]
        for own in settings:
            for k, what in enumerate(('TOOL', 'BASE')):
                if f'${what}' not in own:
                    continue
                named = re.search(rf'\${what}\s*=\s*S{what}2?\s*\(\s*(\w+)', own)
                frames[k] = WORKED_OUT if named is None else self._frames_of(named[1])[k]
                frames[2] = MOVING if what == 'TOOL' else frames[2]
        return tuple(frames)

    def _step(
        self, kind: Kind, where: str, ends: Sequence[Ref], frames: Frames, tail: str
    ) -> Step:
        speed = self.state.joint_speed if kind == 'joint' else self.state.speed
        turn = self.turns.get(ends[-1].point) if ends[-1].leads else None
        own = re.search(rf'\$VEL(?:\.CP)?\s*=\s*(?:SVEL_CP\s*\(\s*)?({NUMBER})', tail)
        return Step(
            kind,
            where,
            ends[-1],
            ends[0] if kind == 'circular' else None,
            frames[0],
            frames[1],
            speed if own is None else max(float(own[1].rstrip('.')), LEAST_SPEED),
            re.search(r'\bC_(DIS|PTP|VEL|ORI|SPL)\b', tail) is None,
            suits=None if turn is None else turn_bits(turn),
            # Straight moves take no notice of it.
            astray=signs_kept(turn) if turn is not None and kind == 'joint' else None,
            shift=frames[2],
        )

    def _parts(self, start: int, end: int) -> list[tuple[int, int]]:
        """Return the targets of a move, without what follows them."""
        text = self.text
        out = []
        for first, last in self.pieces(start, end):
            beside = _BESIDE.match(text, first, last)
            if beside is not None:
                last = closing(self.source, text, beside.end() - 1) + 1
            elif text.startswith('{', first):
                last = closing(self.source, text, first) + 1
            else:
                word = re.match(r'[^\s]+', text[first:last])
                last = first + (word.end() if word else 0)
            if first < last:
                out.append((first, last))
        return out

    def _ref(self, start: int, end: int) -> Ref | None:
        """Return where a target leads; what is added to a point by the geometric operator goes along."""
        beside = _BESIDE.match(self.text, start, end)
        if beside is None:
            point = self._target(start, end)
            return None if point is None else Ref(point)
        point, shift = self._target(*beside.span(1)), self._frame_at(0, beside.end() - 1, end)
        if point is None or shift is None or self.program.points[point].value.ndim == 1:
            return None
        return Ref(point).beside(after=shift)

    def _target(self, start: int, end: int) -> int | None:
        text = self.text
        if text.startswith('{', start):
            content = self._aggregate(0, start, end)
            return self._point_of(0, content, f'line {self.source.line(start)}')
        name = text[start:end].lower()
        if re.fullmatch(r'[a-z_]\w*', name):
            self.used[0].add(start)
            return self.names.get(name)
        return None


def _bare(text: str) -> str:
    """Return the number of ``TOOL_DATA[1]``, as a user would name it; none of one worked out."""
    result = re.fullmatch(r'(?:TOOL|BASE)_DATA\s*\[\s*(\d+)\s*\]', text.strip(), re.I)
    return result[1] if result else ''


def _line_end(text: str, start: int) -> int:
    """Return where the statement that goes on at a place ends."""
    result = re.compile(r'[\r\n]').search(text, start)
    return len(text) if result is None else result.start()
