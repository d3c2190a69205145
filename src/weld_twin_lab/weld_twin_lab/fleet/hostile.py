# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""People who mean a server ill: a program of its own that holds so many connections, in five ways."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from collections import Counter
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager
from urllib.parse import urlsplit

PAUSE = 0.1
"""Seconds before a connection that was closed is opened anew."""
DRIP = 1.0
"""Seconds between two bytes of somebody who sends slowly."""
UPLOAD = (
    b'POST /recordings HTTP/1.1\r\nHost: localhost\r\nContent-Length: 90000000\r\n'
    b'Content-Type: multipart/form-data; boundary=edge\r\n\r\n--edge\r\n'
    b'Content-Disposition: form-data; name="files"; filename="a.mcap"\r\n\r\n'
)
PAGE = b'GET / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n'
WRONG = (
    b'POST /recordings HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Length: 150\r\n'
    b'Content-Type: multipart/form-data; boundary=edge\r\n\r\n'
    + (
        b'--edge\r\nContent-Disposition: form-data; name="files"; filename="a.csv"\r\n\r\n'
        b'J1,X,Y,Z\n0,1,2,3\n\r\n--edge--\r\n'
    ).ljust(150)
)
"""A recording that is none: taken, put into the queue, refused by its reader."""
Ways = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]


async def _silent(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    await reader.read()


async def _slow_head(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    writer.write(b'GET / HTTP/1.1\r\nHost: localhost\r\nX-Slow: ')
    await _drip(reader, writer)


async def _stalled(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    writer.write(UPLOAD)
    await reader.read()


async def _slow_body(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    writer.write(UPLOAD)
    await _drip(reader, writer)


async def _asking(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    writer.write(PAGE)
    await reader.read()


async def _dropping(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    writer.write(WRONG)
    await reader.read()


async def _drip(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    closed = asyncio.ensure_future(reader.read())
    while not closed.done():
        writer.write(b'z')
        await asyncio.wait([closed], timeout=DRIP)
    await closed


WAYS: dict[str, Ways] = {
    'say nothing': _silent,
    'send the head of a request byte by byte': _slow_head,
    'begin an upload and say no more': _stalled,
    'upload byte by byte': _slow_body,
    'ask for a page again and again': _asking,
    'drop what is no recording again and again': _dropping,
}
"""In turn, so that each way has its share of the connections."""


async def _one(address: tuple[str, int], way: str, opened: Counter[str]) -> None:
    while True:
        try:
            reader, writer = await asyncio.open_connection(*address)
            opened[way] += 1
            try:
                await WAYS[way](reader, writer)
            finally:
                writer.close()
        except OSError:
            pass
        await asyncio.sleep(PAUSE)


async def _all(address: tuple[str, int], count: int) -> None:
    opened: Counter[str] = Counter()
    names = list(WAYS)
    tasks = [
        asyncio.ensure_future(_one(address, names[k % len(names)], opened)) for k in range(count)
    ]
    print('there', flush=True)
    await asyncio.get_running_loop().run_in_executor(None, sys.stdin.read)
    for task in tasks:
        task.cancel()
    print(opened.total(), flush=True)


@contextmanager
def hostile(root: str, count: int) -> Iterator[dict[str, int]]:
    """
    Hold so many hostile connections to a server while the block lasts.

    Parameters
    ----------
    root : str
        Address of the server.
    count : int

    Yields
    ------
    dict
        Has ``opened`` after the block: how many were opened in all, as closed ones come back.

    """
    told: dict[str, int] = {}
    where = urlsplit(root)
    words = [sys.executable, '-m', __name__, str(where.hostname), str(where.port), str(count)]
    with subprocess.Popen(
        words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        process.stdout.readline()
        try:
            yield told
        finally:
            out, _ = process.communicate()
            told['opened'] = int(out or 0)


if __name__ == '__main__':
    asyncio.run(_all((sys.argv[1], int(sys.argv[2])), int(sys.argv[3])))
