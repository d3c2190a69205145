# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Time laws s(t): how a seam of any length is travelled.

A law is a piecewise polynomial, so position, speed and acceleration are exact.

Examples
--------
>>> import weld_twin_core as wt
>>> timing = wt.profiles.Trapezoid(speed=0.02, acceleration=0.2).sample(length=0.1, dt=0.01)
>>> print(f'{timing.t[-1]:.2f} s, {timing.sd.max():.3f} m/s at most')
5.10 s, 0.020 m/s at most

References
----------
.. [1] L. Biagiotti, C. Melchiorri, "Trajectory Planning for Automatic Machines and Robots",
   Springer 2008, ch. 2 and 3.

"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from scipy.interpolate import PPoly

from ..arrays import Array
from ..errors import PathError
from .paths.seams import positive
from .sample_count import MOST_SAMPLES, refuse_endless


class Timing(NamedTuple):
    """Stamps t [s], arc length s [m], its rate sd [m/s] and acceleration sdd [m/s^2], (N,)."""

    t: Array
    s: Array
    sd: Array
    sdd: Array


class Profile(ABC):
    """A time law; its numbers are positive."""

    def __post_init__(self) -> None:
        for field in fields(self):  # type: ignore[arg-type]
            what = f'{type(self).__name__.lower()} profile: {field.name}'
            positive(getattr(self, field.name), what)

    @abstractmethod
    def law(self, length: float) -> PPoly:
        """Return s(t) from 0 to the length, from t = 0 to the last breakpoint."""

    def sample(self, length: float, dt: float, most: int = MOST_SAMPLES) -> Timing:
        """Return the law over a length [m] at steps dt [s] to its end; PathError for too many."""
        law = self.law(length)
        end = float(law.x[-1])
        refuse_endless(end, dt, most)
        t = dt * np.arange(int(np.ceil(end / dt - 1e-9)) + 1, dtype=np.float64)
        inside = np.minimum(t, end)
        moving = t <= end
        return Timing(
            t,
            np.where(moving, law(inside), length),
            np.where(moving, law(inside, 1), 0.0),
            np.where(moving, law(inside, 2), 0.0),
        )


@dataclass(frozen=True)
class Constant(Profile):
    """Travel speed [m/s] from the first sample to the last."""

    speed: float = 0.01

    def law(self, length: float) -> PPoly:
        return _chained([(length / self.speed, 0.0, 0.0)], self.speed)


@dataclass(frozen=True)
class Trapezoid(Profile):
    """Constant acceleration [m/s^2] up to the speed [m/s] and down again."""

    speed: float = 0.02
    acceleration: float = 0.2

    def law(self, length: float) -> PPoly:
        return _chained(_trapezoid(length, self.speed, self.acceleration))


@dataclass(frozen=True)
class SCurve(Profile):
    """A trapezoid whose acceleration [m/s^2] comes and goes with limited jerk [m/s^3]."""

    speed: float = 0.02
    acceleration: float = 0.2
    jerk: float = 2.0

    def law(self, length: float) -> PPoly:
        peak = self._peak(length)
        a, j = self.acceleration, self.jerk
        ramp = min(a / j, np.sqrt(peak / j))
        top = j * ramp
        hold = peak / top - ramp
        cruise = max(length / peak - (hold + 2.0 * ramp), 0.0)
        rise = [(ramp, 0.0, j), (hold, top, 0.0), (ramp, top, -j)]
        fall = [(ramp, 0.0, -j), (hold, -top, 0.0), (ramp, -top, j)]
        return _chained(rise + [(cruise, 0.0, 0.0)] + fall)

    def _peak(self, length: float) -> float:
        """Return the speed reached, lower than wanted when the seam is short."""
        a, j = self.acceleration, self.jerk
        if self.speed * j >= a * a:
            stop = self.speed * (self.speed / a + a / j)
        else:
            stop = 2.0 * self.speed * np.sqrt(self.speed / j)
        if stop <= length:
            return self.speed
        peak = 0.5 * a * (np.sqrt((a / j) ** 2 + 4.0 * length / a) - a / j)
        if peak * j < a * a:
            peak = (0.5 * length * np.sqrt(j)) ** (2.0 / 3.0)
        return float(peak)


@dataclass(frozen=True)
class Smooth(Profile):
    """The quintic from rest to rest; ``speed`` [m/s] is the mean, the peak is 15/8 of it."""

    speed: float = 0.02

    def law(self, length: float) -> PPoly:
        end = length / self.speed
        powers = np.array([6.0 / end**5, -15.0 / end**4, 10.0 / end**3, 0.0, 0.0, 0.0])
        return PPoly(length * powers[:, None], [0.0, end])


@dataclass(frozen=True)
class Aggressive(Profile):
    """Rapid changes of direction: forward, half-way back and forward again, to the seam's end."""

    speed: float = 0.25
    """Most in either direction [m/s]."""
    acceleration: float = 2.5
    """At every start, stop and reversal, without a ramp [m/s^2]."""
    reversals: int = 10
    """How often the travel turns; rounded up to an even number."""
    back: float = 0.8
    """Part of each advance that is travelled back, at most 1."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.back > 1.0:
            raise PathError(f'aggressive profile: back must be at most 1, got {self.back!r}')

    def law(self, length: float) -> PPoly:
        advances = (int(self.reversals) + 1) // 2 + 1
        step = length / advances
        over = step * self.back
        pieces = []
        for _ in range(advances - 1):
            pieces += _trapezoid(step + over, self.speed, self.acceleration)
            pieces += _trapezoid(-over, self.speed, self.acceleration)
        pieces += _trapezoid(step, self.speed, self.acceleration)
        return _chained(pieces)


PROFILES: dict[str, type[Profile]] = {
    'constant': Constant,
    'trapezoid': Trapezoid,
    's-curve': SCurve,
    'smooth': Smooth,
    'aggressive': Aggressive,
}


def named(name: str) -> Profile:
    """
    Return a profile with its default numbers.

    Parameters
    ----------
    name : str
        One of the keys of `PROFILES`.

    Raises
    ------
    PathError
        There is no such profile; the message lists those there are.

    """
    if name not in PROFILES:
        raise PathError(f'no profile is called {name!r}; there are ' + ', '.join(PROFILES))
    return PROFILES[name]()


def _trapezoid(
    distance: float, speed: float, acceleration: float
) -> list[tuple[float, float, float]]:
    """Return pieces from rest to rest over a signed distance."""
    peak = min(speed, float(np.sqrt(acceleration * abs(distance))))
    ramp, sign = peak / acceleration, float(np.sign(distance))
    cruise = abs(distance) / peak - ramp
    return [
        (ramp, sign * acceleration, 0.0),
        (cruise, 0.0, 0.0),
        (ramp, -sign * acceleration, 0.0),
    ]


def _chained(pieces: list[tuple[float, float, float]], speed: float = 0.0) -> PPoly:
    """Return s(t) from rest at 0 over pieces of duration, starting acceleration and jerk."""
    s, t, times, rows = 0.0, 0.0, [0.0], []
    for duration, acceleration, jerk in pieces:
        if duration <= 1e-12:
            continue
        rows.append([jerk / 6.0, 0.5 * acceleration, speed, s])
        s += duration * (speed + duration * (0.5 * acceleration + duration * jerk / 6.0))
        speed += duration * (acceleration + 0.5 * duration * jerk)
        t += duration
        times.append(t)
    return PPoly(np.array(rows).T, times)
