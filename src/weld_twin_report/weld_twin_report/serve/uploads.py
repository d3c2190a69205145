# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Files that somebody dropped, written into a folder: few, small enough, under plain names.

Bodies of requests come not slower than a poor line, by the time in which the server waits for bytes.
Where many send at once, whoever lags most gives way to who comes.
"""

from __future__ import annotations

import asyncio
import re
import time
import unicodedata
from collections.abc import Awaitable, Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.programs.languages import LANGUAGES
from weld_twin_msgs_py.robots import robot_names

from ..history.entry import instant
from .fields import CORRECT, DIAGNOSE, IMPORT, given
from .job import DIAGNOSIS, OTHERS, TABLES, Asked, title

RATE = 16_000.0
"""Bytes a second that somebody must send on average; a poor mobile line has ten times as much."""
BEHIND = 30.0
"""Seconds that somebody may lag behind this pace: a line that breaks down for a moment recovers."""
GIVES_WAY = 0.5
"""Seconds behind after which somebody gives way to others who wait."""
OF_PARTY, OF_ALL = 16, 64
"""Bodies read at the same time: of one user, or of all at one address who have no key; and of all. The
parser holds a megabyte of each."""
PATIENCE = 30.0
"""Seconds for which somebody waits until others have sent theirs."""
TICK = 0.25
"""Seconds between two looks."""
DRAINED = 100_000_000
"""Bytes that are still taken of what was refused: a browser shows an answer once it has sent all."""
Receive = Callable[[], Awaitable[dict[str, Any]]]


class TooMuch(Exception):
    """The body of a request is larger than is allowed."""


class TooSlow(Exception):
    """The body of a request does not come."""


class Busy(Exception):
    """Too many send at the same time."""


class Body:
    """The body of one request, of so many bytes as were announced and allowed, as it comes in."""

    def __init__(
        self, bodies: Bodies, party: str, receive: Receive, most: int, length: int | None
    ) -> None:
        self.party, self.gave_way = party, False
        self._bodies, self._receive, self._most, self._length = bodies, receive, most, length
        self._got, self._lag, self._since = 0, 0.0, 0.0
        self.whole = False

    async def receive(self) -> dict[str, Any]:
        """Return the next message, or raise TooMuch, TooSlow or Busy."""
        if self._length is None or self._length > self._most:
            raise TooMuch
        await self._bodies.enter(self)
        message = await self._next()
        if self._got > self._most:
            raise TooMuch
        return message

    async def drain(self) -> None:
        """Take what was refused, within bounds, so that the other side reads why."""
        if self._length is None or self._length > self._got + DRAINED:
            return
        until = self._got + DRAINED
        while not self.whole and self._got < until:
            await self._next()

    def behind(self) -> float:
        """Return the seconds that it lags behind the slowest pace allowed; nothing is sent ahead."""
        return self._lag + (time.monotonic() - self._since if self._since else 0.0)

    async def _next(self) -> dict[str, Any]:
        self._since = time.monotonic()
        try:
            while True:
                try:
                    message = await asyncio.wait_for(self._receive(), None if self.whole else TICK)
                    break
                except asyncio.TimeoutError:
                    if self.gave_way or self.behind() > BEHIND:
                        raise TooSlow from None
        finally:
            self._lag, self._since = self.behind(), 0.0
        count = len(message.get('body', b''))
        self._got += count
        self._lag = max(self._lag - count / RATE, 0.0)
        if message['type'] != 'http.request' or not message.get('more_body'):
            self.whole = True
            self._bodies.leave(self)
        return message


class Bodies:
    """All bodies that are being read, and how many may be, of one party and of all."""

    def __init__(self, of_party: int = OF_PARTY, of_all: int = OF_ALL) -> None:
        self._of_party, self._of_all = of_party, of_all
        self._read: dict[Body, None] = {}

    async def enter(self, body: Body) -> None:
        """Wait until there is room for a body; it is there until it is whole, or leaves."""
        until = time.monotonic() + PATIENCE
        while body not in self._read and not body.whole:
            others = self._of_others(body.party)
            if not others:
                self._read[body] = None
                return
            slowest = max(others, key=Body.behind)
            if slowest.behind() > GIVES_WAY:
                slowest.gave_way = True
                self.leave(slowest)
            elif time.monotonic() > until:
                raise Busy
            else:
                await asyncio.sleep(TICK)

    def leave(self, body: Body) -> None:
        """Forget a body."""
        self._read.pop(body, None)

    def _of_others(self, party: str) -> list[Body]:
        """Return the bodies one of which has to go first; none where there is room."""
        mine = [each for each in self._read if each.party == party]
        if len(mine) >= self._of_party:
            return mine
        return list(self._read) if len(self._read) >= self._of_all else []


A_SECOND = 100.0
"""Requests a second that are answered at once; a server makes a few hundred pages a second."""
AHEAD = 200.0
"""Requests that may come at once after a pause: twenty browsers that begin together."""
LONGEST = 5.0
"""Seconds that a request is held back at most; beyond, it is refused."""
MOST = 10_000
"""Parties that are remembered; more are forgotten, which lets them ask at once."""


class Rates:
    """Holds back who asks too often."""

    def __init__(self) -> None:
        self._free: dict[str, float] = {}  # when the last request of a party would be paid for

    def wait(self, party: str) -> float | None:
        """Return for how long a request is held back [s]; None if it is refused."""
        now = time.monotonic()
        earliest = now - AHEAD / A_SECOND
        free = max(self._free.pop(party, earliest), earliest) + 1.0 / A_SECOND
        if len(self._free) >= MOST:
            self._free.clear()
        wait = max(free - now, 0.0)
        if wait > LONGEST:
            self._free[party] = free - 1.0 / A_SECOND
            return None
        self._free[party] = free
        return wait


BAGS = ('.mcap', '.db3', '.bag', '.zstd')
"""Suffixes of a bag's files."""
PROGRAMS = tuple(suffix for one in LANGUAGES.values() for suffix in (*one.extensions, *one.beside))
"""Suffixes of programs."""
NAME_BYTES = 200
"""Bytes of a file's name; systems take 255, and some are added."""
PIECE = 1 << 20
"""Bytes copied at once."""
CELL = 80
"""Characters of a cell's name."""


