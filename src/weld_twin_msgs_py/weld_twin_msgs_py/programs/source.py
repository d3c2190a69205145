# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The text of a program, kept to the byte, with the places of the numbers in it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from weld_twin_core.errors import DataError

SIZE_LIMIT = 20_000_000
"""Bytes; programs of a hundred thousand points have some ten megabytes."""
NUMBER = r'[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?'
"""A number as all of these languages write it."""
_ALONE = re.compile(rf'\s*({NUMBER})\s*\Z')


@dataclass(frozen=True)
class Source:
    """One file of a program."""

    name: str
    """Without folders."""
    text: str
    """Every byte one character, so that what is not understood goes through unharmed."""

    def line(self, place: int) -> int:
        """Return the number of the line, counted from 1, in which a character stands."""
        return self.text.count('\n', 0, place) + 1

    def where(self, place: int) -> str:
        """Return file and line of a character, as messages have it."""
        return f'{self.name} line {self.line(place)}'

    def lines(self, text: str | None = None) -> Iterator[tuple[int, str]]:
        """Yield place and content of every line, of another text of the same length if given."""
        place = 0
        for line in (self.text if text is None else text).splitlines(keepends=True):
            yield place, line.rstrip('\r\n')
            place += len(line)


class Number(NamedTuple):
    """A number in a text: its value, and where it stands."""

    value: float
    start: int
    end: int
    file: int = 0


def read_source(path: Path | str) -> Source:
    """
    Return the text of a file.

    Raises DataError: it cannot be read, is empty, too large, or no text.
    """
    try:
        with Path(path).open('rb') as file:
            raw = file.read(SIZE_LIMIT + 1)
    except OSError as error:
        raise DataError(f"program '{path}' cannot be read: {error.strerror}") from None
    if len(raw) > SIZE_LIMIT:
        raise DataError(f"program '{path}' is larger than any robot program")
    if not raw.strip():
        raise DataError(f"program '{path}' is empty")
    if b'\0' in raw:
        raise DataError(
            f"program '{path}' is no text; export it from the controller as text (ASCII) first"
        )
    return Source(Path(path).name, raw.decode('latin-1'))


def number_at(source: Source, start: int, end: int, what: str, file: int = 0) -> Number:
    """
    Return the number that a piece of text is.

    Raises DataError: the piece is not one number, or not a finite one.

    start, end: the piece.
    what: what the number is, for the message.
    file: which of the program's files.
    """
    piece = source.text[start:end]
    match = _ALONE.match(piece)
    if match is None:
        raise DataError(f'{source.where(start)}: {what} must be a number, got {_short(piece)!r}')
    value = float(match[1])
    if not abs(value) < 1e12:
        raise DataError(f'{source.where(start)}: {what} is {match[1]}, which no robot can reach')
    return Number(value, start + match.start(1), start + match.end(1), file)


def split_outside(text: str, start: int, end: int, comma: str = ',') -> list[tuple[int, int]]:
    """Return the parts of text[start:end] between commas that stand in no brackets."""
    parts, depth, begin = [], 0, start
    for k in range(start, end):
        letter = text[k]
        if letter in '([{':
            depth += 1
        elif letter in ')]}':
            depth -= 1
        elif letter == comma and depth == 0:
            parts.append((begin, k))
            begin = k + 1
    parts.append((begin, end))
    return parts


def closing(source: Source, text: str, opening: int) -> int:
    """
    Return the place of the bracket that closes the one at a place.

    Raises DataError: none does.
    """
    depth = 0
    for k in range(opening, len(text)):
        if text[k] in '([{':
            depth += 1
        elif text[k] in ')]}':
            depth -= 1
            if depth == 0:
                return k
    raise DataError(f'{source.where(opening)}: the bracket {text[opening]!r} is not closed')


def stripped(text: str, start: int, end: int) -> tuple[int, int]:
    """Return a piece of text without white space at its ends."""
    while start < end and text[start].isspace():
        start += 1
    while end > start and text[end - 1].isspace():
        end -= 1
    return start, end


def masked(text: str, patterns: Sequence[str]) -> str:
    """Return a text of the same length with comments and strings blanked out, line ends kept."""
    either = re.compile('|'.join(f'(?:{pattern})' for pattern in patterns))
    return either.sub(lambda result: re.sub(r'[^\r\n]', ' ', result[0]), text)


def _short(text: str) -> str:
    text = ' '.join(text.split())
    return text if len(text) <= 40 else text[:37] + '...'
