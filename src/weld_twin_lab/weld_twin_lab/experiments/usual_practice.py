# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What is measured where nobody asks what is in doubt: at random, richly, or D-optimal."""

from __future__ import annotations

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.effects import effects_from_list
from weld_twin_core.recording import JointMotion, Measurements, Recording
from weld_twin_core.sequences import halton
from weld_twin_core.twin.features import Features
from weld_twin_core.twin.twin import Twin

from ..blind.recorded_motion import RATE, Motion
from ..blind.recorded_motion import motion as drawn
from ..blind.seams import working_posture
from .sealed_cell import STAY, stations

WIDE = 1.2
"""Half the range [rad, m] about a working posture, as random stations have it, within limits."""
POOL = 200
"""Postures that D-optimal ones are chosen from."""
GEOMETRY = {
    'joint_offset': 'offset',
    'link_length': 'da',
    'link_offset': 'dd',
    'link_twist': 'dalpha',
}
"""What calibrators choose postures for: the four errors of every row."""
WEAK = 1e-8
"""Added to the diagonal, as a share of it: directions that no posture shows."""


def at_random(robot: Robot, still: bool, minutes: float, seed: int) -> Motion:
    """Return random motion of so many minutes, or random stations."""
    rng = np.random.default_rng([seed, 7])
    if still:
        most = drawn('stations', robot, 200.0, rng).q
        return stations(most[: int(60.0 * minutes / STAY)])
    return drawn('free', robot, 60.0 * minutes, rng)


def rich(robot: Robot, still: bool, minutes: float) -> Motion:
    """
    Return the motion that is the same whatever is in doubt.

    All joints move through their wide range at once, each with its own two rhythms, slowly and
    fast by turns; at rest, stations that fill the same range evenly.
    """
    low, high = wide_range(robot)
    if still:
        return stations(low + halton(robot.n, int(60.0 * minutes / STAY)) * (high - low))
    t = np.arange(0.0, 60.0 * minutes, 1.0 / RATE)
    # Speed goes up and down between a third and one and two thirds of the mean, twice a minute.
    s = t - 0.66 * 30.0 / (2.0 * np.pi) * np.sin(2.0 * np.pi * t / 30.0)
    joint = np.arange(robot.n)
    slow, fast = 0.031 + 0.0073 * joint, 0.097 + 0.0131 * joint
    waves = 0.7 * np.sin(2.0 * np.pi * slow * s[:, None] + joint)
    waves += 0.3 * np.sin(2.0 * np.pi * fast * s[:, None] + 2.0 * joint)
    return Motion(t, 0.5 * (low + high) + 0.5 * (high - low) * waves)


def wide_range(robot: Robot) -> tuple[Array, Array]:
    """Return the ends of the range that usual practice uses, two arrays (n,) [rad, m]."""
    middle = working_posture(robot)
    inset = 0.02 * np.where(np.isfinite(robot.upper - robot.lower), robot.upper - robot.lower, 0.0)
    low = np.maximum(middle - WIDE, robot.lower + inset)
    return low, np.minimum(middle + WIDE, robot.upper - inset)


def d_optimal(robot: Robot, count: int, points: bool) -> Motion:
    """
    Return stations of which each adds most to the determinant of the geometry's information.

    Parameters
    ----------
    robot : Robot
    count : int
    points : bool
        Whether the instrument tells positions only.

    """
    low, high = wide_range(robot)
    pool = low + halton(robot.n, POOL) * (high - low)
    columns = _geometry(robot, pool, points)
    size = np.linalg.norm(columns, axis=(0, 1))
    columns = columns[..., size > 1e-9] / size[size > 1e-9]
    information = WEAK * np.eye(columns.shape[-1])
    chosen: list[int] = []
    for _ in range(count):
        whitened = columns @ np.linalg.inv(np.linalg.cholesky(information)).T
        gains = np.linalg.slogdet(
            np.eye(columns.shape[1]) + whitened @ np.swapaxes(whitened, 1, 2)
        )[1]
        gains[chosen] = -np.inf
        best = int(np.argmax(gains))
        chosen.append(best)
        information = information + columns[best].T @ columns[best]
    return stations(pool[chosen])


def _geometry(robot: Robot, pool: Array, points: bool) -> Array:
    """Return the derivatives of the pose by the geometry, shape (N, 3 or 6, P)."""
    t = np.arange(len(pool), dtype=float)
    recording = Recording(
        'pool', JointMotion(t, pool, static=True), Measurements(t, np.zeros((len(t), 3)))
    )
    maker = Features(Twin(robot), recording, t)
    entries = [
        {'effect': name, 'joint': joint, key: 0.0}
        for name, key in GEOMETRY.items()
        for joint in robot.joint_names
    ]
    blocks = [maker.columns(effect, False) for effect in effects_from_list(entries, robot)]
    stacked = np.concatenate(blocks)[:, : 3 if points else 6]
    return np.asarray(np.moveaxis(stacked, -1, 0).swapaxes(1, 2))
