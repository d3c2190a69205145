# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Performance criteria of ISO 9283: pose and path accuracy, repeatability, drift, variation.

Cycles are repetitions of one commanded pose or path under the same conditions; the standard
asks for 30 cycles of a pose and 10 of a path, and every result says how many there were.
Positions of a free calibration set are not cycles: their RMS is not an accuracy in this sense.

References
----------
.. [1] ISO 9283:1998, Manipulating industrial robots - Performance criteria and related test
   methods, clauses 7.2 (pose), 7.6 (drift) and 8 (path).

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arm.rotation import angle_between
from ..arrays import Array, readonly
from ..errors import DataError

POSE_CYCLES = 30
"""Cycles of one pose that the standard asks for (clause 7.2)."""
PATH_CYCLES = 10
"""Cycles of one path that the standard asks for (clause 8)."""
DRIFT_CYCLES = 10
"""Cycles to a group whose accuracy is compared over time (clause 7.6)."""


class _Plain:
    def as_dict(self: Any) -> dict[str, Any]:
        """Return the fields as plain numbers and tuples."""
        return asdict(self)


@dataclass(frozen=True)
class PosePerformance(_Plain):
    """AP and RP of one commanded pose (clauses 7.2.1 and 7.2.2)."""

    cycles: int
    ap_m: float
    """Distance of the barycentre of the attained positions from the command [m]."""
    rp_m: float
    """Repeatability: mean distance from the barycentre and three deviations of it [m]."""
    ap_xyz_m: tuple[float, float, float]
    """Barycentre minus command [m]."""
    ap_rad: tuple[float, float, float] | None = None
    rp_rad: tuple[float, float, float] | None = None
    """Mean orientation against the command, and three standard deviations about the mean, as
    components of a rotation vector [rad]; for the small turns meant here these are the standard's
    three angles."""


@dataclass(frozen=True)
class PathPerformance(_Plain):
    """AT and RT of one commanded path (clauses 8.2 and 8.3)."""

    cycles: int
    at_m: float
    """Largest distance of the barycentre path from the command path [m]."""
    rt_m: float
    """Largest mean distance from the barycentre and three deviations of it [m]."""
    at_index: int
    rt_index: int
    """Command point at which each was found."""


@dataclass(frozen=True)
class DriftPerformance(_Plain):
    """Drift of pose characteristics (clause 7.6)."""

    dap_m: float
    drp_m: float
    """Largest change of AP and of RP against the first group of cycles [m]."""
    ap_m: tuple[float, ...]
    rp_m: tuple[float, ...]
    """AP and RP of every group [m]."""


def pose_performance(
    attained: ArrayLike,
    command: ArrayLike,
    rotation: Array | None = None,
    command_rotation: Array | None = None,
) -> PosePerformance:
    """
    Return accuracy and repeatability of one pose.

    Parameters
    ----------
    attained : array_like, shape (cycles, 3) [m]
    command : array_like, shape (3,) [m]
    rotation : array, shape (cycles, 3, 3), optional
    command_rotation : array, shape (3, 3), optional

    Raises
    ------
    DataError
        Fewer than two cycles.

    """
    points = _cycles(attained, 3, 'attained positions')
    goal = readonly(command, (3,), 'commanded position')
    off = points.mean(axis=0) - goal
    turn, spread = None, None
    if rotation is not None and command_rotation is not None:
        turned = readonly(rotation, (len(points), 3, 3), 'attained orientations')
        errors = angle_between(turned, np.asarray(command_rotation, dtype=np.float64))
        turn, spread = _three(errors.mean(axis=0)), _three(3.0 * errors.std(axis=0, ddof=1))
    return PosePerformance(
        len(points),
        float(np.linalg.norm(off)),
        float(_repeatability(points)),
        _three(off),
        turn,
        spread,
    )


def path_performance(
    attained: Sequence[ArrayLike], command: ArrayLike, tangent: ArrayLike
) -> PathPerformance:
    """
    Return accuracy and repeatability of one path.

    Parameters
    ----------
    attained : sequence of array_like, each shape (K, 3) [m]
        One measured path per cycle, each sampled as it comes.
    command : array_like, shape (m, 3) [m]
        Points of the command path at which to evaluate.
    tangent : array_like, shape (m, 3)
        Direction of the command path there.

    Raises
    ------
    DataError
        Fewer than two cycles, or a cycle that does not pass a command point.

    """
    if len(attained) < 2:
        raise DataError(_too_few(len(attained)))
    goal = readonly(command, (None, 3), 'command path')
    direction = readonly(tangent, goal.shape, 'tangents of the command path')
    crossed = np.empty((len(attained), *goal.shape))
    for k, path in enumerate(attained):
        points = readonly(path, (None, 3), 'attained path')
        for i, (centre, normal) in enumerate(zip(goal, direction, strict=True)):
            passed = nearest_pass(points, centre, normal)
            if passed is None:
                raise DataError(
                    f'cycle {k} does not pass command point {i}; leave out the ends of the command '
                    'path that not every cycle covers'
                )
            crossed[k, i] = passed
    return crossing_performance(crossed, goal)


