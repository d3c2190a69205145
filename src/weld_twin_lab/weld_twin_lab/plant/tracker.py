# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The instruments: tracker, joint stream, wrench and temperature sensors, each with its clock.

Through uneven air rays are traced from the instrument to the target. Air is a gas at one pressure: its
density falls with temperature, its refractive index with its density (Gladstone and Dale). A ray obeys
d/ds(n dr/ds) = grad n. Its first direction is turned until it meets the target; the instrument takes
that direction for the target's, and the optical length over the index at its own place for the
distance. It becomes warmer not quite evenly, the less so the richer the physics.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from .exponentials import Course, Entry, Motion, compose, inverse
from .flaws import Causes, Here, flaw

Readings = tuple[np.ndarray, np.ndarray] | tuple[None, None]
"""Stamps and values of a sensor, or that there is none."""

STAMP_MARGIN = 0.45
"""Share of the spacing that jitter may move a stamp by, so that stamps keep their order."""

SETTLING, SETTLED = 0.02, 120.0
"""Share by which a quartz runs further off while it warms up, and the seconds that takes."""
TICK = 1e-6
"""What a clock that runs on its own counts in [s]."""


@dataclass(frozen=True)
class Tracker:
    """What records the cell. All zero and None: exact values at the command's own stamps."""

    rate: float | None = None
    """Of the pose stream [Hz]; None measures at the command's stamps. Ignored at rest."""
    sigma: float = 0.0
    """White noise of each coordinate [m]."""
    sigma_orientation: float = 0.0
    """White noise about each axis [rad]."""
    orientation: bool = True
    """False records positions only."""
    jitter: float = 0.0
    """Standard deviation of the stamps about the true instants, in motion [s]."""
    drop: float = 0.0
    """Share of samples lost."""
    outlier_share: float = 0.0
    outlier_size: float = 0.0
    """Share of positions thrown off, and how far, in a random direction [m]."""
    clock_offset: float = 0.0
    """Of the tracker's clock, added to its stamps: a time_delay by another name [s]."""
    joint_rate: float | None = None
    """[Hz]"""
    joint_jitter: float = 0.0
    """[s]"""
    joint_drop: float = 0.0
    velocity: bool = True
    """Whether joint velocity is published."""
    wrench_sigma: float = 0.0
    """White noise of the forces [N]; torques have a tenth of it [N m]."""
    temperature_rate: float | None = None
    """[Hz]"""
    temperature_lag: float = 0.0
    """First-order lag of the sensor [s]; it starts in equilibrium."""
    temperature_sigma: float = 0.0
    """[K]"""


def instants(
    t: np.ndarray, rate: float | None, drop: float, rng: np.random.Generator
) -> np.ndarray:
    """Return true sampling instants within a command's times, some of them lost, (M,) [s]."""
    if rate is not None:
        # the sensor's clock does not start with the command's
        t = np.arange(t[0] + rng.uniform(0.0, 1.0 / rate), t[-1], 1.0 / rate)
    return np.asarray(t[kept(len(t), drop, rng)])


def kept(count: int, drop: float, rng: np.random.Generator) -> np.ndarray:
    """Return which samples arrive, shape (count,), bool."""
    return np.ones(count, dtype=bool) if drop <= 0.0 else np.asarray(rng.random(count) >= drop)


def stamped(t: np.ndarray, jitter: float, rng: np.random.Generator) -> np.ndarray:
    """Return stamps that scatter about the true instants but keep their order, (M,) [s]."""
    if jitter <= 0.0 or len(t) < 2:
        return np.array(t)
    limit = STAMP_MARGIN * float(np.diff(t).min())
    return np.asarray(t + np.clip(jitter * rng.standard_normal(len(t)), -limit, limit))


