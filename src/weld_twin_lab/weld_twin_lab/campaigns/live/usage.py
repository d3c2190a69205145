# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a process uses, as Linux accounts for it."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

PROC = Path('/proc')
PAGE = os.sysconf('SC_PAGE_SIZE')


def cpu_ns(pid: int) -> int:
    """Return the time a process has been on a CPU, all threads that live [ns]."""
    total = 0
    for task in (PROC / str(pid) / 'task').iterdir():
        with suppress(OSError):  # the thread has ended
            total += int((task / 'schedstat').read_text().split()[0])
    return total


def rss_bytes(pid: int) -> int:
    """Return the memory of a process that is resident [bytes]."""
    return int((PROC / str(pid) / 'statm').read_text().split()[1]) * PAGE


def children(pid: int) -> list[int]:
    """Return the processes a process has started and that still run."""
    out: list[int] = []
    for task in (PROC / str(pid) / 'task').iterdir():
        with suppress(OSError):
            out += map(int, (task / 'children').read_text().split())
    return out