def crossing_performance(crossed: Array, command: Array) -> PathPerformance:
    """Return accuracy and repeatability of a path (m, 3) [m] from its cycles' crossings."""
    off, spread = along_path(crossed, command)
    worst, loosest = int(off.argmax()), int(spread.argmax())
    return PathPerformance(len(crossed), float(off[worst]), float(spread[loosest]), worst, loosest)


def along_path(crossed: Array, command: Array) -> tuple[Array, Array]:
    """Return accuracy and repeatability [m] at every point of a path, shape (m,) each."""
    return np.linalg.norm(crossed.mean(axis=0) - command, axis=-1), _repeatability(crossed)


def nearest_pass(points: Array, centre: Array, normal: Array) -> Array | None:
    """
    Return where a path (K, 3) passes a plane along its normal, nearest to its centre, (3,) [m].

    None where it does not. Rows that are not numbers are gaps, over which nothing passes.
    """
    height = (points - centre) @ normal
    before = np.flatnonzero((height[:-1] <= 0.0) & (height[1:] >= 0.0))
    if before.size == 0:
        return None
    rise = height[before + 1] - height[before]
    part = np.where(rise > 0.0, -height[before] / np.where(rise > 0.0, rise, 1.0), 0.0)
    passed = points[before] + part[:, None] * (points[before + 1] - points[before])
    nearest: Array = passed[np.linalg.norm(passed - centre, axis=1).argmin()]
    return nearest


def drift(groups: Sequence[ArrayLike], command: ArrayLike) -> DriftPerformance:
    """
    Return how pose accuracy and repeatability drift over groups of cycles in order of time.

    Parameters
    ----------
    groups : sequence of array_like, each shape (cycles, 3) [m]
    command : array_like, shape (3,) [m]

    Raises
    ------
    DataError
        Fewer than two groups, or fewer than two cycles in one.

    """
    if len(groups) < 2:
        raise DataError(f'drift compares groups of cycles over time, got {len(groups)} group')
    result = [pose_performance(group, command) for group in groups]
    accuracy, spread = (np.array([getattr(f, key) for f in result]) for key in ('ap_m', 'rp_m'))
    return DriftPerformance(
        float(abs(accuracy - accuracy[0]).max()),
        float(abs(spread - spread[0]).max()),
        tuple(accuracy.tolist()),
        tuple(spread.tolist()),
    )


def multidirectional_variation(approaches: Sequence[ArrayLike]) -> float:
    """
    Return vAP [m]: the largest distance between the barycentres of different approaches.

    It isolates lost motion, as every approach has the same command (clause 7.2.3; the standard
    takes three directions of approach).

    Parameters
    ----------
    approaches : sequence of array_like, each shape (cycles, 3) [m]
        Attained positions, one array per direction of approach.

    Raises
    ------
    DataError
        Fewer than two directions, or fewer than two cycles in one.

    """
    if len(approaches) < 2:
        raise DataError(
            'variation of pose accuracy compares directions of approach, '
            f'got {len(approaches)} direction'
        )
    centres = np.stack([_cycles(a, 3, 'attained positions').mean(axis=0) for a in approaches])
    return float(np.linalg.norm(centres[:, None] - centres[None], axis=-1).max())


def _cycles(values: ArrayLike, width: int, name: str) -> Array:
    points = readonly(values, (None, width), name)
    if len(points) < 2:
        raise DataError(_too_few(len(points)))
    return points


def _too_few(count: int) -> str:
    return f'repeatability needs at least two cycles, got {count}; repeat the pose or path'


def _repeatability(points: Array) -> Array:
    """Return mean distance plus three standard deviations over the cycles, axis 0."""
    distance = np.linalg.norm(points - points.mean(axis=0), axis=-1)
    spread: Array = distance.mean(axis=0) + 3.0 * distance.std(axis=0, ddof=1)
    return spread


def _three(vector: Array) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in vector)
    return x, y, z
