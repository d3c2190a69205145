# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Base, DH values and tool of a robot from measured poses, by Gauss-Newton.

The screws of `bulk` are all a step needs: a turn about an axis has the screw as its column, a
slide its axis. Columns are scaled to one and multiplied out, thirty by thirty; where the columns
are too nearly dependent for that (it squares their condition), a QR factorisation of the columns
themselves takes over.

References
----------
.. [1] L. J. Everett, M. Driels, B. W. Mooring, "Kinematic modelling for robot calibration", IEEE
   ICRA 1987.

"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, lstsq

from weld_twin_core.arm.bulk import BulkKernel
from weld_twin_core.arm.channels import Channel
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import rotation_matrix, transform
from weld_twin_core.arrays import Array

SETTLED = 1e-12
"""Step [m, rad] that ends the iteration."""
STEPS = 20
"""Steps at most; each squares the error, so that a fit which needs more does not converge."""
_SQUARED = 1e-10
"""Squared pivot of the scaled normal equations below which they are not trusted."""
_DEPENDENT = 1e-10
"""Pivot of the scaled columns that counts as none; the shortest step is taken then."""
_DH = ('theta', 'd', 'a', 'alpha', 'beta')


class Calibration(NamedTuple):
    """
    What a calibration found.

    The robot, the RMS of what was left before the last step [m and rad], the number of steps,
    whether any of them needed the QR factorisation, and whether the last was as good as none.
    """

    robot: Robot
    rms: float
    steps: int
    by_qr: bool
    settled: bool


def minimal_channels(robot: Robot) -> tuple[Channel, ...]:
    """
    Return channels that are independent for a 'standard' chain of revolute joints in general.

    The base holds theta and d of the first row, the tool the whole last row: 4 n + 6 in all.
    Rows whose axes are parallel need 'beta' in place of 'd' besides.
    """
    first = [('a', 0), ('alpha', 0)]
    middle = [(key, i) for i in range(1, robot.n - 1) for key in ('theta', 'd', 'a', 'alpha')]
    base, tool = ([(name, k) for k in range(6)] for name in ('base', 'tool'))
    return (*base, *first, *middle, *tool)


def calibrate(
    robot: Robot,
    q: Array,
    poses: Array,
    channels: Sequence[Channel] | None = None,
    length: float = 1.0,
) -> Calibration:
    """
    Return the robot whose poses fit the measured ones best.

    Parameters
    ----------
    robot : Robot
        Where to start.
    q : array, shape (N, n) [rad or m]
    poses : array, shape (N, 4, 4)
    channels : sequence of Channel, optional
        What to fit; left out, `minimal_channels`.
    length : float [m]
        What a turn of one radian weighs against.

    """
    wanted = tuple(channels) if channels is not None else minimal_channels(robot)
    by_qr, settled, steps, residual = False, False, 0, np.zeros(1)
    for steps in range(1, STEPS + 1):  # noqa: B007 - counted for the result
        columns, residual = linearised(robot, q, poses, wanted, length)
        step, qr = _solved(columns, residual)
        by_qr |= qr
        robot = moved(robot, wanted, step)
        settled = bool(np.abs(step).max() < SETTLED)
        if settled:
            break
    return Calibration(robot, float(np.sqrt((residual * residual).mean())), steps, by_qr, settled)


def _residual(found: Array, poses: Array, length: float) -> Array:
    """Return measured minus found, shape (6, N): position, and turn to first order."""
    turn = poses[:, :3, :3] @ found[:, :3, :3].swapaxes(1, 2)
    out = np.empty((6, len(poses)))
    out[:3] = (poses[:, :3, 3] - found[:, :3, 3]).T
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        out[3 + k] = 0.5 * length * (turn[:, j, i] - turn[:, i, j])
    return out


