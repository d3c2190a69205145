# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The benchmark from start to end."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from weld_twin_core import __version__
from weld_twin_msgs_py.files.whole_files import write_json

from .arms import calibrated_arm
from .kinematics import batches, inverse, single
from .peers import PACKAGES, Peer, find_peers
from .race import Workload, brief, lines, page, race


@dataclass(frozen=True)
class Effort:
    """How much is done: sizes of the workloads and how long they are timed."""

    rounds: int = 21
    least: float = 0.05
    counts: tuple[int, ...] = (1000, 100_000)
    points: int = 1000


FULL = Effort()
QUICK = Effort(3, 0.01, (1000,), 100)
"""For a look, and for the tests: seconds instead of minutes."""


def benchmark(folder: Path, effort: Effort, say: Callable[[str], None]) -> None:
    """
    Run everything; write the results.

    They are ``benchmark.json`` and two tables of it, ``benchmark.md`` and ``brief.md``.

    Raises DataError: a contender's result is not that of the others.
    """
    robot = calibrated_arm()
    peers, missing = find_peers(robot)
    for name, reason in missing.items():
        say(f'{name} is left out: {reason}')
    outcomes = []
    for workload in _workloads(effort, peers):
        outcomes.append(race(workload, effort.rounds, effort.least))
        for line in lines(outcomes[-1]):
            say(line)
    (folder / 'benchmark.md').write_text(page(outcomes), encoding='utf-8')
    (folder / 'brief.md').write_text(brief(outcomes), encoding='utf-8')
    results = {
        'schema': 'weld_twin/benchmark/1',
        'machine': _machine(),
        'left_out': missing,
        'workloads': [outcome.as_dict() for outcome in outcomes],
    }
    write_json(folder / 'benchmark.json', results)


def _workloads(effort: Effort, peers: dict[str, Peer]) -> Iterator[Workload]:
    robot = calibrated_arm()
    for count in effort.counts:
        yield from batches(robot, peers, count)
    yield single(robot, peers)
    yield inverse(effort.points, 'pinocchio' in peers)


def _machine() -> dict[str, Any]:
    versions = {'weld_twin': __version__}
    for package in ('numpy', 'scipy', *PACKAGES.values()):
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            continue
    return {
        'processor': _processor(),
        'processors': os.cpu_count(),
        'load': os.getloadavg()[0],
        'python': platform.python_version(),
        'versions': versions,
    }


def _processor() -> str:
    try:
        text = Path('/proc/cpuinfo').read_text(encoding='utf-8')
    except OSError:
        return platform.processor()
    names = [line.partition(':')[2] for line in text.splitlines() if line.startswith('model name')]
    return names[0].strip() if names else platform.machine()
