# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What is sent with requests: no more than is allowed, and not slower than a poor line.

Only the time is counted in which the server waits for bytes, not the time that its own disk takes.
Where many send at once, whoever lags most behind the slowest pace allowed gives way to who comes.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from typing import Any

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
    """
    The body of one request, read through `receive`.

    party: who sends it.
    receive: what the server hands out.
    most: bytes allowed.
    length: bytes announced; None for what is no number.
    """

    def __init__(
        self, bodies: Bodies, party: str, receive: Receive, most: int, length: int | None
    ) -> None:
        self.party, self.gave_way = party, False
        self._bodies, self._receive, self._most, self._length = bodies, receive, most, length
        self._got, self._lag, self._since = 0, 0.0, 0.0
        self.whole = False

    async def receive(self) -> dict[str, Any]:
        """
        Return the next message.

        Raises TooMuch, TooSlow, Busy.
        """
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
    """
    All bodies that are being read.

    of_party, of_all: how many are read at the same time, of one party and of all.
    """

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
