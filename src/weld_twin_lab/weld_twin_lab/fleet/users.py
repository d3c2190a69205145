# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A server and its users, as programs of their own: how long each waits, and what they are told."""

from __future__ import annotations

import re
import secrets
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.cookiejar import CookieJar
from pathlib import Path
from typing import Any

from weld_twin_core.errors import DataError

ASK_EVERY = 0.3
"""Seconds between two looks at one's page; a browser looks every two."""
PATIENCE = 1800.0
"""Seconds after which somebody gives up."""


def started(place: Path, *words: str) -> tuple[subprocess.Popen[str], str]:
    """
    Start a server; return it and its address.

    Raises
    ------
    DataError
        It does not start.

    """
    process = subprocess.Popen(
        [
            sys.executable,
            '-m',
            'weld_twin_nodes',
            'serve',
            '--port',
            '0',
            '--dir',
            str(place),
            *words,
        ],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    said = process.stdout.readline()
    if not said.startswith('open '):
        process.kill()
        raise DataError('the server does not start')
    return process, said.removeprefix('open ').strip().rstrip('/')


@contextmanager
def server(place: Path, *words: str) -> Iterator[str]:
    """Yield the address of a server that ends with the block."""
    process, address = started(place, *words)
    with process:
        try:
            yield address
        finally:
            process.terminate()


class Visitor:
    """Somebody with a plain client: it keeps cookies and follows what the server says."""

    def __init__(self, root: str) -> None:
        self.root = root
        self._open = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(CookieJar()))
        self.page()

    def page(
        self, path: str = '/', data: bytes | None = None, kind: str = ''
    ) -> tuple[int, str, str]:
        """Return status, address and text of a page."""
        request = urllib.request.Request(self.root + path, data=data)
        if kind:
            request.add_header('Content-Type', kind)
        try:
            with self._open.open(request, timeout=60) as answer:
                return answer.status, answer.url.removeprefix(self.root), answer.read().decode()
        except urllib.error.HTTPError as error:
            return error.code, path, error.read().decode()

    def drop(self, files: Sequence[Path], **fields: str) -> tuple[int, str, str]:
        """Drop a recording; return what comes."""
        edge = secrets.token_hex(12)
        parts = [
            f'Content-Disposition: form-data; name="{name}"\r\n\r\n{value}'.encode()
            for name, value in fields.items()
        ]
        parts += [
            f'Content-Disposition: form-data; name="files"; filename="{file.name}"\r\n\r\n'.encode()
            + file.read_bytes()
            for file in files
        ]
        body = b''.join(b'--%s\r\n%s\r\n' % (edge.encode(), part) for part in parts)
        body += b'--%s--\r\n' % edge.encode()
        return self.page('/recordings', body, f'multipart/form-data; boundary={edge}')

    def look(self, address: str) -> str:
        """Return the page of a recording as it is now."""
        return self.page(address)[2]


def wait(visitor: Visitor, address: str) -> str:
    """Return the page of a recording that is finished."""
    return wait_all([(visitor, address)])[0].text


@dataclass
class Waited:
    """Places in the queue that somebody was told, the page that came at last, and when [s]."""

    places: set[int] = field(default_factory=set)
    text: str = ''
    until: float = 0.0


def wait_all(waiting: Sequence[tuple[Visitor, str]]) -> list[Waited]:
    """
    Return what each visitor was told while he waited, and at last.

    Raises
    ------
    DataError
        A visitor waited too long.

    """
    found = [Waited() for _ in waiting]
    left = set(range(len(waiting)))
    until = time.perf_counter() + PATIENCE
    while left:
        if time.perf_counter() > until:
            raise DataError('a visitor waited for nothing')
        for k in sorted(left):
            visitor, address = waiting[k]
            text = visitor.look(address)
            found[k].places.update(_places(text))
            if text and 'http-equiv="refresh"' not in text:
                found[k].text, found[k].until = text, time.perf_counter()
                left.remove(k)
        time.sleep(ASK_EVERY)
    return found


def _places(text: str) -> list[int]:
    """Return the place in the queue that a page tells, if it does."""
    return [int(told) for told in re.findall(r'Waiting: (\d+) before it', text)]


def at_once(visitors: Sequence[Visitor], files: Sequence[Path], **fields: str) -> dict[str, Any]:
    """Return how long users take who drop the same recording at once."""
    began = time.perf_counter()
    dropped = [visitor.drop(files, **fields) for visitor in visitors]
    first = [_places(text) for _, _, text in dropped]  # later pages may tell the verdict already
    pages = [
        (visitor, address) for visitor, (_, address, _) in zip(visitors, dropped, strict=True)
    ]
    found = wait_all(pages)
    return {
        'users': len(visitors),
        'seconds': time.perf_counter() - began,
        'waits_s': [waited.until - began for waited in found],
        'sheets': sum('<iframe' in waited.text for waited in found),
        'saw_their_place': sum(
            bool(told or waited.places) for told, waited in zip(first, found, strict=True)
        ),
    }
