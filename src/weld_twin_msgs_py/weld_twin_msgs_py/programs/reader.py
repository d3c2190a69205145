# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What all readers share: a text without comments, gone through once, and frames where it branches."""

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from weld_twin_core.errors import DataError
from weld_twin_core.motion.programs.travel import Kind

from .build import Program, Step, exchange
from .controllers import Context, Frame
from .source import Number, Source, masked, number_at, split_outside, stripped

Span = tuple[int, int]
Handler = Callable[[re.Match[str]], None]
_HANDED = re.compile(
    r'^[ \t]*(?:\w+[ \t]+)?(?:PROC|DEF|(?:FUNC|DEFFCT)[ \t]+\w+)[ \t]+\w+[ \t]*\(([^)]*)\)',
    re.I | re.M,
)
"""Head of a routine, and what it is handed."""
_GOTO = re.compile(r'^[^\r\n]*\bGOTO[ \t]+(\w+)', re.I | re.M)
_LABEL = re.compile(r'^[ \t]*(\w+)[ \t]*:(?!=)', re.M)
LEAST_SPEED = 1e-4
"""Speed [m/s, or share of full speed] below which nothing moves."""


class Reader(ABC):
    """Reads a program of one language; the first source is the program, others belong to it."""

    comments: ClassVar[tuple[str, ...]]
    """Regular expressions of what is blanked out: comments and strings."""
    routine: ClassVar[re.Pattern[str]] = re.compile(r'(?!)')
    """Head of a routine that other files may call, its name the first group."""
    call: ClassVar[str] = ''
    """Pattern of its call, with {} for the name."""

    def __init__(self, sources: Sequence[Source], context: Context) -> None:
        self.sources, self.context = list(sources), context
        self.source = self.sources[0]
        self.texts = [masked(source.text, self.comments) for source in sources]
        self.text = self.texts[0]
        self.program = Program('', self.sources)
        self.again: dict[str, str] = {}
        self.assigned: dict[str, str] = {}
        """Where the program itself sets what has a name, of which it may say no numbers."""
        self.shift = Frame('')
        """Why moves go elsewhere than their points say, where the text is read."""
        self.posture = ''
        """Flags of the posture that the arm comes in, of languages that do not say what they mean."""
        self.routines = 0
        self.positioner = ''
        """The external kinematic system that bases go along with."""
        self.own = {head[1].lower() for head in self.routine.finditer(self.text)}
        self.called = self._called()
        """Other files with routines that this one calls, or that those call, and their texts."""

    @abstractmethod
    def read(self) -> Program:
        """Return what is understood of the program."""

    def in_order(
        self,
        handlers: dict[re.Pattern[str], Handler],
        start: int = 0,
        end: int | None = None,
        more: Sequence[tuple[Handler, Sequence[re.Match[str]]]] = (),
    ) -> None:
        """Hand what patterns find in the text, and what was found, to handlers, as it stands there."""
        stop = len(self.text) if end is None else end
        matches = [
            (match.start(), handle, match)
            for pattern, handle in handlers.items()
            for match in pattern.finditer(self.text, start, stop)
        ]
        matches += [(match.start(), handle, match) for handle, found in more for match in found]
        for _, handle, match in sorted(matches, key=lambda each: each[0]):
            handle(match)

    def _called(self) -> list[tuple[Source, str]]:
        rest = [(source, masked(source.text, self.comments)) for source in self.context.beside]
        out, callers = list[tuple[Source, str]](), [self.text]
        for caller in callers:  # grows by those that are called
            for each in list(rest):
                names = {head[1].lower() for head in self.routine.finditer(each[1])} - self.own
                if names and self._call_of(names).search(caller):
                    rest.remove(each)
                    out.append(each)
                    callers.append(each[1])
        return out

    def _call_of(self, names: Iterable[str]) -> re.Pattern[str]:
        listed = '|'.join(map(re.escape, sorted(names)))
        return re.compile(self.call.replace('{}', f'(?:{listed})'), re.I | re.M)

    def routines_named(self) -> list[tuple[str, str]]:
        """Return names and statements of the routines here, and of others in the files they call."""
        out = list[tuple[str, str]]()
        for text in (self.text, *(text for _, text in self.called)):
            heads = list(self.routine.finditer(text))
            ends = [*(head.start() for head in heads[1:]), len(text)]
            out += [
                (head[1], text[head.end() : end])
                for head, end in zip(heads, ends, strict=False)
                if text is self.text or head[1].lower() not in self.own
            ]
        return out

    def calls(
        self, routines: Sequence[tuple[str, str]], does: Callable[[str], object]
    ) -> list[re.Match[str]]:
        """Return calls of routines that do something or call one that does."""
        names = {name.lower() for name, text in routines if does(text)}
        while names:
            pattern = self._call_of(names)
            more = {name.lower() for name, text in routines if pattern.search(text)}
            if more <= names:
                return list(pattern.finditer(self.text))
            names |= more
        return []

    def labels(self) -> list[re.Match[str]]:
        """Return the labels that a GOTO leads to, of languages that write both alike."""
        aims = {match[1].lower() for match in _GOTO.finditer(self.text)}
        return [match for match in _LABEL.finditer(self.text) if match[1].lower() in aims]

    def set_again(self, pattern: re.Pattern[str]) -> dict[str, str]:
        """
        Return, by name, where what is set more than once, or in parts, is set so.

        What it is at a move hangs on what ran before, which nobody follows here. So does what a
        routine is handed under that name.

        pattern: its first group is the name, its second is empty where the whole is set. Names are
        in lower case where it ignores case, as its language does.
        """
        out, whole = dict[str, str](), set[str]()
        for source, text in zip(self.sources, self.texts, strict=True):
            for match in pattern.finditer(text):
                name = re.sub(r'\s', '', match[1])
                name = name.lower() if pattern.flags & re.IGNORECASE else name
                self.assigned.setdefault(name, source.where(match.start(1)))
                if match[2] or name in whole:
                    out.setdefault(name, source.where(match.start(1)))
                whole.add(name)
            for head in _HANDED.finditer(text):
                for name in re.findall(r'\w+', head[1]):
                    name = name.lower() if pattern.flags & re.IGNORECASE else name
                    out.setdefault(name, source.where(head.start()))
        for source, text in self.called:
            for match in pattern.finditer(text):
                out.setdefault(re.sub(r'\s', '', match[1]).lower(), source.where(match.start(1)))
        return out

    def named(self, name: str, key: str) -> Frame:
        """Return a frame of which the program has no numbers, unless it works them out itself."""
        where = self.assigned.get(key, '')
        return Frame(name, why=where and f'the numbers of {name} are set at {where}')

    def numbered_set(self, pattern: re.Pattern[str]) -> None:
        """Take in where a frame of a table (first group) and number (second), or of any, is set."""
        for source, text in [(self.source, self.text), *self.called]:
            for match in pattern.finditer(text):
                self.again.setdefault(match[1] + match[2], source.where(match.start()))

    def numbered(self, table: str, index: str) -> Frame:
        """Return a frame of a table; one that the program sets is not what the table holds."""
        where = self.again.get(table + index, self.again.get(table, ''))
        return Frame(index, why=where and f'the numbers of {table} {index} are set at {where}')

    def another_posture(self, kind: Kind, point: int, flags: str) -> str:
        """Return that a joint move asks by its flags for another posture than the arm comes in."""
        if self.program.points[point].value.ndim == 1:
            self.posture = ''
            return ''
        self.posture = self.posture or flags
        if kind != 'joint' or not flags or flags == self.posture:
            return ''
        return (
            f'its flags ({flags}) are not those of the poses before ({self.posture}), and what posture '
            'they mean differs between arms; give it in joints'
        )

    def displacing(self, match: re.Match[str]) -> None:
        """Let a call, with the routine's name as its first group, displace what follows it."""
        self.shift = Frame('', why=f'{match[1]}, called at {self.where(match, 1)}, displaces it')

    def where(self, match: re.Match[str], group: int = 0) -> str:
        """Return file and line of what was found."""
        return self.source.where(match.start(group))

    def number(self, start: int, end: int, what: str) -> Number:
        """Return the number that a piece of the text is; see `number_at`."""
        return number_at(self.source, start, end, what)

    def value(self, span: Span | None, default: float) -> float:
        """Return the number of a piece of text, the default where there is none, or one worked out."""
        try:
            return default if span is None else self.number(*span, 'a number').value
        except DataError:
            return default

    def pieces(self, start: int, end: int, comma: str = ',') -> list[Span]:
        """Return what stands between commas outside of brackets, without white space."""
        return [stripped(self.text, *part) for part in split_outside(self.text, start, end, comma)]

    def dwell(self, span: Span) -> None:
        """Let the move before last longer; of a time that is worked out nobody knows how much."""
        try:
            self.program.dwell(max(self.number(*span, 'a time').value, 0.0))
        except DataError:
            return

    def new_piece(self, match: re.Match[str]) -> None:
        """Begin another routine."""
        del match
        self.routines += 1
        self.program.new_piece()

    def settle(self, name: str, inherited: Frame, own: Sequence[Frame]) -> None:
        """
        Give moves that stand before any frame of their routine the one that the program sets.

        Where it sets several, nobody knows which holds when the routine is called.
        """
        values = {(f.name, f.why, None if f.value is None else f.value.tobytes()) for f in own}
        if len(values) > 1:
            return
        only = own[0] if own else Frame('')
        if not own and self.program.steps:
            self.program.notes.append(
                f'the program sets no {name}, and that of the robot file was taken; where the '
                'controller has another, set it in the program'
            )
        for piece in self.program.pieces:
            exchange(piece, name, inherited, only)

    def shift_all(self, pattern: re.Pattern[str], why: str) -> None:
        """Let no move go where its point says, for a reason with {} for where a pattern stands."""
        match = pattern.search(self.text)
        if match is not None:
            shift = Frame('', why=why.format(self.where(match)))
            for piece in self.program.pieces:
                piece[:] = [replace(step, shift=shift) for step in piece]

    def hold_shared(self, names: Mapping[str, int], own: re.Pattern[str]) -> None:
        """
        Keep points that other programs of the folder use, for nobody corrects them there.

        own: what declares a name of its own (first group) in such a program.
        """
        for source in self.context.beside:
            text = masked(source.text, self.comments)
            declared = {match[1].lower() for match in own.finditer(text)}
            for match in re.finditer(r'[A-Za-z_]\w*', text):
                if (name := match[0].lower()) in names and name not in declared:
                    why = f'{match[0]} is used at {source.where(match.start())} as well'
                    self.program.hold(names[name], f'{why}, which is not corrected with it')

    def moves_beside(self, pattern: re.Pattern[str]) -> None:
        """Take in where external axes move, but those (first group) that the robot file has."""
        known = {axis.label for axis in self.context.controller.external}
        for source, text in zip(self.sources, self.texts, strict=True):
            for match in pattern.finditer(text):
                if match[1].upper() not in known:
                    self.program.beside = self.program.beside or source.where(match.start())

    def take_positioner(self, name: str, goes_along: str) -> None:
        """Refuse a second external kinematic system: a robot file has one positioner."""
        self.positioner = self.positioner or name
        if name != self.positioner:
            raise DataError(
                f'{self.source.name}: {goes_along} {self.positioner} and {name}, and a robot file has '
                'one positioner; split it'
            )

    def unknown(self, kind: Kind, match: re.Match[str], why: str) -> None:
        """Add a move that is not understood."""
        self.program.unknown(kind, self.where(match), why)


