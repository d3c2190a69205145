# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a tracker sees through uneven air: rays traced from the instrument to the target.

Air is a gas at one pressure: its density falls with temperature, its refractive index with its
density (Gladstone and Dale). A ray obeys d/ds(n dr/ds) = grad n. Its first direction is turned
until it meets the target; the instrument takes that direction for the target's, and the optical
length over the index at its own place for the distance. It becomes warmer not quite evenly, the
less so the richer the physics.
"""

import numpy as np

from .exponentials import Entry, Motion
from .flaws import Here, flaw

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
