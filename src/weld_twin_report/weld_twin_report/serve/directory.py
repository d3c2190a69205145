# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The directory of a server: marked as such, held by one server at a time.

A server works only in a directory that is new, empty, or marked by an earlier one. The mark is a file
that is locked while a server runs; the system lets go of it when its process ends, however it ends.
"""

import errno
import fcntl
import json
import os
import re
import shutil
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from weld_twin_core.errors import DataError
from weld_twin_msgs_py.files.whole_files import followed

from .job import FILE, MODEL, OPEN, UPLOADS, Job

MARK = '.weld_twin_server.json'
"""Tells that the directory is a server's; locked while one runs."""
SCHEMA = 'weld_twin/server/1'
JOBS, USERS = 'jobs', 'users'
PRIVATE = 0o700
"""Mode of what a server makes here: recordings of others are nobody's business."""
_KEY = re.compile(r'[0-9a-f]{32}')
"""Name of a job's folder, as `Job.new` draws it."""


class Directory:
    """A directory, perhaps behind a link, in which this server alone works, until `close`."""

    def __init__(self, path: Path) -> None:
        self.path = followed(path)
        self._lock_file: int | None = None
        try:
            self._open()
        except OSError as error:
            self.close()
            raise DataError(f"'{path}' cannot be written: {error.strerror or error}") from None
        except DataError:
            self.close()
            raise

    @property
    def jobs(self) -> Path:
        """Return where the folders of jobs lie."""
        return self.path / JOBS

    @property
    def users(self) -> Path:
        """Return where the folders of users lie."""
        return self.path / USERS

    def kept(self) -> Iterator[Path]:
        """Yield the folders of jobs, and remove uploads that were cut off."""
        for folder in sorted(self.jobs.iterdir()):
            if folder.is_symlink() or not _KEY.fullmatch(folder.name) or not folder.is_dir():
                continue  # a person's
            try:
                names = os.listdir(folder)
            except OSError:  # whoever reads it tells why it cannot be
                names = [FILE]
            if FILE in names:
                yield folder
            elif all(name in (UPLOADS, MODEL) or FILE in name for name in names):  # cut off
                shutil.rmtree(folder, ignore_errors=True)

    def close(self) -> None:
        """Let another server in."""
        lock, self._lock_file = self._lock_file, None
        if lock is not None:
            os.close(lock)

    def _open(self) -> None:
        if os.path.lexists(self.path) and not self.path.is_dir():
            raise DataError(f"'{self.path}' is a file; give a folder with --dir")
        if not self.path.exists():
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with suppress(FileExistsError):  # another server was first, and its lock says so
                self.path.mkdir(mode=PRIVATE)
        if not (self.path / MARK).is_file() and not self._is_free():
            raise DataError(
                f"'{self.path}' holds something else already; give a folder of its own with --dir"
            )
        self._lock()
        for folder in (self.jobs, self.users):
            folder.mkdir(mode=PRIVATE, exist_ok=True)

    def _is_free(self) -> bool:
        """Tell whether nothing lies there, or what a server without a mark left: its jobs alone."""
        names = {entry.name for entry in self.path.iterdir()}
        if names - {JOBS, USERS, MARK}:
            return False
        jobs = list(self.jobs.iterdir()) if JOBS in names else []
        return all(_KEY.fullmatch(folder.name) for folder in jobs)

    def _lock(self) -> None:
        flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW
        self._lock_file = os.open(self.path / MARK, flags, 0o600)
        try:
            fcntl.flock(self._lock_file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise DataError(
                f"another server works in '{self.path}'{_of(self._lock_file)}; end it, or give another "
                '--dir'
            ) from None
        except OSError:  # a file system without locks
            pass
        text = json.dumps({'schema': SCHEMA, 'process': os.getpid()}) + '\n'
        os.ftruncate(self._lock_file, 0)
        os.pwrite(self._lock_file, text.encode(), 0)


def _of(lock: int) -> str:
    """Return which process holds a mark."""
    with suppress(ValueError, LookupError, TypeError):
        return f' (process {int(json.loads(os.pread(lock, 1000, 0))["process"])})'
    return ''


SPARE = 100_000_000
"""Bytes of the disk that uploads leave free: what is in work must be able to finish."""
SHARES = 10
"""Parts of the disk that is allowed; whoever has more than one of them gives way."""
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""What the system says where nothing more can be written."""
NO_ROOM = 'the disk of the server is full; try again when whoever runs it has made room'


class NoRoom(DataError):
    """Nothing more can be kept."""


def is_full(error: BaseException) -> bool:
    """Return whether an error says that the disk is full."""
    return isinstance(error, OSError) and error.errno in FULL


def refuse_full(directory: Path, length: int) -> None:
    """Refuse an upload that the disk has no room for, by NoRoom."""
    disk = shutil.disk_usage(directory)
    if disk.free < length + min(SPARE, disk.total // SHARES):
        raise NoRoom(NO_ROOM)


def size_of(folder: Path) -> int:
    """Return the bytes of the files in a folder; what goes meanwhile is left out."""
    total = 0
    for place, _, names in os.walk(folder):
        for name in names:
            try:
                total += os.lstat(os.path.join(place, name)).st_size
            except OSError:
                continue
    return total


def giving_way(
    jobs: Sequence[Job], sizes: Mapping[str, int], new: Job, allowed: int, most: int
) -> list[Job]:
    """
    Return the finished jobs that go, so that a new one can be kept, in bytes and number.

    Raises NoRoom: nobody has more than a fair share, and it is too much all the same.
    """
    remaining = sorted(jobs, key=lambda job: job.since)
    out: list[Job] = []
    while True:
        taken = Counter[str]()
        count = Counter[str]()
        for job in [*remaining, new]:
            taken[job.party] += sizes.get(job.key, 0)
            count[job.party] += 1
        too_large, too_many = taken.total() > allowed, count.total() > most
        if not (too_large or too_many):
            return out
        party, share = (taken if too_large else count).most_common(1)[0]
        fair = (allowed if too_large else most) / SHARES
        oldest = next((j for j in remaining if j.party == party and j.state not in OPEN), None)
        if oldest is None or share <= fair:
            raise NoRoom(
                'the server keeps no more than it may, and that is used up; delete '
                'recordings of yours that you need no longer, or ask whoever runs it'
            )
        remaining.remove(oldest)
        out.append(oldest)
