# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Forty ways to know too little of two arms, each with stations to judge on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from weld_twin_core.arm import catalog
from weld_twin_core.arrays import Array
from weld_twin_core.recording import JointMotion, JointSignal, Recording
from weld_twin_msgs_py.tables import read_table

Rows = NDArray[Any]
"""Row numbers."""

TABLES = {'ur5': 'grid.csv', 'ur10': 'series_c_random_poses.csv'}
"""What the stations of each arm are in."""
COUNTS = (15, 30, 60, 120, 240)
"""Stations that are fitted on, at random: from hardly enough to plenty."""
LEAST = 15
"""Stations that must remain to fit on; fewer than the unknowns of a plain geometric fit."""
KEPT_BACK = 4
"""One station in so many of a narrow region is kept back, to judge inside the region."""
STILL = np.radians(1.0)
"""Half the range of a joint that stands still [rad]."""
NARROW = np.radians((2.0, 10.0))
"""Half the ranges of joints in a narrow region [rad]."""
OCTANTS = (0, 2, 5, 7)
"""Octants about the middle of the workspace that are fitted on: two pairs of opposite ones."""
FIRST = 0.2
"""Share of the recording that is fitted on where the first part has to predict the rest."""
HOME = {'ur5': 0, 'ur10': 1}
"""Rows before this one are left out: the UR10's first is its home pose, far from the rest."""
TUNED_ON = ('n15', 'n60', 'wrist_10deg', 'still_2', 'octant_0', 'odd')
"""
Kinds of splits, of the UR5 alone, that thresholds of the diagnosis were looked at on.

All others were run without a change that they themselves had asked for.
"""


@dataclass(frozen=True, eq=False)
class Split:
    """Stations to fit on, and stations to judge on."""

    name: str
    kind: str
    robot: str
    train: Recording
    inside: Recording | None
    """Stations like those fitted on; None where there are none."""
    outside: Recording | None
    """Stations of the rest of the workspace; None where those fitted on are spread over it."""


def all_splits(ur5: Path, ur10: Path) -> Iterator[Split]:
    """
    Yield the splits of both measured arms.

    ur5, ur10: directories with the published tables.

    Raises DataError: a table is missing or cannot be read.
    """
    for robot, directory in (('ur5', ur5), ('ur10', ur10)):
        yield from splits(robot, stations(robot, directory), HOME[robot])


def stations(robot: str, directory: Path) -> Recording:
    """
    Return the stations of one of the two arms, in the order they were measured.

    Raises DataError: the table is missing or cannot be read.
    """
    return read_table(directory / TABLES[robot], catalog.load(robot)).recording


def splits(robot: str, table: Recording, first: int = 0) -> Iterator[Split]:
    """
    Yield twenty splits of one arm's stations.

    table: stations at rest, in the order they were measured.
    first: stations before this one are left out.
    """
    assert table.measured is not None
    rows = np.arange(first, table.measured.t.size)
    rng = np.random.default_rng(13)
    for count in COUNTS:
        chosen = np.sort(rng.choice(rows, count, replace=False))
        yield _split(robot, f'n{count}', table, chosen, np.setdiff1d(rows, chosen), None)
    for kind, chosen in _narrow(table, rows):
        if chosen.size >= LEAST:
            fitted, back = kept_back(chosen)
            yield _split(robot, kind, table, fitted, back, np.setdiff1d(rows, chosen))
    cut = int(FIRST * rows.size)
    near = among(table.measured.position[rows[:cut]], table.measured.position[rows[cut:]])
    near &= near.sum() >= LEAST  # on a handful nothing can be judged
    far = None if near.all() else rows[cut:][~near]
    yield _split(robot, 'first_fifth', table, rows[:cut], rows[cut:][near], far)
    yield _split(robot, 'odd', table, rows[1::2], rows[0::2], None)
    yield _split(robot, 'even', table, rows[0::2], rows[1::2], None)


def _narrow(table: Recording, rows: Rows) -> Iterator[tuple[str, Rows]]:
    """Yield regions of joint space and of the workspace, each with all its stations."""
    q = table.joints.q[rows]
    last = np.arange(q.shape[1])[-3:]
    for half, joints in ((NARROW[0], last[1:]), (NARROW[1], last[1:]), (NARROW[1], last)):
        name = f'wrist_{round(np.degrees(half))}deg' + ('' if joints.size == 2 else '_three')
        yield name, rows[densest(q[:, joints], half)]
    for joint in range(5):
        yield f'still_{joint + 1}', rows[densest(q[:, [joint]], STILL)]
    assert table.measured is not None
    position = table.measured.position[rows]
    octant = (position > np.median(position, axis=0)) @ np.array([4, 2, 1])
    for number in OCTANTS:
        yield f'octant_{number}', rows[octant == number]


def densest(q: Array, half: float) -> NDArray[np.bool_]:
    """Return which stations lie within ±half of the station that has most of them, (M,)."""
    near = [(np.abs(q - centre).max(axis=1) <= half) for centre in q]
    best: NDArray[np.bool_] = near[int(np.argmax([mask.sum() for mask in near]))]
    return best


def among(fitted: Array, others: Array) -> NDArray[np.bool_]:
    """
    Return which places lie among those fitted: as near to one as the loneliest to its neighbour.

    An arm that visits a grid plane by plane has been nowhere near most of it after a fifth of the
    time; one that visits places at random has been everywhere.

    fitted, others: measured positions of the tool, shape (M, 3) and (K, 3) [m].
    """
    tree = cKDTree(fitted)
    own = tree.query(fitted, k=2)[0][:, 1]
    return np.asarray(tree.query(others)[0] <= own.max())


def kept_back(rows: Rows) -> tuple[Rows, Rows]:
    """Return the rows to fit on, at least `LEAST`, and those kept back, evenly spread."""
    count = min(rows.size // KEPT_BACK, rows.size - LEAST)
    if count <= 0:
        return rows, rows[:0]
    at = np.unique(np.linspace(0, rows.size - 1, count + 2)[1:-1].round().astype(int))
    return np.delete(rows, at), rows[at]


def _split(
    robot: str, kind: str, table: Recording, fitted: Rows, inside: Rows, outside: Rows | None
) -> Split:
    return Split(
        f'{robot}_{kind}',
        kind,
        robot,
        alone(table, fitted),
        alone(table, inside) if inside.size else None,
        None if outside is None else alone(table, outside),
    )


def alone(table: Recording, rows: Rows) -> Recording:
    """
    Return a table of some rows alone, as somebody has it who measured no others.

    Each row keeps its stamp: which came first is known.
    """
    assert table.measured is not None
    joints, effort = table.joints, table.effort
    return replace(
        table,
        joints=JointMotion(joints.t[rows], joints.q[rows], None, joints.static),
        measured=table.measured.take(rows),
        effort=None if effort is None else JointSignal(effort.t[rows], effort.value[rows]),
    )


def halves(train: Recording) -> tuple[Recording, Recording]:
    """Return the odd and the even rows of a recording, each alone."""
    assert train.measured is not None
    rows = np.arange(train.measured.t.size)
    return alone(train, rows[1::2]), alone(train, rows[0::2])