Unclear = Callable[[str], Frame]
"""Makes the frame of a place that several ways lead to; takes where they part."""
Frames = tuple[Frame, ...]
_CASES = ('switch', 'test')
"""Words that begin branches of which the first has a word of its own."""
_PARTED = ('if', *_CASES)
"""Words that begin branches; all others begin loops."""
_REST = ('else', 'default')
"""Words that begin the branch which is taken where no other is."""


@dataclass
class _Block:
    """A loop, or branches of which one is taken."""

    where: str
    word: str  # that began it, or its last branch, in lower case
    loop: bool
    head: Frames  # what holds where it begins
    moves: list[Step]
    first: int  # the routine it stands in, and how many moves stand before it
    ends: list[Frames] = field(default_factory=list)
    """What holds at the ends of its branches so far, and where a loop is left or begun anew within."""


class Blocks:
    """
    Follows frames through branches and loops; calls ``unclear`` with the field of a move.

    A frame that not every way sets alike is unclear after them, and in a loop until it is set.
    """

    def __init__(self, program: Program, **unclear: Unclear) -> None:
        self._program, self._unclear = program, unclear
        self._open: list[_Block] = []

    def follow(self, where: str, words: Sequence[str | None], now: Frames) -> Frames:
        """
        Return what holds after a word.

        words: that begins a block, or a branch, or ends a block; None for all but one, or for all
        where a loop is left.
        """
        begun, parted, ended = words
        if begun:
            self.begin(where, begun, now)
        elif parted:
            return self.branch(parted, now)
        elif ended:
            return self.end(now)
        else:
            self.leave(now)
        return now

    def begin(self, where: str, word: str, now: Frames) -> None:
        """Begin the block of a word, where frames hold now."""
        moves, word = self._program.pieces[-1], word.lower()
        self._open.append(_Block(where, word, word not in _PARTED, now, moves, len(moves)))

    def branch(self, word: str, now: Frames) -> Frames:
        """Begin the branch of a word; return what holds there."""
        if not self._open:
            return now
        block = self._open[-1]
        if block.word not in _CASES:
            block.ends.append(now)
        block.word = word.lower()
        return block.head

    def leave(self, now: Frames) -> None:
        """Leave the loop that is around, or begin its next round."""
        for block in [each for each in self._open if each.loop][-1:]:
            block.ends.append(now)

    def end(self, now: Frames) -> Frames:
        """End a block; return what holds after it."""
        if not self._open:
            return now
        block = self._open.pop()
        ways = [*block.ends, now] if block.word in _REST else [block.head, *block.ends, now]
        after = []
        for k, (name, unclear) in enumerate(self._unclear.items()):
            alike = all(same_frame(way[k], ways[0][k]) for way in ways)
            after.append(ways[0][k] if alike else unclear(block.where))
            if block.loop and not alike:
                # Moves of its first round have what a later round finds otherwise.
                exchange(block.moves, name, block.head[k], after[k], block.first)
        return tuple(after)


def unclear(what: str) -> Unclear:
    """Return what makes a frame that is named by what sets it."""
    return lambda where: Frame(
        what, why=f'the numbers of {what} hang on which way the program takes at {where}'
    )


def unclear_shift(where: str) -> Frame:
    """Return the shift of a place that is displaced on some of its ways."""
    return Frame(
        '',
        why=f'whether it goes where its point says hangs on which way the program takes at {where}',
    )


def same_frame(one: Frame, other: Frame) -> bool:
    """Return whether two frames are one."""
    if (one.name, one.moving, one.why) != (other.name, other.moving, other.why):
        return False
    if one.value is None or other.value is None:
        return one.value is other.value
    return np.array_equal(one.value, other.value)
