# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What no parameter explains, where it was recorded and beyond."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, readonly

_ELSEWHERE = 2.0
"""A model is off by so many times as much as its own account where nothing was recorded, for its account
is of the causes that it has: on two arms under a tracker, and on sealed cases, by 1.0 to 3.0."""


class Where(NamedTuple):
    """Where samples of a motion are, as far as a discrepancy asks."""

    q: Array
    """Shape (M, n) [rad or m]."""
    levers: Array
    """d pose / d joint, shape (n, 6, M)."""
    beyond: Array
    """How far every joint is from where it was recorded, shape (M, n)."""
    margins: Array
    """How far it may be and still counts as recorded there, shape (n,)."""
    unlike: NDArray[np.bool_]
    """What else was not recorded, as `Domain.unlike` has it, shape (M,)."""
    turned: NDArray[np.bool_]
    """Joints that have just turned around, shape (M, n)."""
    shaken: Array
    """How hard joints were accelerated just before, shape (M, n) [rad/s^2 or m/s^2]."""


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """What no parameter explains."""

    position: float
    """Standard deviation per axis of what is left over at the tool, alike everywhere [m]."""
    orientation: float
    """The same about each axis [rad]."""
    gears: Array
    """What is left over in every joint where it was recorded, shape (n,) [rad or m]; it reaches
    the tool by the joint's lever."""
    curves: Array
    """How far every joint may be off its reading, on top of that, where it was never seen: gear
    errors too fine to be carried over, shape (n,) [rad or m]."""
    reach: float
    """Distance beyond what was recorded at which a curve counts in full [rad or m]."""
    turns: Array | None = None
    """How far every joint may be off, on top of that, where it has just turned around: laws of
    lost motion differ there alone, shape (n,) [rad or m]. None for nothing."""
    peaks: Array = field(default_factory=lambda: np.zeros(0))
    """By how much each stretch of the recordings was off at its worst, beyond what chance makes of
    what is usually left there, shape (K,) [m]: a tool strays farther than a normal law has it."""
    jumps: float = 0.0
    """How many jumps of the model's laws the recordings showed: so well their places are known."""
    swings: float = 0.0
    """How far every joint may be off where it was just accelerated, for its acceleration [s^2]: arms
    swing on springs that no law of the model has."""

    def __post_init__(self) -> None:
        if self.turns is None:
            vars(self).update(turns=np.zeros_like(self.gears))
        for name in ('gears', 'curves', 'turns', 'peaks'):
            vars(self)[name] = readonly(getattr(self, name), (None,), name)

    def covariance(self, here: Where) -> Array:
        """Return its part of the covariance where it was recorded, shape (M, 6, 6)."""
        each = np.hypot(self.joints(here), self.swung(here))
        moved = here.levers * each[:, None]
        out = np.einsum('nim,njm->mij', moved, moved)
        out[:, np.arange(6), np.arange(6)] += np.repeat([self.position, self.orientation], 3) ** 2
        return np.asarray(out)

    def joints(self, here: Where) -> Array:
        """Return the standard deviation in every joint, shape (n, M) [rad or m]."""
        assert self.turns is not None
        beyond = np.minimum(here.beyond.T / self.reach, 1.0)
        parts = self.gears[:, None], self.curves[:, None] * beyond, (here.turned * self.turns).T
        return np.asarray(np.sqrt(sum(part**2 for part in parts)))

    def swung(self, here: Where) -> Array:
        """Return the standard deviation of what swings in every joint, shape (n, M) [rad or m]."""
        return np.asarray(self.swings * here.shaken.T)

    def grown(self, here: Where) -> Array:
        """Return how many times as large all is, up to `_ELSEWHERE` where nothing was recorded, (M,)."""
        outside = (here.beyond - here.margins).max(axis=1, initial=0.0)
        apart = np.maximum(np.minimum(outside / self.reach, 1.0), here.unlike)
        return np.asarray(1.0 + (_ELSEWHERE - 1.0) * apart)