def linearised(
    robot: Robot, q: Array, poses: Array, channels: Sequence[Channel], length: float = 1.0
) -> tuple[Array, Array]:
    """
    Return d pose / d channels, shape (P, 6 N), and measured minus found, shape (6 N,).

    Frames are displaced along and about their own axes, the base's those of the world.

    Parameters
    ----------
    robot : Robot
    q : array, shape (N, n) [rad or m]
    poses : array, shape (N, 4, 4) [m]
        Measured ``T_world_tool``.
    channels : sequence of channel, length P
        Geometric channels; see `minimal_channels`.
    length : float [m]
        What a turn of 1 rad counts as, so that positions and turns share a unit.

    """
    turn_of = _turns(robot)
    named = dict.fromkeys((turn_of[key], i) for key, i in channels if key in turn_of)
    turns = sorted(named, key=lambda c: c[1])
    found, screws = BulkKernel(robot, turns).screws(q)
    columns = np.zeros((len(channels), 6, len(q)))
    frames = {'base': _base_frame(robot), 'tool': found[:, :3].transpose(2, 1, 0)}
    for column, (key, i) in zip(columns, channels, strict=True):
        if key in frames:
            _frame_column(column, key, i, frames[key], found)
            continue
        screw = screws[:, turns.index((turn_of[key], i))]
        if key in ('d', 'a'):
            column[:3] = screw[3:]
        else:
            column[:] = screw
    columns[:, 3:] *= length
    return columns.reshape(-1, 6 * len(q)), _residual(found, poses, length).ravel()


def _turns(robot: Robot) -> dict[str, str]:
    """Return about whose axis a DH value turns or slides; beta parts a from alpha if modified."""
    out = {key: key for key in _DH}
    return out | {'d': 'theta'} | ({'a': 'alpha'} if robot.convention == 'standard' else {})


def _base_frame(robot: Robot) -> Array:
    return np.concatenate([np.eye(3), robot.T_world_base[:3, 3:].T])[..., None]


def _frame_column(column: Array, key: str, i: int, frame: Array, found: Array) -> None:
    """Write the column of a small displacement of a frame along or about its own axes."""
    axis, point = frame[i % 3], frame[3]
    if i < 3:
        column[:3] = axis
        return
    column[3:] = axis
    if key == 'base':
        column[:3] = np.cross(axis[:, 0], found[:, :3, 3] - point[:, 0]).T


def _solved(columns: Array, residual: Array) -> tuple[Array, bool]:
    """Return the least-squares step, and whether the normal equations would not do."""
    scale = 1.0 / np.sqrt(np.einsum('ij,ij->i', columns, columns))
    normal = (columns @ columns.T) * scale * scale[:, None]
    try:
        factor = cho_factor(normal, check_finite=False)
    except LinAlgError:
        factor = None
    if factor is not None and np.abs(np.diagonal(factor[0])).min() ** 2 > _SQUARED:
        step = scale * cho_solve(factor, scale * (columns @ residual), check_finite=False)
        return step, False
    scaled = (columns * scale[:, None]).T
    step = lstsq(scaled, residual, _DEPENDENT, lapack_driver='gelsy')[0]
    return scale * step, True


def moved(robot: Robot, channels: Sequence[Channel], step: Array) -> Robot:
    """
    Return the robot with its channels displaced.

    Parameters
    ----------
    robot : Robot
    channels : sequence of channel, length P
        As for `linearised`.
    step : array, shape (P,) [rad or m]

    """
    values: dict[str, Any] = {key: np.array(getattr(robot, key)) for key in _DH}
    small = {'base': np.zeros(6), 'tool': np.zeros(6)}
    for (key, i), change in zip(channels, step, strict=True):
        (small if key in small else values)[key][i] += change
    base = robot.T_world_base.copy()
    base[:3, :3] = rotation_matrix(small['base'][3:]) @ base[:3, :3]
    base[:3, 3] += small['base'][:3]
    tool = transform(rotation_matrix(small['tool'][3:]), small['tool'][:3])
    return replace(robot, **values, T_world_base=base, T_flange_tool=robot.T_flange_tool @ tool)
