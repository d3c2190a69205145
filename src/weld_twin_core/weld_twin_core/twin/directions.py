# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What may differ between the models that recordings allow, and what no parameter explains."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array, readonly
from ..effects.effect import Effect
from .features import Features

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


_AXES = ('x', 'y', 'z', 'turn_x', 'turn_y', 'turn_z')
CURVE = 'curve of '
"""How the names of a curve's heights begin."""
GIVE = 'give of '
"""How the names of what a joint gives when it is accelerated begin."""


@dataclass(frozen=True, eq=False)
class Directions:
    """What may differ between the models that the recordings allow."""

    frames: tuple[str, ...]
    """Those of 'base' and 'tool' that were fitted, six coordinates each, a base for every set-up: places
    that were touched share one."""
    setups: int
    """Number of base frames."""
    effects: tuple[Effect, ...]
    """Each with all its fit coordinates, as instances at which derivatives are taken."""
    knots: tuple[Array, ...] = ()
    """For every joint, where the heights of a curve of its own angle are coordinates: straight
    lines between, nothing beyond [rad or m]. Evenly spaced; none for no curve."""
    gives: int = 0
    """Joints, counted from the base, of which it is a coordinate how far each stays behind for its own
    acceleration [s^2]: a spring in the drive holds the inertia of all that it moves. All or none."""

    def __post_init__(self) -> None:
        knots = tuple(readonly(k, (None,), 'knots') for k in self.knots)
        object.__setattr__(self, 'knots', knots)

    @property
    def frame_count(self) -> int:
        """Return the number of frame coordinates."""
        return 6 * (('base' in self.frames) * self.setups + ('tool' in self.frames))

    @cached_property
    def sizes(self) -> tuple[int, ...]:
        """Return the number of coordinates of every effect."""
        return tuple(effect.fit.coordinates().size for effect in self.effects)

    @property
    def own(self) -> list[slice]:
        """Return where the coordinates of every effect are, behind those of the frames."""
        ends = self.frame_count + np.cumsum(self.sizes, dtype=int)
        return [slice(end - size, end) for end, size in zip(ends, self.sizes, strict=True)]

    @property
    def count(self) -> int:
        """Return the number of coordinates."""
        return self.frame_count + sum(self.sizes) + self.shapes

    @property
    def shapes(self) -> int:
        """Return the number of coordinates that are no effect's: gives, then heights of curves."""
        return self.gives + sum(k.size for k in self.knots)

    def names(self) -> list[str]:
        """Return the coordinates' names, alike in every diagnosis: 'joint_offset elbow_joint 0'."""
        out = []
        if 'base' in self.frames:
            out += [f'base {k}.{axis}' for k in range(self.setups) for axis in _AXES]
        if 'tool' in self.frames:
            out += [f'tool.{axis}' for axis in _AXES]
        for effect, size in zip(self.effects, self.sizes, strict=True):
            where = f' {effect.site}' if effect.site else ''
            # Two couplings of one joint differ in the joint that they come from.
            source = effect.to_mapping().get('source')
            where += f'<{source}' if source else ''
            parts: list[str] = [str(k) for k in range(size)]
            if effect.traits.waves is not None:
                parts = [f'{n:g} {of}' for n in effect.search.orders() for of in ('sin', 'cos')]
            out += [f'{effect.name}{where} {part}' for part in parts]
        out += [f'{GIVE}joint {joint + 1}' for joint in range(self.gives)]
        for joint, knots in enumerate(self.knots):
            step = f' by {knots[1] - knots[0]:g}' if knots.size > 1 else ''
            out += [f'{CURVE}joint {joint + 1} at {place:.3f}{step}' for place in knots]
        return out

    def fitted(self) -> Array:
        """Return the coordinates of the fitted model; those of no effect are zero."""
        own = [effect.fit.coordinates() for effect in self.effects]
        return np.concatenate([np.zeros(self.frame_count), *own, np.zeros(self.shapes)])

    def columns(self, features: Features, setup: int) -> Array:
        """Return d pose / d coordinate (P, 6, M) [m, rad]; zero where the recording shows none."""
        out = np.zeros((self.count, 6, features.at.size))
        at = 0
        if 'base' in self.frames:
            for k in range(6):
                out[6 * setup + k] = features.column(('base', k))
            at += 6 * self.setups
        if 'tool' in self.frames:
            for k in range(6):
                out[at + k] = features.column(('tool', k))
        for effect, here in zip(self.effects, self.own, strict=True):
            if effect.applicable(features.view, effect.site) is None:
                out[here] = features.columns(effect, atoms=False)
        at = self.frame_count + sum(self.sizes)
        for joint in range(self.gives):
            out[at + joint] = -features.acceleration[:, joint] * features.column(('q', joint))
        at += self.gives
        for joint, knots in enumerate(self.knots):
            if knots.size:
                hats = _hats(features.run.view.joint(joint), knots)
                out[at : at + knots.size] = hats[:, None] * features.column(('q', joint))
            at += knots.size
        return out


def _hats(q: Array, knots: Array) -> Array:
    """Return the straight-line interpolation from heights at knots, shape (K, M)."""
    width = knots[1] - knots[0] if knots.size > 1 else 1.0
    return np.asarray(np.maximum(0.0, 1.0 - np.abs(q - knots[:, None]) / max(width, 1e-9)))