def gained(causes: Causes, since: np.ndarray, richness: float) -> np.ndarray:
    """
    Return what the tracker's clock has gained on that of the joints since both were set, shape (M,) [s].

    Its quartz warms up with the instrument, and it counts whole ticks.
    """
    rate = float(causes.total('clock_rate', 'rate'))
    warm = richness * SETTLING * SETTLED * -np.expm1(-since / SETTLED)
    return np.asarray(TICK * np.round(rate * (since + warm) / TICK))


def observe(
    tracker: Tracker, pose: Motion, sigma: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray | None]:
    """Return positions and quaternions, or None, that the tracker reads of true poses by a noise [m]."""
    position = pose.position + sigma * rng.standard_normal(pose.position.shape)
    if tracker.outlier_share > 0.0:
        off = rng.random(len(position)) < tracker.outlier_share
        way = rng.standard_normal(position.shape)
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        position += tracker.outlier_size * off[:, None] * way
    if not tracker.orientation:
        return position, None
    shake = tracker.sigma_orientation * rng.standard_normal(position.shape)
    turned = Rotation.from_matrix(pose.rotation) * Rotation.from_rotvec(shake)
    return position, turned.as_quat()


def wrench_stream(tracker: Tracker, course: Course, rng: np.random.Generator) -> Readings:
    """Return stamps and readings of the tool wrench at the command's stamps, or two Nones."""
    command = course.command
    if command.wrench is None:
        return None, None
    scale = tracker.wrench_sigma * np.repeat([1.0, 0.1], 3)
    return command.t.copy(), command.wrench + scale * rng.standard_normal(command.wrench.shape)


def temperature_stream(tracker: Tracker, course: Course, rng: np.random.Generator) -> Readings:
    """Return stamps and readings of a slow, noisy temperature sensor, or two Nones."""
    command = course.command
    if command.temperature is None:
        return None, None
    t = instants(command.t, tracker.temperature_rate, 0.0, rng)
    reading = np.interp(t, command.t, command.temperature)
    if tracker.temperature_lag > 0.0:
        follow = 1.0 - np.exp(-np.diff(t, prepend=t[0]) / tracker.temperature_lag)
        level = reading[0]
        for k in range(len(t)):
            level += follow[k] * (reading[k] - level)
            reading[k] = level
    return t, reading + tracker.temperature_sigma * rng.standard_normal(len(t))


@dataclass(frozen=True, eq=False)
class Eye:
    """A camera as it really is."""

    focal: np.ndarray
    centre: np.ndarray
    """Shape (2,) [px]."""
    bent: tuple[float, float, float, float]
    """Radial k1 and k2, tangential p1 and p2."""
    stands: Motion
    """Camera in the measuring frame: z ahead, x to the right."""
    size: tuple[int, int]
    """Width and height of its images [px]."""


def looking(place: np.ndarray, aim: np.ndarray) -> Motion:
    """Return a camera at a place that looks at an aim, its images upright."""
    ahead = (aim - place) / np.linalg.norm(aim - place)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right = right / np.linalg.norm(right)
    return Motion(np.stack([right, np.cross(ahead, right), ahead], axis=1), place)


def seen(
    eye: Eye, board: Motion, points: np.ndarray, noise: float, rng: np.random.Generator
) -> np.ndarray:
    """
    Return where points appear, shape (M, P, 2) [px]; NaN where they are outside of the image.

    board: in the measuring frame.
    points: in the board's own frame, shape (P, 3) [m].
    noise: standard deviation of each coordinate [px].
    """
    there = compose(inverse(eye.stands), board)
    at = np.einsum('mij,pj->mpi', there.rotation, points) + there.position[:, None]
    ray = at[..., :2] / at[..., 2:]
    x, y = np.moveaxis(ray, -1, 0)
    k1, k2, p1, p2 = eye.bent
    far = x**2 + y**2
    radial = 1.0 + k1 * far + k2 * far**2
    across = x * radial + 2.0 * p1 * x * y + p2 * (far + 2.0 * x**2)
    down = y * radial + p1 * (far + 2.0 * y**2) + 2.0 * p2 * x * y
    pixel = np.stack([across, down], axis=-1) * eye.focal + eye.centre
    pixel = pixel + rng.normal(0.0, noise, pixel.shape)
    inside = (at[..., 2] > 0.0) & (pixel > 0.0).all(axis=-1) & (pixel < eye.size).all(axis=-1)
    return np.where(inside[..., None], pixel, np.nan)


