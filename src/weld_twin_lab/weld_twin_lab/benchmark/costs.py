# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a program costs from its start to its end: time and memory, its own alone."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, NamedTuple

_SMALL = Path(__file__).with_name('small_parent.py')


class Cost(NamedTuple):
    """Seconds on the clock, seconds of processor time, and the largest process [bytes]."""

    wall: float
    cpu: float
    peak: float


def cost_of(
    words: Sequence[str],
    *,
    environment: Mapping[str, str] | None = None,
    said: IO[str] | int = subprocess.DEVNULL,
    limit: float = 0.0,
) -> tuple[int, Cost]:
    """
    Run a program; return its exit code and what it cost.

    The memory of this process does not count, however large it is: see `small_parent`, whose own
    ten megabytes are the least that can be told.

    said: where what it prints goes, errors too; left out, nowhere.
    limit: after so long it is killed [s]; 0 for never.
    """
    read, write = os.pipe()
    try:
        process = subprocess.Popen(
            [sys.executable, '-I', '-S', str(_SMALL), str(write), str(limit), *words],
            stdout=said,
            stderr=subprocess.STDOUT,
            env=environment,
            pass_fds=[write],
        )
    finally:
        os.close(write)
    with os.fdopen(read, encoding='utf-8') as report:
        code, wall, cpu, peak = json.loads(report.readline())
    process.wait()
    return int(code), Cost(wall, cpu, peak)
