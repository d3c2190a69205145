# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Motions to record: weld seams one after another, free motions of the joints, stations."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array

from .seams import seam_motion, working_posture

RATE = 125.0
"""Joint states a second."""
STATION_PAUSE = 2.0
"""Seconds from one station to the next."""
AIR_SPEED = 0.5
"""Mean joint speed [rad/s] from one seam to the next."""
RAMP = 2.0
"""Seconds in which a free motion sets in."""


class Motion(NamedTuple):
    """Stamps (N,) [s], joint positions (N, n), and whether each is a station at rest."""

    t: Array
    q: Array
    static: bool = False


def motion(kind: str, robot: Robot, span: float, rng: np.random.Generator) -> Motion:
    """
    Return a motion drawn at random.

    kind: 'seams', 'free' or 'stations'.
    span: about how long [s]; two seconds for every station.
    """
    return {'seams': _seams, 'free': _free, 'stations': _stations}[kind](robot, span, rng)


def _seams(robot: Robot, span: float, rng: np.random.Generator) -> Motion:
    """Return seams at random places, with motion through the air between them."""
    pieces: list[Array] = []
    while sum(map(len, pieces)) < 0.8 * span * RATE:
        piece = seam_motion(robot, 0.35 * span, RATE, rng)
        if pieces:
            pieces.append(_air(pieces[-1][-1], piece[0]))
        pieces.append(piece)
    q = np.concatenate(pieces)
    return Motion(np.arange(len(q)) / RATE, q)


def _air(start: Array, end: Array) -> Array:
    """Return a quintic from rest to rest between two postures, without its ends, (N, n)."""
    count = max(int(RATE * np.abs(end - start).max() / AIR_SPEED), 12)
    s = np.arange(1, count) / count
    return start + (end - start) * (s**3 * (10.0 - 15.0 * s + 6.0 * s * s))[:, None]


def _free(robot: Robot, span: float, rng: np.random.Generator) -> Motion:
    """Return sums of slow sines about a working posture, every joint on its own."""
    t = np.arange(0.0, span, 1.0 / RATE)
    centre = working_posture(robot)
    ramp = np.clip(t / RAMP, 0.0, 1.0)
    ramp = ramp * ramp * (3.0 - 2.0 * ramp)
    waves = np.zeros((t.size, robot.n))
    for i in range(robot.n):
        for _ in range(3):
            rate, size = rng.uniform(0.03, 0.35), rng.uniform(0.05, 0.25)
            waves[:, i] += size * np.sin(2.0 * np.pi * rate * t + rng.uniform(0.0, 2.0 * np.pi))
    q = centre + rng.uniform(-0.3, 0.3, robot.n) + waves * ramp[:, None]
    return Motion(t, _inside(robot, q))


def _stations(robot: Robot, span: float, rng: np.random.Generator) -> Motion:
    """Return stations scattered over the working space."""
    count = max(int(2.5 * span), 40)
    spread = np.minimum(0.4 * (robot.upper - robot.lower), 1.2)
    q = working_posture(robot) + rng.uniform(-1.0, 1.0, (count, robot.n)) * spread
    t = np.linspace(0.0, STATION_PAUSE * (count - 1), count)
    return Motion(t, _inside(robot, q), static=True)


def _inside(robot: Robot, q: Array) -> Array:
    """Return the motion squeezed about its middle where it would leave a joint's range."""
    low, high = q.min(axis=0), q.max(axis=0)
    room = 0.95 * (robot.upper - robot.lower)
    middle = 0.5 * (low + high)
    squeeze = np.minimum(1.0, room / np.maximum(high - low, 1e-9))
    reach = 0.5 * squeeze * (high - low)
    edge = 0.02 * (robot.upper - robot.lower)
    centre = np.clip(middle, robot.lower + reach + edge, robot.upper - reach - edge)
    return np.asarray(centre + squeeze * (q - middle))