REFRACTION = 2.256e-4
"""Refractivity over density [m^3/kg]: 2.717e-4 at 1.204 kg/m^3 (emtoolbox.nist.gov, appendix B)."""
GAS = 101325.0 * 0.0289652 / 8.314462
"""Density of dry air times its temperature [kg K/m^3], at one atmosphere."""
COOL = 293.15
"""Temperature at the instrument [K]."""
UNEVEN = 0.02
"""By how much a gradient grows over a metre of way along it."""
STEPS = 6
"""Steps of a ray; its direction changes by microradians, so few are exact to nanometres."""
SHOTS = 3
"""Times that the first direction is turned; each miss is a hundred thousandth of the last."""


@flaw('sight')
def refraction(entry: Entry, here: Here, pose: Motion) -> Motion:
    """Return the pose with its position as the instrument sees it."""
    return pose._replace(position=_seen(entry, pose.position, UNEVEN * here.richness))


def _seen(item: Entry, target: np.ndarray, uneven: float) -> np.ndarray:
    start = np.asarray(item.get('instrument', (0.0, 0.0, 0.0)), dtype=float)
    warming = np.asarray(item['warming'], dtype=float)
    steep = float(np.linalg.norm(warming))
    if steep == 0.0:
        return target
    air = (warming / steep, steep, uneven)
    goal = target - start
    length = np.linalg.norm(goal, axis=1, keepdims=True)
    way = goal / length
    for _ in range(SHOTS):
        end, optical = _ray(way, length, air)
        miss = goal - end
        length = length + (miss * way).sum(axis=1, keepdims=True)
        way = way + (miss - (miss * way).sum(axis=1, keepdims=True) * way) / length
        way = way / np.linalg.norm(way, axis=1, keepdims=True)
    _, optical = _ray(way, length, air)
    return np.asarray(start + optical / _index(np.zeros((1, 3)), air)[0] * way)


Air = tuple[np.ndarray, float, float]
"""Which way it gets warmer, by how much [K/m], and how unevenly [1/m]."""
State = tuple[np.ndarray, ...]
"""Place of a ray, its direction times the index, its optical length so far."""


def _index(r: np.ndarray, air: Air) -> tuple[np.ndarray, np.ndarray]:
    """Return the refractive index at places (M, 3), and its gradient, (M, 1) and (M, 3)."""
    up, steep, uneven = air
    high = r @ up[:, None]
    warm = COOL + steep * high * (1.0 + uneven * high)
    excess = REFRACTION * GAS / warm
    slope = -excess / warm * steep * (1.0 + 2.0 * uneven * high)
    return 1.0 + excess, slope * up


def _ray(way: np.ndarray, length: np.ndarray, air: Air) -> tuple[np.ndarray, np.ndarray]:
    """Return where rays of a length end, (M, 3), and their optical lengths, (M, 1)."""

    def change(state: State) -> State:
        n, gradient = _index(state[0], air)
        return state[1] / n, gradient, n

    def ahead(state: State, by: State, h: np.ndarray) -> State:
        return tuple(a + h * b for a, b in zip(state, by, strict=True))

    start = np.zeros_like(way)
    state: State = (start, way * _index(start, air)[0], np.zeros_like(length))
    h = length / STEPS
    for _ in range(STEPS):
        a = change(state)
        b = change(ahead(state, a, 0.5 * h))
        c = change(ahead(state, b, 0.5 * h))
        d = change(ahead(state, c, h))
        rates = zip(a, b, c, d, strict=True)
        state = ahead(state, tuple((p + 2.0 * q + 2.0 * r + s) / 6.0 for p, q, r, s in rates), h)
    return state[0], state[2]
