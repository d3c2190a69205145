# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Runs of the demo as programs of their own, with busy processes beside them or none."""

from __future__ import annotations

import hashlib
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from weld_twin_msgs_py.bags import bag_info

LIMIT = 1800.0
"""Seconds after which a run is given up: it takes one minute where eight processes share a core."""
COMPARED = ('deviation.csv', 'summary.txt')
"""Files that are the same on every run: each deviation, and the words on the terminal."""
SAID = 2000
"""Characters kept of what a failed run says."""


def run_demos(busy: int, together: int = 1) -> list[dict[str, Any]]:
    """
    Return what each of some demos left that ran at once.

    Parameters
    ----------
    busy : int
        How many processes compute beside them.
    together : int, optional
        How many demos run at once, each in a ROS domain of its own.

    Returns
    -------
    list of dict
        For each ``busy``, ``together``, ``seconds``, ``code``, ``messages`` by topic of the bag,
        ``incomplete`` sentences, ``digests`` of the compared files, ``headline``, and ``said``
        where the run failed.

    """
    with _busy(busy), ThreadPoolExecutor(together) as demos:
        rows = list(demos.map(lambda _: _run_once(), range(together)))
    return [{'busy': busy, 'together': together, **row} for row in rows]


def _run_once() -> dict[str, Any]:
    begin = time.monotonic()
    with tempfile.TemporaryDirectory(prefix='weld_twin_demo_') as place:
        out = Path(place) / 'out'
        try:
            run = subprocess.run(
                [sys.executable, '-m', 'weld_twin_nodes', 'demo', '--out', str(out)],
                capture_output=True,
                text=True,
                timeout=LIMIT,
            )
            code, said = run.returncode, run.stderr
        except subprocess.TimeoutExpired:
            code, said = -1, f'not finished after {LIMIT:g} s'
        row = {'seconds': round(time.monotonic() - begin, 1), 'code': code}
        return {**row, **(_left(out) if code == 0 else {'said': said[-SAID:]})}


def _left(out: Path) -> dict[str, Any]:
    info = bag_info(out / 'bag')
    summary = (out / 'summary.txt').read_text(encoding='utf-8')
    return {
        'messages': {topic.name: topic.count for topic in info.topics},
        'incomplete': list(info.incomplete),
        'digests': {
            name: hashlib.sha256((out / name).read_bytes()).hexdigest() for name in COMPARED
        },
        'headline': next(line for line in summary.splitlines() if line.startswith('The gap')),
    }


@contextmanager
def _busy(count: int) -> Iterator[None]:
    """Let processes compute meanwhile."""
    crowd = [subprocess.Popen([sys.executable, '-c', 'while True: pass']) for _ in range(count)]
    try:
        yield
    finally:
        for process in crowd:
            process.kill()
        for process in crowd:
            process.wait()
