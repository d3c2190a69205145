# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Connections that say nothing, or say it slowly, keep nobody out.

A connection has a few seconds for the head of its request. Of one address only so many may wait for
theirs, and of all only so many may be open; beyond, the one that has waited longest gives way, which is
never that of somebody who asks at once. uvicorn has a limit for idle connections after an answer and
none before the first request. Hypercorn closes slow heads, granian all but silent ones; no server
counts by address, so that this class would be needed beside them as well.
"""

from __future__ import annotations

import asyncio
import resource
import time
from typing import Any, NamedTuple

HEAD = 10.0
"""Seconds that the head of a request may take; a browser sends it at once, in one piece."""
GRACE = 1.0
"""Seconds in which nobody gives way: many that come at once are read one after the other."""
OF_ADDRESS = 64
"""Connections of one address that may wait for a head; a browser opens six."""
OF_ALL = 4000
"""Connections open at the same time, where the system allows so many files."""
SPARE = 200
"""Files that are left for recordings, databases and processes."""
LATE = b'HTTP/1.1 408 Request Timeout\r\nconnection: close\r\ncontent-length: 0\r\n\r\n'
Client = tuple[str, int]


class Door(NamedTuple):
    """A connection whose head has not come yet."""

    transport: asyncio.Transport
    timer: asyncio.TimerHandle
    since: float


class Doors:
    """
    All connections of a server.

    of_address, of_all: how many may wait for a head, of one address; how many may be open.
    head: [s]
    """

    def __init__(
        self, of_address: int = OF_ADDRESS, of_all: int | None = None, head: float = HEAD
    ) -> None:
        self._of_address, self._head = of_address, head
        self._of_all = _most_open() if of_all is None else of_all
        self._open: dict[Client, asyncio.Transport] = {}
        self._waiting: dict[Client, Door] = {}  # the first has waited longest

    def opened(self, transport: asyncio.Transport) -> None:
        """Take a new connection."""
        client = _client(transport)
        self._open[client] = transport
        self._wait(client)
        mine = [each for each in self._waiting if each[0] == client[0]]
        if len(mine) > self._of_address and self._idle(mine[0]):
            self._give_way(mine[0])
        elif len(self._open) > self._of_all:
            first = next(iter(self._waiting))
            self._give_way(first if self._idle(first) else client)

    def _idle(self, client: Client) -> bool:
        """Return whether a connection had the time to say something."""
        return time.monotonic() - self._waiting[client].since > GRACE

    def closed(self, transport: asyncio.Transport) -> None:
        """Forget a connection."""
        client = _client(transport)
        self._open.pop(client, None)
        self.began(client)

    def began(self, client: Client) -> None:
        """Note that the head of a request has come."""
        door = self._waiting.pop(client, None)
        if door is not None:
            door.timer.cancel()

    def ended(self, client: Client) -> None:
        """Note that a request was answered: the next one has its own time."""
        if client in self._open:
            self._wait(client)

    def _wait(self, client: Client) -> None:
        transport = self._open[client]
        timer = asyncio.get_running_loop().call_later(self._head, self._late, client)
        self._waiting[client] = Door(transport, timer, time.monotonic())

    def _late(self, client: Client) -> None:
        door = self._waiting.pop(client, None)
        if door is not None:
            door.transport.write(LATE)
            door.transport.close()

    def _give_way(self, client: Client) -> None:
        door = self._waiting.pop(client)
        door.timer.cancel()
        door.transport.abort()


def protocol(doors: Doors) -> type[asyncio.Protocol]:
    """Return what uvicorn speaks, with these doors."""
    from uvicorn.protocols.http.h11_impl import H11Protocol

    class Held(H11Protocol):
        def connection_made(self, transport: Any) -> None:
            super().connection_made(transport)
            self._through = transport
            doors.opened(transport)

        def connection_lost(self, exc: Exception | None) -> None:
            doors.closed(self._through)
            super().connection_lost(exc)

    return Held


def _client(transport: asyncio.Transport) -> Client:
    """Return address and port of the other side, as requests have them."""
    reported = transport.get_extra_info('peername') or ('', id(transport))
    return str(reported[0]), int(reported[1])


def _most_open() -> int:
    """Return how many connections may be open, having asked the system for what it allows."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = OF_ALL + SPARE
    most = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
    if soft != resource.RLIM_INFINITY and soft < most:
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
    else:
        most = wanted
    return max(most - SPARE, OF_ADDRESS)
