# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which frames hold where a program branches or goes round: nobody knows which way it takes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from .build import Program, Step, exchange
from .controllers import Frame

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
            alike = all(_same(way[k], ways[0][k]) for way in ways)
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


def _same(one: Frame, other: Frame) -> bool:
    if (one.name, one.moving, one.why) != (other.name, other.moving, other.why):
        return False
    if one.value is None or other.value is None:
        return one.value is other.value
    return np.array_equal(one.value, other.value)
