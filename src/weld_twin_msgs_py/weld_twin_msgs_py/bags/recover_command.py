# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The command that makes a bag of a recording that was cut short, as it works where it is printed."""

from __future__ import annotations

import os
import shlex
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path

SPARE = 10_000_000
"""Bytes [B] that a disk must have left beside the copy: others write on it, too."""


def recover_command(path: Path, growing: Path | None = None) -> str:
    """
    Return ``weld-twin bag recover`` for a recording, onto another disk where its own has no room.

    path: what the recorder was told to write.
    growing: the directory it grew in; it is copied.
    """
    command = ['weld-twin', 'bag', 'recover', str(path)]
    needed = _size(path if growing is None else growing) + SPARE
    if not _has_room(path.parent, needed):
        places = (Path.cwd(), Path.home(), Path(tempfile.gettempdir()))
        result = next((place for place in places if _has_room(place, needed)), None)
        command += ['--out', str((result or Path('ANOTHER_DISK')) / path.name)]
    return shlex.join(command)


def _has_room(folder: Path, needed: int) -> bool:
    """Return whether so many bytes can be written into a directory."""
    with suppress(OSError):
        return os.access(folder, os.W_OK) and shutil.disk_usage(folder).free >= needed
    return False


def _size(folder: Path) -> int:
    """Return the bytes of all files in a directory; those that go meanwhile count nothing."""
    total = 0
    with suppress(OSError):
        for file in [folder, *folder.rglob('*')]:
            total += file.stat().st_size
    return total
