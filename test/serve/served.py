# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A server in a process of its own, and how somebody without a browser talks to it."""

import re
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from http.cookiejar import CookieJar
from urllib.request import HTTPCookieProcessor, Request, build_opener


class Server:
    """A server in a process of its own."""

    def __init__(self, folder, *words):
        self.words = [sys.executable, '-m', 'weld_twin_nodes', 'serve', '--port', '0', *words]
        self.words += ['--dir', str(folder)]
        self.log = folder.with_name(f'{folder.name}.log')
        self.start()

    def start(self):
        with self.log.open('a') as log:
            self.process = subprocess.Popen(
                self.words, stdout=subprocess.PIPE, stderr=log, text=True
            )
        self.address = self.process.stdout.readline().removeprefix('open ').strip()
        assert self.address.startswith('http://'), self.process.wait()
        self.root = re.match(r'http://[^/]+', self.address)[0]

    def kill(self):
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()
        self.process.stdout.close()


def form(robot='ur5', files=(('data.csv', b'a,b\n1,2\n'),), model=(), **fields):
    """Return the body of a form and its type."""
    parts = []
    for name, value in {'robot': robot, **fields}.items():
        parts.append(f'Content-Disposition: form-data; name="{name}"\r\n\r\n{value}'.encode())
    for field, name, content in (*(('files', *f) for f in files), *(('model', *f) for f in model)):
        head = f'Content-Disposition: form-data; name="{field}"; filename="{name}"\r\n'
        parts.append((head + 'Content-Type: application/octet-stream\r\n\r\n').encode() + content)
    body = b''.join(b'--edge\r\n' + part + b'\r\n' for part in parts) + b'--edge--\r\n'
    return body, 'multipart/form-data; boundary=edge'


def until(page, selector, seconds=60):
    page.wait_for_selector(selector, timeout=1000 * seconds)
    return page.locator(selector)


class Person:
    """Somebody with a client that keeps cookies."""

    def __init__(self, server):
        self.root, self.jar = server.root, CookieJar()
        self.open = build_opener(HTTPCookieProcessor(self.jar)).open

    def get(self, path='/', data=None, kind=''):
        """Return status, address and text of a page."""
        request = Request(self.root + path, data, {'Content-Type': kind} if kind else {})
        try:
            with self.open(request, timeout=60) as answer:
                coding = 'latin-1' if 'octet' in answer.headers['content-type'] else 'utf-8'
                text = answer.read().decode(coding)
                return answer.status, answer.url.removeprefix(self.root), text
        except OSError as error:
            return error.code, path, error.read().decode()

    def drop(self, path='/recordings', **how):
        """Send a form; return status, address and text of what comes."""
        body, kind = form(**how)
        return self.get(path, body, kind)

    def end_of(self, address):
        """Return the page of a recording once it is finished."""
        while 'http-equiv="refresh"' in (text := self.get(address)[2]):
            time.sleep(0.1)
        return text


@contextmanager
def small_disk(place, megabytes):
    """Mount a disk of its own that is soon full; yield why it cannot be, or an empty text."""
    place.mkdir(parents=True, exist_ok=True)
    words = ['mount', '-t', 'tmpfs', '-o', f'size={megabytes}m', 'none', str(place)]
    try:
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        why = done.stderr.strip() if done.returncode else ''
    except OSError as error:
        why = str(error)
    try:
        yield why
    finally:
        if not why:
            subprocess.run(['umount', '-l', str(place)], check=True)


def fill(place):
    """Fill a disk; return the file that does."""
    file = place / 'ballast'
    with file.open('wb', buffering=0) as stream:
        try:
            while stream.write(bytes(1 << 16)):
                pass
        except OSError:
            pass
    return file
