# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How much of the disk everything takes, and whose oldest results go where it is too much.

Nobody's results go for another one's: whoever has more than a fair share gives way, the oldest first,
and where nobody has, nothing more is taken.
"""

from __future__ import annotations

import errno
import os
import shutil
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from weld_twin_core.errors import DataError

from .job import OPEN, Job

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
    """
    Refuse an upload that the disk has no room for.

    Raises NoRoom: there is none.
    """
    if shutil.disk_usage(directory).free < length + min(SPARE, _tenth(directory)):
        raise NoRoom(NO_ROOM)


def _tenth(directory: Path) -> int:
    return shutil.disk_usage(directory).total // SHARES


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
    Return the finished jobs that go, so that a new one can be kept.

    Parameters
    ----------
    jobs : sequence of Job
        All but the new one.
    sizes : mapping
        Bytes by the key of each, the new one too.
    allowed : int
        Bytes of all.
    most : int
        Jobs of all.

    Raises
    ------
    NoRoom
        Nobody has more than a fair share, and it is too much all the same.

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
