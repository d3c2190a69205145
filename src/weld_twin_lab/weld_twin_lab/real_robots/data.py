# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The tables of the two arms, and the parts they are split into for fitting and judging."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from weld_twin_core.arm import catalog
from weld_twin_core.recording import Measurements, Recording
from weld_twin_msgs_py.tables import read_table

GRID, RANDOM = 'grid.csv', 'random.csv'
POSES = 'series_c_random_poses.csv'
SHARE = 0.8
"""Of the poses of one series, what is fitted on; the rest judges."""

Rows = NDArray[np.intp]


class Goal(NamedTuple):
    """What to reach on the poses held out [m, rad]; None where nothing is asked."""

    mean_m: float
    max_m: float | None = None
    orientation_rad: float | None = None


class Split(NamedTuple):
    """Stations to fit on, stations to judge on, and what to reach there."""

    name: str
    robot: str
    title: str
    train: Recording
    test: Recording
    goal: Goal


class Source(NamedTuple):
    """A table as it was read."""

    path: Path
    recording: Recording
    assumptions: tuple[str, ...]


def tables(robot: str, directory: Path) -> tuple[Source, ...]:
    """
    Return the tables of one of the two arms.

    Raises
    ------
    DataError
        A table is missing or cannot be read.

    """
    names = (GRID, RANDOM) if robot == 'ur5' else (POSES,)
    model = catalog.load(robot)
    return tuple(Source(directory / name, *read_table(directory / name, model)) for name in names)


def ur5_splits(sources: tuple[Source, ...]) -> Iterator[Split]:
    """Yield the three splits of the UR5's grid and random poses."""
    grid, random = (source.recording for source in sources)
    count = _count(grid)
    yield Split('ur5_random', 'ur5', 'grid; 20 random poses', grid, random, Goal(58e-6, 115e-6))
    train, test = _shuffled(count)
    yield Split(
        'ur5_permuted',
        'ur5',
        '80 % of the grid, shuffled; the rest',
        part(grid, train),
        part(grid, test),
        Goal(50e-6),
    )
    cut = int(SHARE * count)
    yield Split(
        'ur5_last',
        'ur5',
        'first 80 % of the grid; the rest',
        part(grid, np.arange(cut)),
        part(grid, np.arange(cut, count)),
        Goal(62e-6),
    )


def ur10_splits(sources: tuple[Source, ...]) -> Iterator[Split]:
    """Yield the two splits of the UR10's poses; row 0, the home pose far off, is in neither."""
    poses = sources[0].recording
    count = _count(poses)
    cut = 1 + int(SHARE * (count - 1))
    yield Split(
        'ur10_last',
        'ur10',
        'first 80 %; the rest',
        part(poses, np.arange(1, cut)),
        part(poses, np.arange(cut, count)),
        Goal(65e-6, None, 0.20e-3),
    )
    train, test = _shuffled(count)
    yield Split(
        'ur10_permuted',
        'ur10',
        '80 %, shuffled; the rest',
        part(poses, train[train != 0]),
        part(poses, test[test != 0]),
        Goal(68e-6, 240e-6),
    )


def part(recording: Recording, rows: Rows) -> Recording:
    """
    Return the measurements of some rows, each at the time of its row.

    The joint stream stays whole: where the arm came from is known without measuring there.
    """
    measured = recording.measured
    assert measured is not None
    return recording.with_measured(measured.take(np.sort(rows)))


def _shuffled(count: int) -> tuple[Rows, Rows]:
    order = np.random.default_rng(0).permutation(count)
    cut = int(SHARE * count)
    return order[:cut], order[cut:]


def _count(recording: Recording) -> int:
    measured: Measurements | None = recording.measured
    assert measured is not None
    return int(measured.t.size)
