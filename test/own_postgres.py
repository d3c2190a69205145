# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A PostgreSQL server of one's own: made in a folder, reached by a socket there, gone afterwards."""

import os
import pwd
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from weld_twin_core.errors import DataError

DEBIAN = Path('/usr/lib/postgresql')
"""Where Debian keeps the programs of a server, by version; they are not on the path there."""
UNPRIVILEGED = ('postgres', 'nobody')
"""Users a server may run as when this process is root, which PostgreSQL refuses to run as."""
SETTINGS = (
    "-c listen_addresses='' -c fsync=off -c synchronous_commit=off "
    '-c full_page_writes=off -c shared_buffers=32MB -c max_connections=20'
)
"""No port, and no waiting for a disk that nobody reads again."""
PATIENCE = '30'
"""Seconds in which a server must have started; it takes one."""


class NoServer(DataError):
    """PostgreSQL is not installed; the message says how to mend it."""


def programs() -> Path:
    """Return the folder of PostgreSQL's programs; raise NoServer where there is none."""
    versions = sorted(DEBIAN.glob('*/bin/initdb'), key=lambda file: float(file.parts[-3]))
    if versions:
        return versions[-1].parent
    on_path = shutil.which('initdb')
    if on_path is None:
        raise NoServer('PostgreSQL is not installed: apt-get install postgresql')
    return Path(on_path).resolve().parent


@contextmanager
def postgres() -> Iterator[str]:
    """Yield the URL of an empty database on a server of its own; raise NoServer where none runs."""
    found = programs()
    place = Path(tempfile.mkdtemp(prefix='pg-', dir='/tmp'))  # a socket's path is short
    try:
        owner = _owner(place)
        data = str(place / 'data')
        _run(
            owner,
            found / 'initdb',
            ('-D', data, '-U', 'weld', '-A', 'trust', '-E', 'UTF8', '--no-locale', '--no-sync'),
        )
        start(place)
        try:
            yield f'postgresql+psycopg://weld@/postgres?host={place}'
        finally:
            stop(place)
    finally:
        shutil.rmtree(place, ignore_errors=True)


def start(place: Path) -> None:
    """Start the server of a folder, and wait until it answers."""
    settings, log = f'{SETTINGS} -k {place}', str(place / 'log')
    _control(place, '-l', log, '-w', '-t', PATIENCE, '-o', settings, 'start')


def stop(place: Path, how: str = 'immediate') -> None:
    """End the server of a folder: 'immediate' as a crash does, 'fast' as for a restart."""
    _control(place, '-m', how, '-w', 'stop')


def place_of(url: str) -> Path:
    """Return the folder of the server of a URL."""
    return Path(url.partition('?host=')[2])


def _control(place: Path, *words: str) -> None:
    _run(_owner(place), programs() / 'pg_ctl', ('-D', str(place / 'data'), *words))


def _owner(place: Path) -> str | None:
    """Return the user to run as, who gets the folder; None where this one is not root."""
    if os.geteuid() != 0:
        return None
    known = {each.pw_name for each in pwd.getpwall()}
    user = next((name for name in UNPRIVILEGED if name in known), None)
    if user is None:
        raise NoServer('PostgreSQL does not run as root, and there is no user postgres or nobody')
    shutil.chown(place, user)
    return user


def _run(user: str | None, program: Path, words: Sequence[str]) -> None:
    done = subprocess.run(
        [str(program), *words],
        cwd='/',
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        user=user,
        group=None if user is None else pwd.getpwnam(user).pw_gid,
        extra_groups=None if user is None else [],
    )
    if done.returncode:
        said = (done.stderr.strip().splitlines() or ['it said nothing'])[-1]
        raise NoServer(f'PostgreSQL does not run here: {program.name}: {said}')
