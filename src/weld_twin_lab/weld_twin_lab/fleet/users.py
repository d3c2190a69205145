# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A server and its users, as programs of their own: how long each waits, and what they are told."""

from __future__ import annotations

import re
import secrets
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from http.cookiejar import CookieJar
from pathlib import Path
from typing import Any

from weld_twin_core.errors import DataError

ASK_EVERY = 0.3
"""Seconds between two looks at one's page; a browser looks every two."""
PATIENCE = 1800.0
"""Seconds after which somebody gives up."""


@contextmanager
def server(place: Path, *words: str) -> Iterator[str]:
    """Yield the address of a server that ends with the block."""
    with subprocess.Popen(
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
    ) as process:
        assert process.stdout is not None
        said = process.stdout.readline()
        if not said.startswith('open '):
            raise DataError('the server does not start')
        try:
            yield said.removeprefix('open ').strip().rstrip('/')
        finally:
            process.terminate()


class Visitor:
    """Somebody with a browser of one's own."""

    def __init__(self, root: str) -> None:
        self._root = root
        self._open = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(CookieJar()))
        self.page()

    def page(
        self, path: str = '/', data: bytes | None = None, kind: str = ''
    ) -> tuple[int, str, str]:
        """Return status, address and text of a page."""
        request = urllib.request.Request(self._root + path, data=data)
        if kind:
            request.add_header('Content-Type', kind)
        try:
            with self._open.open(request, timeout=60) as answer:
                return answer.status, answer.url.removeprefix(self._root), answer.read().decode()
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

    def wait(self, address: str) -> tuple[float, int, str]:
        """Return how long it takes to the sheet or a refusal, the places told, and the page."""
        began, places = time.perf_counter(), set()
        while time.perf_counter() - began < PATIENCE:
            _, _, text = self.page(address)
            told = re.search(r'Waiting: (\d+) before it', text)
            if told:
                places.add(int(told[1]))
            if 'http-equiv="refresh"' not in text:
                return time.perf_counter() - began, len(places), text
            time.sleep(ASK_EVERY)
        raise DataError('a visitor waited for nothing')


def at_once(root: str, files: Sequence[Path], count: int, **fields: str) -> dict[str, Any]:
    """Return how long so many users take who drop the same recording at once."""
    found: list[tuple[float, int, bool]] = []

    def one() -> None:
        visitor = Visitor(root)
        _, address, _ = visitor.drop(files, **fields)
        took, places, text = visitor.wait(address)
        found.append((took, places, '<iframe' in text))

    threads = [threading.Thread(target=one) for _ in range(count)]
    began = time.perf_counter()
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return {
        'users': count,
        'seconds': time.perf_counter() - began,
        'sheets': sum(ok for *_, ok in found),
        'saw_their_place': sum(places > 0 for _, places, _ in found),
    }
