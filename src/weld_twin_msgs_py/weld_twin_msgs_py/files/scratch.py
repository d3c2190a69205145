# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Hidden directories to work in: gone afterwards, and after a kill swept by the next.

Who works in one holds a lock on a file in it. The system lets go of the lock when the process ends,
however it ends, so a directory whose lock is free is nobody's any more.
"""

import fcntl
import os
import re
import shutil
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

LOCK = '.weld_twin_lock'
"""The file that is locked; a directory without it is none of ours."""
_DRAWN = '[a-z0-9_]{8}'
"""What `tempfile.mkdtemp` draws after the prefix."""


class Scratch:
    """
    A new hidden directory; a context manager that yields its path, or `close` by hand.

    What killed processes left of the same prefix is swept first, see `sweep`.
    """

    def __init__(
        self, parent: Path, prefix: str, rescue: Callable[[Path], object] | None = None
    ) -> None:
        parent.mkdir(parents=True, exist_ok=True)
        sweep(parent, prefix, rescue)
        self.path, lock = _made(parent, prefix)
        self._lock: int | None = lock

    def close(self) -> None:
        """Remove the directory; may be called again."""
        lock, self._lock = self._lock, None
        if lock is not None:
            _remove(self.path)
            os.close(lock)

    def leave(self) -> None:
        """Let go of the directory as it is; the next sweep rescues and removes it."""
        lock, self._lock = self._lock, None
        if lock is not None:
            os.close(lock)

    @property
    def is_whole(self) -> bool:
        """Return whether nobody has deleted the directory meanwhile; one made anew does not count."""
        return self._lock is not None and os.fstat(self._lock).st_nlink > 0

    def __enter__(self) -> Path:
        return self.path

    def __exit__(self, *_: object) -> None:
        self.close()


def sweep(parent: Path, prefix: str, rescue: Callable[[Path], object] | None = None) -> None:
    """Remove the scratch directories of processes that have ended, rescued before."""
    own = re.compile(re.escape(prefix) + _DRAWN)
    try:
        result = [entry for entry in os.scandir(parent) if own.fullmatch(entry.name)]
    except OSError:
        return
    for entry in result:
        if not entry.is_dir(follow_symlinks=False) or not _mine(entry):
            continue
        folder = Path(entry.path)
        lock = _hold(folder)
        if lock is None:
            with suppress(OSError):
                folder.rmdir()  # killed before it had a lock: removed only if it is empty
            continue
        try:
            if rescue is not None:
                rescue(folder)
            _remove(folder)
        finally:
            os.close(lock)


def _mine(entry: os.DirEntry[str]) -> bool:
    with suppress(OSError):
        return entry.stat(follow_symlinks=False).st_uid == os.geteuid()
    return False


def _made(parent: Path, prefix: str) -> tuple[Path, int]:
    """Return a new directory and the lock on it, which another's sweep may be first to take."""
    while True:
        folder = Path(tempfile.mkdtemp(prefix=prefix, dir=parent))
        with suppress(FileNotFoundError):
            made = os.open(folder / LOCK, os.O_CREAT | os.O_RDWR | os.O_EXCL, 0o600)
            lock = _hold(folder)
            if lock is None and (folder / LOCK).exists():
                return folder, made  # a file system without locks; nobody can sweep here either
            os.close(made)
            if lock is not None:
                return folder, lock


def _hold(folder: Path) -> int | None:
    """Return the lock of a directory; None where another process has it, or it has none."""
    try:
        lock = os.open(folder / LOCK, os.O_RDWR | os.O_NOFOLLOW)
    except OSError:
        return None
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if os.path.samestat(os.fstat(lock), os.stat(folder / LOCK)):
            return lock
    except OSError:
        pass
    os.close(lock)
    return None


def _remove(folder: Path) -> None:
    """Remove a directory, its lock last, so that a kill in between leaves what can be swept."""
    with suppress(OSError):
        for entry in list(os.scandir(folder)):
            if entry.name == LOCK:
                continue
            if entry.is_dir(follow_symlinks=False):
                shutil.rmtree(entry.path, ignore_errors=True)
            else:
                os.unlink(entry.path)
    shutil.rmtree(folder, ignore_errors=True)