class Upload(Protocol):
    """A file of a form."""

    filename: str | None

    async def read(self, size: int = -1) -> bytes:
        """Return so many bytes of it."""


async def save(uploads: Sequence[Upload], place: Path, most: int) -> tuple[str, ...]:
    """Write the files of a recording into a new folder of their title, and return their names."""
    names = _names(uploads, BAGS + TABLES + OTHERS, 'a bag, a table nor a robot file', most)
    if not names:
        raise DataError('choose a recording first: a bag, or a table of angles and positions')
    if not any(name.lower().endswith(BAGS + TABLES) for name in names):
        raise DataError(
            'no recording is among these: a bag ends in .mcap or .db3, a table in .csv'
        )
    await _write(uploads, names, place / title(names))
    return names


async def save_program(
    uploads: Sequence[Upload], model: Sequence[Upload], place: Path, beside: Path
) -> tuple[str, ...]:
    """Write a program in a folder, what it is corrected by ``beside``; return the program's names."""
    names = _names(uploads, PROGRAMS, 'a program nor a file that belongs to one', 8)
    if not names:
        raise DataError('choose a program first')
    models = _names(model, (*OTHERS, '.json'), 'a diagnosis nor a robot file', 2)
    if sum(name.lower().endswith('.json') for name in models) > 1:
        raise DataError(
            'two diagnoses were dropped; drop the one that the program is corrected by'
        )
    await _write(uploads, names, place / title(names))
    kept_as = [DIAGNOSIS if name.lower().endswith('.json') else name for name in models]
    await _write(model, kept_as, beside)
    return names


def _names(
    uploads: Sequence[Upload], suffixes: tuple[str, ...], kind: str, most: int
) -> tuple[str, ...]:
    names = tuple(_name(upload.filename, suffixes, kind) for upload in _chosen(uploads))
    if len(names) > most:
        raise DataError(f'{len(names)} files are too many; {most} are taken')
    if len({name.casefold() for name in names}) < len(names):
        raise DataError('two files have the same name; drop one recording at a time')
    return names


def _chosen(uploads: Sequence[Upload]) -> list[Upload]:
    return [upload for upload in uploads if upload.filename]


async def _write(uploads: Sequence[Upload], names: Sequence[str], place: Path) -> None:
    place.mkdir(parents=True)
    for name, upload in zip(names, _chosen(uploads), strict=True):
        with (place / name).open('xb') as stream:
            while piece := await upload.read(PIECE):
                stream.write(piece)


def _name(given: str | None, suffixes: tuple[str, ...], kind: str) -> str:
    """Return the last part of a name, refused where it cannot be shown, or is of another kind."""
    name = re.split(r'[/\\]', given or '')[-1].strip()
    hidden = any(unicodedata.category(sign)[0] in 'CZ' and sign != ' ' for sign in name)
    if hidden or name.startswith(('.', '-')) or len(name.encode()) > NAME_BYTES:
        raise DataError(
            'a file has a name that is too long, begins with a dot or a dash, or has signs that '
            'cannot be seen; rename it'
        )
    if not name.lower().endswith(suffixes):
        raise DataError(f'{name!r} is neither {kind}')
    return name


def asked_of(form: Mapping[str, Any], names: Sequence[str]) -> Asked:
    """Return what a form asks of a recording; its robot is empty where none was chosen."""
    options = given(_texts(form), (IMPORT, DIAGNOSE))
    tables = [name for name in names if name.lower().endswith(TABLES)]
    if 'joint_signs' in options and not tables:
        raise DataError('signs are those of a table; the joints of a bag have their own')
    at, cell = _text(form, 'at'), _text(form, 'cell')[:CELL]
    if at:
        instant(at)
    if not cell.isprintable():
        raise DataError("a cell's name has signs that cannot be shown")
    robot = _robot(form, [name for name in names if name.lower() != 'metadata.yaml'])
    return Asked(robot, _text(form, 'apply') == 'yes', cell, at, options)


def asked_of_program(form: Mapping[str, Any], names: Sequence[str]) -> Asked:
    return Asked(_robot(form, names), told=given(_texts(form), (CORRECT,)))


def _robot(form: Mapping[str, Any], names: Sequence[str]) -> str:
    own = [name for name in names if name.lower().endswith(OTHERS)]
    robot = _text(form, 'robot') or (own[0] if own else '')
    if robot and robot not in own and robot.lower() not in map(str.lower, robot_names()):
        raise DataError(
            'the robot is none of those bundled or on this machine; drop its file with the recording'
        )
    return robot


def _texts(form: Mapping[str, Any]) -> dict[str, str]:
    return {name: _text(form, name) for name in form}


def _text(form: Mapping[str, Any], name: str) -> str:
    value = form.get(name, '')
    return value.strip() if isinstance(value, str) else ''
