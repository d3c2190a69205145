# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Motions to record: weld seams one after another, free motions of the joints, stations."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import PathError
from weld_twin_core.motion.paths import Arc, Circle, Line, Path, Polyline, Spline, Torch, Weave
from weld_twin_core.motion.paths import default_seam as bundled_seam
from weld_twin_core.motion.planned_motion import plan
from weld_twin_core.motion.profiles import Aggressive, Profile, Smooth

KINDS = ('line', 'arc', 'circle', 'polyline', 'spline', 'weave')
SIZE = (0.1, 0.3)
"""Length of a seam [m]."""
TRIES = 40
"""Seams drawn for a robot before it is given up; many are out of its reach."""
LONGEST = 2.0
"""How many times as long as wanted a seam may take where the joints are slow."""


def seam_motion(robot: Robot, span: float, rate: float, rng: np.random.Generator) -> Array:
    """Return joint positions along one seam, (N, n); raises PathError where none drawn can be welded."""
    most = int(np.ceil(LONGEST * span * rate))
    for _ in range(TRIES):
        q, seam, torch = drawn_seam(robot, rng)
        law: Profile = Smooth(speed=seam.length / span)
        if rng.random() < 0.5:
            law = Aggressive(speed=float(rng.uniform(0.05, 0.2)), reversals=6)
        try:
            moved = plan(
                robot, seam, law, rate, torch=torch, fit=True, seed=q, most_samples=most
            ).motion.q
        except PathError:
            continue
        if len(moved) < LONGEST * span * rate:
            return np.array(moved)
    raise PathError(f'none of {TRIES} seams drawn for {robot.name} is within its reach')


def drawn_seam(
    robot: Robot, rng: np.random.Generator, kinds: Sequence[str] = KINDS
) -> tuple[Array, Path, Torch]:
    """Return a posture near the working one, shape (n,), a seam through its tool, and the torch."""
    q = working_posture(robot) + rng.uniform(-0.4, 0.4, robot.n)
    seam = _seam(str(rng.choice(kinds)), forward(robot, q), float(rng.uniform(*SIZE)), rng)
    return q, seam, Torch(work=rng.uniform(-0.2, 0.2), travel=rng.uniform(-0.2, 0.2))


def working_posture(robot: Robot) -> Array:
    """Return a posture that bends the arm and stays away from the limits, shape (n,)."""
    bare = robot.with_frames(tool=np.eye(4))
    key = json.dumps(bare.to_mapping())
    if key not in _POSTURES:
        _POSTURES[key] = _posture(bare)
    return np.array(_POSTURES[key])


_POSTURES: dict[str, Array] = {}
"""By what robots say of themselves: every case has an object of its own."""


def _posture(bare: Robot) -> Array:
    q = plan(bare, bundled_seam(bare, 'line'), 'smooth', 10.0, fit=True).motion.q
    return np.asarray(q[len(q) // 2])


def _seam(kind: str, pose: Array, size: float, rng: np.random.Generator) -> Path:
    """Return a seam through the tool's place, on work that faces the torch."""
    centre, normal = pose[:3, 3], -pose[:3, 2]
    turn = rng.uniform(0.0, 2.0 * np.pi)
    along = np.cos(turn) * pose[:3, 0] + np.sin(turn) * pose[:3, 1]
    across = np.cross(normal, along)

    def points(*plane: tuple[float, float]) -> Array:
        local = size * np.array(plane)
        return np.asarray(centre + local[:, :1] * along + local[:, 1:] * across)

    start, end = points((-0.5, 0.0), (0.5, 0.0))
    line = Line(start, end, normal)
    if kind == 'arc':
        first, middle, last = points((-0.45, -0.15), (0.0, 0.15), (0.45, -0.15))
        return Arc(first, middle, last, normal)
    if kind == 'circle':
        return Circle(centre, 0.3 * size, normal, along)
    if kind == 'polyline':
        corners = points((-0.4, -0.2), (-0.4, 0.2), (0.0, 0.0), (0.4, 0.2), (0.4, -0.2))
        return Polyline(corners, 0.03 * size, normal)
    if kind == 'spline':
        bends = points((-0.5, 0.0), (-0.25, 0.15), (0.0, 0.0), (0.25, -0.15), (0.5, 0.0))
        return Spline(bends, normal)
    return Weave(line, 0.01 * size, 0.05 * size) if kind == 'weave' else line


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
    """Return 'seams', 'free' or 'stations' drawn at random, about so long [s]; 2 s for every station."""
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
