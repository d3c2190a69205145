# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
URScript of Universal Robots: ``movej``, ``movel``, ``movep`` and ``movec``.

Poses are ``p[x, y, z, rx, ry, rz]`` in m and rad, joint positions lists in rad. Speeds are m/s and
rad/s. A blend radius of 0 is a stop.

References
----------
.. [1] "URScript Quick Reference" of the daemon urd, and the wrapper of the URScript manual 1.8:
   arguments of movej, movel and movec, poses in m with rotation vectors.
.. [2] Universal Robots, "Script manual, e-Series": track_conveyor_linear, path_offset_enable.

"""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.motion.programs.travel import Kind

from .build import Program, Ref, Step, Suits, hold_if_used_elsewhere, nearest
from .controllers import Context, Frame
from .reader import LEAST_SPEED, Blocks, Frames, Reader, Span, unclear, unclear_shift
from .source import UR_POSE, Notation, Number, Source, closing, stripped

MOVES: dict[str, tuple[Kind, tuple[str, ...]]] = {
    'movej': ('joint', ('q', 'a', 'v', 't', 'r')),
    'movel': ('linear', ('pose', 'a', 'v', 't', 'r')),
    'movep': ('linear', ('pose', 'a', 'v', 'r')),
    'movec': ('circular', ('pose_via', 'pose_to', 'a', 'v', 'r', 'mode')),
}
DEFAULT_SPEED = {'joint': 1.05, 'linear': 0.25, 'circular': 0.25}
"""rad/s and m/s, as the manual gives them."""
OTHER_MOTION = (
    'servoj|servol|servoc|speedj|speedl|force_mode|conveyor_pulse_decode|freedrive_mode|'
    r'teach_mode|optimovej|optimovel|path_offset_\w+|set_reference_frame|move_process|'
    r'track_conveyor_\w+|stop_conveyor_tracking|frame_tracking_\w+|screw_driving|end_\w+_mode'
)
"""Functions that move the arm, or its frames, in another way."""
_DISPLACES = re.compile(
    r'track_conveyor_|path_offset_(?:enable|set)|(?:force|freedrive|teach)_mode'
)
_ENDS = re.compile(r'stop_conveyor_tracking|path_offset_disable|end_\w+_mode')
"""What lets all moves after it go elsewhere than their points say, and what ends that [2]_."""
OTHER_TOOL = Frame(
    'set_tcp', why='the numbers of set_tcp are given in other routines, and not the same'
)
"""The tool of a routine that has not set its own."""
_WORD = re.compile(
    rf'\b(?:(?:(move[jlpc])|({OTHER_MOTION})|(set_tcp)|(sleep))\s*(\()|'
    r'(def|thread|sec)\s(?=\s*\w+\s*\()|(?:(if|while|for)|(elif|else)|(end)|(break|continue))\b)'
)
_NAME, _CALL = re.compile(r'\s*(\w+)'), r'(?<![\w.])(?<!def )(?<!thread )(?<!sec ){}\s*\('
_ASSIGNED = re.compile(
    r'(?:^|(?<=;))[ \t]*(?:(?:global|local)[ \t]+)?([A-Za-z_]\w*)((?:\[[^\]\r\n]*\]|\.\w+)*)[ \t]*=(?!=)'
    r'[ \t]*',
    re.M,
)


_LED = re.compile(r'\bmove[jlpc]\s*\(\s*([A-Za-z_]\w*)\s*[,)](?:\s*([A-Za-z_]\w*)\s*[,)])?')
_WHERE_IT_IS = re.compile(r'get_(?:actual|target)_tcp_pose\s*\(\s*\)\Z')
_IN_PLACE = re.compile(
    r'(?:\s|;|(?:sleep|sync|textmsg|set_\w*(?:digital|analog)_out)\s*\([^()]*\))*(?:move[jlpc]\s*)?\Z'
)
"""What stands between two moves where nothing else moves the arm, and no other line leads there."""


class UrscriptReader(Reader):
    """Goes through a script once."""

    comments, call = (r'#[^\r\n]*', r'"[^"\r\n]*"'), _CALL

    def __init__(self, sources: Sequence[Source], context: Context) -> None:
        super().__init__(sources, context)
        self.names: dict[str, int] = {}
        self.used: set[int] = set()
        self.tool = Frame('')
        self.tools: list[Frame] = []
        self.blocks = Blocks(self.program, tool=unclear('set_tcp'), shift=unclear_shift)
        self.around: list[Frames | None] = []
        """Blocks that are open; of a routine what holds around it."""
        self.displaced = _displaces(self.text)
        self.led = {name for match in _LED.finditer(self.text) for name in match.groups() if name}
        """Variables that moves lead to."""
        self.start = self.reached = 0
        """Where the arguments of the move at hand begin, and where the last move ends."""

    def read(self) -> Program:
        routines = self._routines()
        tools = self.calls(routines, lambda text: 'set_tcp' in text)
        shifts = self.calls(routines, _displaces)
        self._declare()
        self.in_order(
            {_WORD: self._word},
            more=[
                (lambda _: setattr(self, 'tool', OTHER_TOOL), tools),
                (lambda call: setattr(self, 'shift', unclear_shift(self.where(call))), shifts),
            ],
        )
        self.settle('tool', OTHER_TOOL, self.tools)
        names = {name: point for name, point in self.names.items() if point >= 0}
        hold_if_used_elsewhere(self.program, names, [self.text], [self.used])
        for name, where in self.again.items():
            if name in self.names:
                self.program.hold(self.names[name], f'{name} is set anew at {where}')
        return self.program

    def _word(self, result: re.Match[str]) -> None:
        held = (self.tool, self.shift)
        if result[5]:
            self._statement(result)
        elif result[6]:
            self.around.append(held)
            self.new_piece(result)
            if self.routines > 1:  # who calls it, or what runs beside it, is not followed
                self.tool = OTHER_TOOL
                self.shift = unclear_shift(self.where(result)) if self.displaced else self.shift
        elif result[9] and self.around and (around := self.around.pop()) is not None:
            # To define a routine moves nothing: what stands around it goes on as before.
            self.program.new_piece()
            self.tool, self.shift = around
        else:
            self.around += [None] if result[7] else []
            words = result.groups()[6:9]
            self.tool, self.shift = self.blocks.follow(self.where(result), words, held)

    def _routines(self) -> list[tuple[str, str]]:
        """Return names and statements of the routines; of one that holds others, all of it."""
        out, begun = list[tuple[str, str]](), list[re.Match[str] | None]()
        for result in _WORD.finditer(self.text):
            if result[6]:
                begun.append(_NAME.match(self.text, result.end()))
            elif result[7]:
                begun.append(None)
            elif result[9] and not begun:
                raise DataError(
                    f"{self.where(result)}: this 'end' closes no routine, branch or loop that is known; "
                    'write a switch as if and elif'
                )
            elif result[9] and (head := begun.pop()) is not None:
                out.append((head[1], self.text[head.end() : result.start()]))
        if begun:
            where = self.source.where(len(self.text.rstrip()) - 1)
            raise DataError(f"{where}: an 'end' is missing; is the file cut off?")
        return out

    def _declare(self) -> None:
        """Take in the variables that are set to a pose or to joint positions."""
        self.again = self.set_again(_ASSIGNED)
        for result in _ASSIGNED.finditer(self.text):
            name = result[1]
            if result[2] or re.match(r'(?:p\s*)?\[', self.text[result.end() :]) is None:
                continue
            opening = self.text.index('[', result.end())
            try:
                point = self._target(result.end(), closing(self.source, self.text, opening) + 1)
            except DataError:
                continue  # A list of something else; a move to it is refused where it stands.
            if point is not None and name not in self.names:
                self.names[name] = point
                self.used.add(result.start(1))

    def _statement(self, result: re.Match[str]) -> None:
        opening = result.start(5)
        end = closing(self.source, self.text, opening)
        where = self.source.where(result.start())
        if result[1]:
            self._move(result[1], where, opening + 1, end)
        elif result[2]:
            self.program.unknown('linear', where, f'{result[2]} moves the arm in its own way')
            if _DISPLACES.match(result[2]):
                self.shift = Frame('', why=f'{result[2]} at {where} displaces it')
            elif _ENDS.match(result[2]):
                self.shift = Frame('')
        elif result[3]:
            self.tool = self._tool(opening + 1, end)
            self.tools.append(self.tool)
        else:
            self.dwell((opening + 1, end))

    def _tool(self, start: int, end: int) -> Frame:
        first = self.pieces(start, end)[0]
        try:
            value = self._frame(*first)
        except DataError:
            value = None
        text = self.source.text[slice(*first)]
        return self.named(text or 'of set_tcp', text) if value is None else Frame('', value)

    def _move(self, word: str, where: str, start: int, end: int) -> None:
        kind, order = MOVES[word]
        self.start = start - 1
        given = self._arguments(order, start, end)
        try:
            refs = [self._ref(*given[name]) for name in order[: 1 + (kind == 'circular')]]
        except KeyError:
            raise DataError(f'{where}: {word} lacks its target') from None
        if any(ref is None for ref in refs):
            what = self.source.text[slice(*given[order[0]])]
            self.program.unknown(
                kind, where, f'{word} goes to {what!r}, which is worked out there'
            )
            return
        end_ref, suits = refs[-1] or (Ref(0), None)
        via = refs[0][0] if kind == 'circular' and refs[0] else None
        speed = self.value(given.get('v'), DEFAULT_SPEED[kind])
        if kind == 'joint':
            speed = float(speed / np.max(self.context.robot.planned_velocity))
        stop = self.value(given.get('r'), 0.0) <= 0.0
        base, speed = Frame('', np.eye(4)), max(speed, LEAST_SPEED)
        step = Step(kind, where, end_ref, via, self.tool, base, speed, stop, suits=suits)
        self.program.add(replace(step, shift=self.shift))
        self.reached = end + 1

    def _arguments(self, order: Sequence[str], start: int, end: int) -> dict[str, tuple[int, int]]:
        """Return the piece of text of every argument by its name."""
        out: dict[str, tuple[int, int]] = {}
        for k, (first, last) in enumerate(self.pieces(start, end)):
            named = re.match(r'([a-z_]\w*)\s*=(?!=)\s*', self.text[first:last])
            if named is not None:
                out[named[1]] = (first + named.end(), last)
            elif k < len(order) and first < last:
                out[order[k]] = (first, last)
        return out

    def _ref(self, start: int, end: int) -> tuple[Ref, Suits | None] | None:
        """Return where a target leads, and the postures it allows; None where it is worked out."""
        text = self.text[start:end]
        call = re.match(r'(pose_trans|pose_add|get_inverse_kin)\s*(\()', text)
        if call is None:
            point = self._point(start, end)
            return None if point is None else (Ref(point), None)
        inside = closing(self.source, self.text, start + call.start(2))
        if stripped(self.text, inside + 1, end)[0] < end:
            return None
        parts = self.pieces(start + call.end(), inside)
        if call[1] == 'get_inverse_kin':
            return self._near(parts)
        if len(parts) != 2:
            return None
        beside = self._beside(call[1], *parts)
        if beside is not None or call[1] == 'pose_add':
            return None if beside is None else (beside, None)
        frame = self._frame(*parts[0])
        point = None if frame is None else self._point(*parts[1])
        if point is None:
            return None
        # The frame counts as a base: the point itself leads, and is moved in that frame.
        return Ref(point, frame), None

    def _beside(self, call: str, first: Span, second: Span) -> Ref | None:
        """Return a place beside one that a move leads to, or that the last one led to; else None."""
        if self.text[second[0]] != 'p' or '[' not in self.text[slice(*second)]:
            return None
        name, place = self.text[slice(*first)], None
        if name in self.led and name not in self.again:
            point = self._constant(*first, 2)[0]
            place = None if point is None else Ref(point)
        elif _WHERE_IT_IS.match(name):
            before = self.program.pieces[-1][-1:]
            still = _IN_PLACE.match(self.text, self.reached, self.start)
            if still and before and before[0].stop and before[0].tool is self.tool:
                place = before[0].end
        if place is None or self.program.points[place.point].value.ndim == 1:
            return None
        shift = self._frame(*second)
        if shift is None:
            return None
        if call == 'pose_trans':
            return place.beside(after=shift)
        return place.beside(before=shift) if np.array_equal(shift[:3, :3], np.eye(3)) else None

    def _near(self, parts: Sequence[tuple[int, int]]) -> tuple[Ref, Suits | None] | None:
        point = self._point(*parts[0])
        if len(parts) > 4 or any(self.text.startswith('tcp', part[0]) for part in parts):
            return None  # It is reached with another tool.
        if point is None or len(parts) < 2:
            return None if point is None else (Ref(point), None)
        first, last = parts[1]
        named = re.match(r'qnear\s*=\s*', self.text[first:last])
        near = self._constant(first + (named.end() if named else 0), last, 1)[1]
        return (Ref(point), None) if near is None else (Ref(point), nearest(near))

    def _frame(self, start: int, end: int) -> Array | None:
        """Return a pose that stands there, or of a variable that is set once."""
        point, value = self._constant(start, end, 2)
        if point is not None:
            self.program.hold(point, 'it is a frame of other points')
        return value

    def _constant(self, start: int, end: int, ndim: int) -> tuple[int | None, Array | None]:
        """Return a point, and its pose (2) or joints (1); None where that changes, or is none."""
        point = self._point(start, end)
        value = None if point is None else self.program.points[point].value
        fits = value is not None and value.ndim == ndim and self.text[start:end] not in self.again
        return point, value if fits else None

    def _point(self, start: int, end: int) -> int | None:
        """Return the point of a literal or a variable; None for anything worked out."""
        name = self.text[start:end]
        if re.fullmatch(r'[A-Za-z_]\w*', name):
            self.used.add(start)
            return self.names.get(name)
        return self._target(start, end)

    def _target(self, start: int, end: int) -> int | None:
        pose = self.text[start:end].startswith('p')
        numbers = self._numbers(start, end, 6 if pose else self.context.robot.n)
        if numbers is None:
            return None
        notation: Notation = UR_POSE if pose else self.context.radians()
        return self.program.add_point(f'line {self.source.line(start)}', numbers, notation)

    def _numbers(self, start: int, end: int, count: int) -> list[Number] | None:
        """Return the numbers of a list; None where it is no list, or one that is worked out."""
        result = re.match(r'(?:p\s*)?(\[)', self.text[start:end])
        if result is None:
            return None
        opening = start + result.start(1)
        last = closing(self.source, self.text, opening)
        if last != end - 1:
            return None
        parts = self.pieces(opening + 1, last)
        if any(re.search(r'[A-Za-z_]|[-+*/]\s*[\w(]', self._bare(*part)) for part in parts):
            return None
        if len(parts) != count:
            where = self.source.where(start)
            raise DataError(f'{where}: {count} numbers are needed here, there are {len(parts)}')
        return [self.number(*part, 'a coordinate') for part in parts]

    def _bare(self, start: int, end: int) -> str:
        """Return a coordinate without its sign and exponent, to see whether it is worked out."""
        text = self.text[start:end].lstrip('+-')
        return re.sub(r'(?<=[\d.])[eE][-+]?\d+', '', text)


def _displaces(text: str) -> bool:
    """Return whether moves are displaced after a routine, or no longer are, by its text."""
    return any(each.search(text) for each in (_DISPLACES, _ENDS))
