# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Repetitions of one commanded pose, found in a recording.

A *stop* is a station at rest: a row of a static recording, or a stretch of a moving one in which
the arm stands. Stops at the same joint positions are cycles of one commanded pose.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..arm.chain import forward
from ..arm.robot import Robot
from ..arrays import Array
from ..errors import DataError
from ..recording import JointMotion, Measurements, Recording

_SAME_POSE = 1e-3
"""
Two stops are of one pose where no joint differs by more [rad or m]; a joint stream repeats within
1e-4, and poses that are meant to differ are degrees apart. What differs is taken off again.
"""
_AT_REST = 2e-3
"""Speed [rad/s or m/s] of the fastest joint below which the arm stands; 2 mm/s a metre away."""
_DWELL = 0.5
"""Seconds an arm stands at least, so that it has settled when the second half begins."""
_LOOK = 0.05
"""Spacing [s] at which motion is looked at for stops; ten looks to the shortest."""
END = 0.1
"""Share of a stop left out at its end, where clocks that differ would see the arm leave."""


class _Stop(NamedTuple):
    """What was measured while the arm stood."""

    t: float
    """[s]"""
    q: Array
    """Where the joints were commanded to be, shape (n,)."""
    position: Array
    """Shape (3,) [m]."""
    rotation: Array | None
    """Shape (3, 3), or None."""


@dataclass(frozen=True, eq=False)
class PoseCycles:
    """The stops at one commanded pose."""

    q: Array
    """The commanded joint positions of the first of them, shape (n,)."""
    command: Array
    """The pose the robot should then have, shape (4, 4)."""
    t: Array
    """Shape (cycles,) [s]."""
    attained: Array
    """Measured positions, each less what its own command differs from that of the first, shape
    (cycles, 3) [m]."""
    rotation: Array | None
    """Shape (cycles, 3, 3), or None."""
    came_from: tuple[int, ...]
    """Number of the pose that the arm stood at before; -1 for the first stop of all."""


def measured_of(recording: Recording) -> Measurements:
    """
    Return the measurements of a recording.

    Raises DataError: it has none.
    """
    if recording.measured is None or recording.measured.t.size == 0:
        raise DataError(f'{recording.name} holds no measured poses or points')
    return recording.measured


def stops(recording: Recording) -> list[_Stop]:
    """
    Return where the arm stood and was measured, in order of time.

    Raises DataError: nothing was measured.

    recording: static, or of a motion in which the arm stands now and then.
    """
    measured, joints = measured_of(recording), recording.joints
    if joints.static:
        rows = joints.nearest(measured.t)
        turns = measured.rotation
        return [
            _Stop(
                float(measured.t[k]),
                joints.q[row],
                measured.position[k],
                None if turns is None else turns[k],
            )
            for k, row in enumerate(rows)
        ]
    return [
        result
        for start, end in _rests(joints)
        if (result := _mean_stop(joints, measured, start, end)) is not None
    ]


def _rests(joints: JointMotion) -> list[tuple[float, float]]:
    """
    Return start and end [s] of the stretches in which the arm stands for `_DWELL` or longer.

    joints: of a motion.
    """
    t = np.arange(joints.t[0], joints.t[-1], _LOOK)
    if t.size < 2:
        return []
    speed = np.abs(np.diff(joints.at(t)[0], axis=0)).max(axis=1) / _LOOK
    still = np.concatenate([[False], speed < _AT_REST, [False]]).astype(int)
    begins, ends = np.flatnonzero(np.diff(still) > 0), np.flatnonzero(np.diff(still) < 0)
    return [
        (float(t[a]), float(t[b]))
        for a, b in zip(begins, ends, strict=True)
        if t[b] - t[a] >= _DWELL
    ]


def _mean_stop(
    joints: JointMotion, measured: Measurements, start: float, end: float
) -> _Stop | None:
    """Return the mean of the later half of a stop, without its last moments."""
    late = start + 0.5 * (end - start)
    rows = (measured.t >= late) & (measured.t <= end - END * (end - start))
    if not rows.any():
        return None
    rotation = None
    if measured.rotation is not None:
        u, _, vt = np.linalg.svd(measured.rotation[rows].mean(axis=0))
        rotation = u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
    return _Stop(
        late, joints.at(np.array(late))[0], measured.position[rows].mean(axis=0), rotation
    )


def pose_cycles(result: list[_Stop], robot: Robot) -> list[PoseCycles]:
    """
    Return the stops by commanded pose, in the order in which the poses first came.

    robot: tells where a commanded joint position should have brought the tool.
    """
    if not result:
        return []
    q = np.stack([stop.q for stop in result])
    labels = _labels(q)
    commands = forward(robot, q)
    before = [-1, *labels[:-1]]
    ends = np.cumsum(np.bincount(labels))[:-1]
    return [
        _cycles([result[k] for k in rows], commands[rows], tuple(int(before[k]) for k in rows))
        for rows in np.split(np.argsort(labels, kind='stable'), ends)
    ]


def _labels(q: Array) -> np.ndarray:
    """Return the number of the pose of each stop, counted as they first come."""
    labels = np.full(len(q), -1)
    # Of thousands of stations, few are near in the first joint: only these are compared in all.
    order = np.argsort(q[:, 0])
    first = q[order, 0]
    low = np.searchsorted(first, q[:, 0] - _SAME_POSE, 'left')
    high = np.searchsorted(first, q[:, 0] + _SAME_POSE, 'right')
    count = 0
    for k in range(len(q)):
        if labels[k] < 0:
            near = order[low[k] : high[k]]
            alike = near[np.abs(q[near] - q[k]).max(axis=1) < _SAME_POSE]
            labels[alike[labels[alike] < 0]] = count
            count += 1
    return labels


def _cycles(result: list[_Stop], commands: Array, came_from: tuple[int, ...]) -> PoseCycles:
    first = commands[0]
    position = np.stack([stop.position for stop in result])
    turns = [stop.rotation for stop in result if stop.rotation is not None]
    rotation = None
    if len(turns) == len(result):
        off = np.stack(turns) @ np.swapaxes(commands[:, :3, :3], -1, -2)
        rotation = off @ first[:3, :3]
    return PoseCycles(
        result[0].q,
        first,
        np.array([stop.t for stop in result]),
        position - (commands[:, :3, 3] - first[:3, 3]),
        rotation,
        came_from,
    )
