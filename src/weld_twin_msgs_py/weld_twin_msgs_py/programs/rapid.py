# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
RAPID of ABB: ``MoveJ``, ``MoveL``, ``MoveC``, ``MoveAbsJ``, and the arc and trigger forms of them.

Lengths are mm, angles degrees, orientations quaternions with the scalar first, speeds mm/s.
``Offs`` and ``RelTool`` with plain numbers are places that go along with their point. A work object with
a mechanical unit in the place of a programmed user frame goes along with that; its user frame is then
one of the unit's parameters, and the one in the program is not used [2]_.

References
----------
.. [1] ABB, "RAPID Reference Manual": confdata; abb_rapid_msgs/RobTarget, docs.ros.org; the types
   of the package abb-motion-program-exec, whose words are those of 3HAC16581-1.
.. [2] ABB, "Application manual MultiMove", 3HAC021272-001, 6.3; "Basic Characteristics RAPID", wobjdata.

"""

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from weld_twin_core.arm.rotation import rotation_matrix, transform
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.motion.programs.travel import Kind

from .build import (
    WRIST,
    Program,
    Ref,
    Step,
    Suits,
    exchange,
    flags_kept,
    hold_if_used_elsewhere,
    quadrants,
)
from .controllers import Context, Frame
from .reader import LEAST_SPEED, Blocks, Reader, unclear_shift
from .source import ABB_POSE, Number, Source, closing, split_outside, stripped

NO_AXIS = 8.9e9
"""ABB writes 9E9 for an external axis that is not there."""
SPEED = 0.1
"""m/s where the speed is not known."""
_DECLARED = re.compile(
    r'\b(LOCAL\s+)?(?:CONST|PERS|VAR)\s+(robtarget|jointtarget|tooldata|wobjdata|speeddata)\s+'
    r'([A-Za-z]\w*)\s*(\{[^}]*\})?\s*:=\s*',
    re.I,
)
_DECLARES = re.compile(r'\b(?:robtarget|jointtarget)\s+([A-Za-z]\w*)', re.I)
_MOVE = re.compile(
    r'\b(?:Move(AbsJ|J|L|C)(?:DO|AO|GO|Sync)?|Arc(L|C)(?:\d?(?:Start|End))?|Trigg(J|L|C)(?:IOs)?)'
    r'(?=[\s\\])(?!\s*:=)',
    re.I,
)
_ACTS = re.compile(r'(?:DO|AO|GO|Sync)\Z', re.I)
"""Ends the name of a move that says behind its tool what happens at its point."""
_OTHER = re.compile(
    r'\b(PDispOn|PDispSet|PDispOff|EOffsOn|EOffsSet|EOffsOff|SoftAct|SoftDeact|'
    r'EGMRun\w+|Ind[ARCD]Move|StepBwdPath|PathRecMove\w+|MoveExtJ)\b',
    re.I,
)
"""What shifts the points after it, or moves the arm and names neither tool nor point."""
_EXTERNAL = re.compile(r'\b(MoveExtJ|extax|eax_[a-f])\b', re.I)
"""What moves external axes without a move of the arm."""
_CALL = re.compile(
    r'(?:^|(?<=;))[ \t]*(?!RETURN\b|CONNECT\b)([A-Za-z]\w*)(?=[ \t\\])(?!\s*:=)'
    r'((?:[^;\r\n]|,[ \t]*\r?\n|\r?\n(?=[ \t]*\\)){0,1000});',
    re.I | re.M,
)
"""A statement that calls an instruction, and its arguments, no longer than people write them."""
_OWN_DATA = re.compile(r'v(?:\d+|max)|z\d+|fine')
"""Speeds and zones that every controller has."""
_ASSIGNED = re.compile(r'(?<![\w.\\])([A-Za-z]\w*)((?:\s*\{[^}]*\}|\.(?!tload\b)\w+)*)\s*:=', re.I)
"""What may be a tool or a work object, and what part of it; what hangs at a tool moves no frame."""
_READS = ('setsysdata', 'waitwobj', 'dropwobj', 'fcact')
"""Instructions that are handed a tool or a work object alone, and do not set it."""
_DISPLACED = ('pdispon', 'pdispset', 'eoffson', 'eoffsset', 'softact')
_ENDED = ('pdispoff', 'eoffsoff', 'softdeact')
_SENSED = re.compile(r'\\(Corr|Track)\b', re.I)
"""A switch of a move that follows what a sensor says."""
_WAIT = re.compile(r'\bWaitTime\b((?:\s*\\\w+\s*,?)*)\s*([^;]*);', re.I)
_ROUTINE = re.compile(
    r'^[ \t]*(?:LOCAL[ \t]+)?(?:PROC|FUNC[ \t]+\w+|TRAP)[ \t]+(\w+)', re.I | re.M
)
_CALLED = (
    r'(?:^|(?<=;))[ \t]*(?:IF\b[^;\r\n]*?[ \t)]|CONNECT[ \t]+\w+[ \t]+WITH[ \t]+)?({})'
    r'(?=[ \t]*[;\\]|[ \t]+[\w"\[])(?!\s*:=)'
)
"""A call of a routine, or what is set up to call it at any time."""
_BLOCK = re.compile(
    r'^[ \t]*(?:(IF(?=\b[^;]{0,500}?\bTHEN\b)|TEST|FOR|WHILE)|(ELSEIF|ELSE|CASE|DEFAULT)|'
    r'(END(?:IF|TEST|FOR|WHILE)))\b',
    re.I | re.M,
)
"""Where the program branches or goes round, another branch, and where they come together."""
_COMPACT = re.compile(r'\bIF\b(?![^;]*\bTHEN\b)[^;\r\n]*\Z', re.I)
"""A condition of the one statement that follows it."""
_CONF = re.compile(r'\bConf([JL])\s*\\(On|Off)\b', re.I)
_KINDS: dict[str, Kind] = {'absj': 'joint', 'j': 'joint', 'l': 'linear', 'c': 'circular'}


class Leaf(NamedTuple):
    """A part of a bracketed value that has no parts itself."""

    start: int
    end: int


Tree = Leaf | list['Tree']


class RapidReader(Reader):
    """Goes through a module once."""

    comments, routine, call = (r'"[^"\r\n]*"', r'![^\r\n]*'), _ROUTINE, _CALLED

    def __init__(self, sources: Sequence[Source], context: Context) -> None:
        super().__init__(sources, context)
        self.names: dict[str, int] = {}
        self.tools: dict[str, Frame] = {'tool0': Frame('', np.eye(4))}
        self.bases: dict[str, Frame] = {'wobj0': Frame('', np.eye(4))}
        self.speeds: dict[str, float] = {}
        self.used: set[int] = set()
        self.suits: dict[int, Suits] = {}
        self.local: set[str] = set()
        """Points that other modules do not see."""
        self.config = {'j': True, 'l': True}
        self.entered: dict[str, tuple[Frame, list[Frame]]] = {}
        """By routine the shift with which it begins, and those where it is called."""
        self.blocks = Blocks(self.program, shift=unclear_shift)

    def read(self) -> Program:
        self.again = self.set_again(_ASSIGNED)
        routines = self.routines_named()
        self._set_by_calls({name.lower(): text for name, text in routines})
        for result in _DECLARED.finditer(self.text):
            self._declaration(result)
        called = self.calls(routines, lambda _: True)
        self.entered = {call[1].lower(): (Frame(call[1]), []) for call in called}
        labels = self.labels() if re.search('|'.join(_DISPLACED), self.text, re.I) else []
        self.in_order(
            {
                _MOVE: self._move,
                _OTHER: self._other,
                _WAIT: lambda match: self.dwell(match.span(2)),
                _CONF: self._conf,
                _CALL: self._call,
                _ROUTINE: self._routine,
                _BLOCK: self._block,
            },
            more=[
                (lambda call: self.entered[call[1].lower()][1].append(self.shift), called),
                (self.displacing, self.calls(routines, _displaces)),
                (lambda label: setattr(self, 'shift', unclear_shift(self.where(label))), labels),
            ],
        )
        self._settle_shifts()
        if not self.context.controller.external:
            self.moves_beside(_EXTERNAL)
        hold_if_used_elsewhere(self.program, self.names, [self.text], [self.used])
        self.hold_shared({n: k for n, k in self.names.items() if n not in self.local}, _DECLARES)
        return self.program

    def _set_by_calls(self, routines: dict[str, str]) -> None:
        """Take in what is handed to a routine that may set it: of another file that alone."""
        for call in _CALL.finditer(self.text):
            word, handed = call[1].lower(), self.pieces(*call.span(2))
            text = routines.get(word)
            if text is None:
                sets = len(handed) == 1 and word not in _READS
            else:
                own = re.findall(r'\w+', text.partition(')')[0].lower())
                sets = any(each[1].lower() in own for each in _ASSIGNED.finditer(text))
            for start, end in handed if sets else ():
                self.again.setdefault(self.text[start:end].lower(), self.where(call, 1))

    # Declarations ----------------------------------------------------------------------------

    def _declaration(self, result: re.Match[str]) -> None:
        kind, name = result[2].lower(), result[3].lower()
        where = self.where(result, 3)
        self.used.add(result.start(3))
        if result[4] or not self.text.startswith('[', result.end()):
            return  # An array, or a value that is worked out: moves to it are not understood.
        known: list[dict[str, Any]] = [self.names, self.tools, self.bases, self.speeds]
        if any(name in table for table in known):
            raise DataError(f'{where}: {result[3]} is declared twice')
        tree = self._tree(result.end(), closing(self.source, self.text, result.end()) + 1)
        if kind in ('robtarget', 'jointtarget'):
            point = self._target(tree, result.end(), result[3], kind == 'jointtarget')
            if point is not None:
                self.names[name] = point
                self.local |= {name} if result[1] else set()
        elif kind in ('tooldata', 'wobjdata'):
            frames, read = (
                (self.tools, self._tool) if kind == 'tooldata' else (self.bases, self._wobj)
            )
            frames[name] = read(tree, result[3], result.end())
            if name in self.again:
                why = f'the numbers of {result[3]} are set anew at {self.again[name]}'
                frames[name] = Frame(result[3], why=why)
        elif isinstance(tree, list) and tree and isinstance(tree[0], Leaf):
            speed = self.number(*tree[0], f'the speed of {result[3]}').value
            self.speeds[name] = max(speed, 0.1) * 1e-3

    def _tool(self, tree: Tree, name: str, at: int) -> Frame:
        parts = tree if isinstance(tree, list) else []
        if len(parts) < 2 or not self._is(parts[0], 'TRUE'):
            return Frame('', why=f'{name} stands still, and the robot carries the workpiece')
        return Frame('', self._pose(parts[1], name, at))

    def _wobj(self, tree: Tree, name: str, at: int) -> Frame:
        parts = tree if isinstance(tree, list) else []
        if len(parts) < 5 or not self._is(parts[0], 'FALSE'):
            return Frame('', why=f'{name} moves')
        if isinstance(parts[1], Leaf) and self._is(parts[1], 'FALSE'):
            unit = re.match(r'\s*,\s*"([^"]+)"', self.source.text[parts[1].end :])
            if unit is not None:  # strings are blanked out in what the parts are of
                return self._on_unit(name, unit[1], self._pose(parts[4], name, at))
        if not self._is(parts[1], 'TRUE'):
            return Frame('', why=f'{name} moves')
        return Frame('', self._pose(parts[3], name, at) @ self._pose(parts[4], name, at))

    def _on_unit(self, name: str, unit: str, frame: Array) -> Frame:
        """Return a work object that a mechanical unit moves: the unit has its user frame itself."""
        if not self.context.controller.external:
            return Frame('', why=f'{name} moves')
        self.take_positioner(unit, 'its work objects go along with')
        self.program.notes.append(f'{unit} is taken to be the positioner, for {name} goes along')
        return Frame('', frame, True)

    def _is(self, part: Tree, word: str) -> bool:
        return isinstance(part, Leaf) and self.text[part.start : part.end].upper() == word

    def _pose(self, tree: Tree, name: str, at: int) -> Array:
        numbers = self._numbers(tree if isinstance(tree, list) else [], (3, 4), name, at)
        try:
            return ABB_POSE.value([number.value for number in numbers])
        except DataError as error:
            raise DataError(f'{self.source.where(at)}: {name}: {error}') from None

    def _target(self, tree: Tree, start: int, name: str, joints: bool) -> int | None:
        """Add a robtarget or a jointtarget that stands at a place; None of one that says too little."""
        n, external = self.context.axes, self.context.controller.external
        places = ['abcdef'.index(axis.label[-1]) for axis in external]
        parts = tree if isinstance(tree, list) else []
        at = 1 if joints else 3
        outer = self._numbers([parts[at]], (6,), name, start) if len(parts) > at else []
        given = [outer[k] if outer and abs(outer[k].value) < NO_AXIS else None for k in places]
        if joints:
            numbers = self._numbers(parts[:1], (n,), name, start)
            numbers += [number for number in given if number is not None]
            if len(numbers) < self.context.robot.n:
                return None
            point = self.program.add_point(name, numbers, self.context.degrees())
        else:
            numbers = self._numbers(parts[:2], (3, 4), name, start)
            placed = self.context.external(given)
            point = self.program.add_point(name, numbers, ABB_POSE, external=placed)
            if len(parts) > 2:
                conf = self._numbers(parts[2:3], (4,), name, start)
                self.suits[point] = quadrants([round(number.value) for number in conf])
        others = [number.value for k, number in enumerate(outer) if k not in places]
        self.program.stands_beside(point, [value for value in others if abs(value) < NO_AXIS])
        return point

    def _numbers(
        self, lists: Sequence[Tree], counts: Sequence[int], name: str, at: int
    ) -> list[Number]:
        """Return the numbers of lists of given lengths, one after the other."""
        fits = [len(part) if isinstance(part, list) else 0 for part in lists] == list(counts)
        leaves = [leaf for part in lists if isinstance(part, list) for leaf in part]
        if not fits or not all(isinstance(leaf, Leaf) for leaf in leaves):
            shape = ' and '.join(map(str, counts))
            raise DataError(f'{self.source.where(at)}: {name} needs {shape} numbers in brackets')
        return [
            self.number(leaf.start, leaf.end, f'a coordinate of {name}')
            for leaf in leaves
            if isinstance(leaf, Leaf)
        ]

    def _tree(self, start: int, end: int) -> Tree:
        """Return a bracketed value as lists in lists."""
        start, end = stripped(self.text, start, end)
        if not self.text.startswith('[', start):
            return Leaf(start, end)
        if closing(self.source, self.text, start) != end - 1:
            raise DataError(f'{self.source.where(start)}: a bracket is closed too early')
        return [self._tree(*part) for part in split_outside(self.text, start + 1, end - 1)]

    # Statements ------------------------------------------------------------------------------

    def _conf(self, result: re.Match[str]) -> None:
        self.config[result[1].lower()] = result[2].lower() == 'on'

    def _other(self, result: re.Match[str]) -> None:
        where = self.where(result)
        if result[1].lower() in _ENDED:
            line = self.text[self.text.rfind('\n', 0, result.start()) + 1 : result.start()]
            self.shift = self.shift if _COMPACT.search(line) else Frame('')
        elif result[1].lower() in _DISPLACED:
            self.shift = Frame('', why=f'{result[1]} at {where} displaces it')
        else:
            self.unknown('linear', result, f'{result[1]} is not understood')

    def _routine(self, result: re.Match[str]) -> None:
        self.new_piece(result)
        self.shift = self.entered.get(result[1].lower(), (Frame(''), []))[0]

    def _block(self, result: re.Match[str]) -> None:
        (self.shift,) = self.blocks.follow(self.where(result), result.groups(), (self.shift,))

    def _settle_shifts(self) -> None:
        """Let the moves of routines know that they are called where points are displaced."""
        own = {begun.name: begun for begun, _ in self.entered.values()}
        for _ in own:  # it may come through as many calls
            for begun, shifts in self.entered.values():
                displaced = [shift for one in shifts if (shift := own.get(one.name, one)).why]
                own[begun.name] = (displaced or [own[begun.name]])[0]
        for piece in self.program.pieces:
            for begun, _ in self.entered.values():
                exchange(piece, 'shift', begun, own[begun.name])

    def _call(self, result: re.Match[str]) -> None:
        """Take an instruction that nobody knows for a move if it is handed what moves need."""
        if any(
            known.search(self.text, result.start(1), result.end()) for known in (_MOVE, _OTHER)
        ):
            return
        for start, end in self.pieces(*result.span(2)):
            name = self.text[start : self._before_switch(start, end)].lower()
            needed = any(name in table for table in (self.names, self.tools, self.speeds))
            if needed or _OWN_DATA.fullmatch(name):
                self.unknown('linear', result, f'{result[1]} is not understood')
                return

    # Moves -----------------------------------------------------------------------------------

    def _move(self, result: re.Match[str]) -> None:
        word = (result[1] or result[2] or result[3]).lower()
        kind, where = _KINDS[word], self.where(result)
        end = self.text.find(';', result.end())
        if end < 0:
            raise DataError(f'{where}: the statement {result[0]} is not closed by ;')
        parts = self._arguments(result.end(), end)
        wanted = 2 if kind == 'circular' else 1
        if _ACTS.search(result[0]):
            parts = parts[: wanted + 3]
        if len(parts) < wanted + 3:
            raise DataError(f'{where}: {result[0]} needs a point, a speed, a zone and a tool')
        refs = [self._ref(*part, word == 'absj') for part in parts[:wanted]]
        if any(ref is None for ref in refs):
            text = self.source.text[slice(*parts[wanted - 1])].strip()
            self.unknown(kind, result, f'{result[0]} goes to {text!r}, which is not given here')
            return
        places = [ref for ref in refs if ref is not None]
        tool, base = self._frames(*parts[-1])
        speed, stop = self._travel(kind, parts, wanted)
        # Of a linear move it counts only where nobody knows where the arm comes from.
        asked = self.config['j' if kind == 'joint' else 'l']
        suits = self.suits.get(places[-1].point) if asked else None
        via = places[0] if kind == 'circular' else None
        step = Step(kind, where, places[-1], via, tool, base, speed, stop, suits=suits)
        point = self.program.points[places[-1].point]
        # It counts quadrants, of which the nearest is taken; the side of the wrist is one of two.
        astray = flags_kept(kind, point, (WRIST,)) if asked else None
        sensed = _SENSED.search(self.text, result.end(), end)
        shift = Frame('', why=f'{sensed[1]} displaces it') if sensed else self.shift
        self.program.add(replace(step, astray=astray, shift=shift))

    def _arguments(self, start: int, end: int) -> list[tuple[int, int]]:
        """Return the arguments of a move, the switches before the first left out."""
        parts: list[tuple[int, int]] = []
        for first, last in self.pieces(start, end):
            if not parts:
                switch = re.match(r'(?:\\\w+\s*)+', self.text[first:last])
                first += switch.end() if switch else 0
            if first < last:
                parts.append((first, last))
        return parts

    def _ref(self, start: int, end: int, joints: bool) -> Ref | None:
        """Return where an argument leads; None where it is worked out."""
        cut = self._before_switch(start, end)
        text = self.text[start:cut]
        if text.startswith('['):
            tree = self._tree(start, cut)
            result = self._target(tree, start, f'line {self.source.line(start)}', joints)
            return None if result is None else Ref(result)
        call = re.match(r'(Offs|RelTool)\s*(\()', text, re.I)
        if call is not None:
            return self._shifted(call[1].lower(), start + call.start(2), cut)
        point = self._named(start, cut)
        return None if point is None else Ref(point)

    def _named(self, start: int, end: int) -> int | None:
        name = self.text[start:end].lower()
        if re.fullmatch(r'[a-z]\w*', name):
            self.used.add(start)
            return self.names.get(name)
        return None

    def _shifted(self, word: str, opening: int, end: int) -> Ref | None:
        if closing(self.source, self.text, opening) != end - 1:
            return None
        parts = self.pieces(opening + 1, end - 1)
        cut = self._before_switch(*parts[-1])
        turns = self._switches(cut, parts[-1][1])
        try:
            spans = [*parts[1:-1], (parts[-1][0], cut)]
            shift = [self.number(*part, 'a shift').value * 1e-3 for part in spans]
        except DataError:
            return None
        if turns is None or len(shift) != 3 or (point := self._named(*parts[0])) is None:
            return None
        pose = transform(np.eye(3), np.array(shift))
        if word == 'offs':
            return Ref(point, pose, leads=False)
        turn = np.radians([turns.get(axis, 0.0) for axis in ('rx', 'ry', 'rz')])
        # RelTool turns about the tool's own x, then its new y, then its new z.
        about = [rotation_matrix(row) for row in np.diag(turn)]
        pose[:3, :3] = about[0] @ about[1] @ about[2]
        return Ref(point, after=pose, leads=False)

    def _switches(self, start: int, end: int) -> dict[str, float] | None:
        r"""Return the numbers of ``\Rx:=5`` and the like; None where one is worked out."""
        out = {}
        text = self.text[start:end]
        for result in re.finditer(r'\\(\w+)\s*:=\s*([^\\]*)', text):
            place = start + result.start(2), start + result.end(2)
            out[result[1].lower()] = self.value(place, np.nan)
        return None if np.isnan(list(out.values())).any() else out

    def _before_switch(self, start: int, end: int) -> int:
        """Return where an argument ends and its optional arguments begin."""
        depth = 0
        for k in range(start, end):
            depth += (self.text[k] in '([{') - (self.text[k] in ')]}')
            if self.text[k] == '\\' and depth == 0:
                return stripped(self.text, start, k)[1]
        return end

    def _frames(self, start: int, end: int) -> tuple[Frame, Frame]:
        """Return tool and work object of a move's last argument."""
        cut = self._before_switch(start, end)
        tool = self.text[start:cut]
        wobj = re.search(r'\\WObj\s*:=\s*([A-Za-z]\w*)', self.text[cut:end], re.I)
        base = 'wobj0' if wobj is None else wobj[1]
        return (
            self.tools.get(tool.lower()) or self.named(tool, tool.lower()),
            self.bases.get(base.lower()) or self.named(base, base.lower()),
        )

    def _travel(self, kind: Kind, parts: Sequence[tuple[int, int]], at: int) -> tuple[float, bool]:
        """Return the speed of a move and whether it stops."""
        start, end = parts[at]
        speed = self.text[start : self._before_switch(start, end)].lower()
        value = self.speeds.get(speed)
        # v200 is 200 mm/s; a move may also have the numbers of its speed itself.
        usual = re.match(r'v(\d+)$|\[\s*(\d+\.?\d*(?:e[+-]?\d+)?)\s*,', speed)
        if value is None:
            value = float(usual[1] or usual[2]) * 1e-3 if usual else SPEED
        start, end = parts[-2]
        zone = self.text[start : self._before_switch(start, end)].lower()
        if kind == 'joint':
            # Of a joint move the speed is the tool's too; 1 m/s is near a tenth of full speed.
            value = float(np.clip(value / 10.0, 0.01, 1.0))
        return max(value, LEAST_SPEED), zone == 'fine'


def _displaces(text: str) -> bool:
    """Return whether points are displaced after a routine, by its text."""
    words = [result[1].lower() for result in _OTHER.finditer(text)]
    last = next((word for word in reversed(words) if word in (*_DISPLACED, *_ENDED)), '')
    return last in _DISPLACED
