# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What may differ between the models that recordings allow, and what each of it does to a pose."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..arrays import Array, readonly
from ..effects.effect import Effect
from .features import Features

_AXES = ('x', 'y', 'z', 'turn_x', 'turn_y', 'turn_z')
CURVE = 'curve of '
"""How the names of a curve's heights begin."""
GIVE = 'give of '
"""How the names of what a joint gives when it is accelerated begin."""


@dataclass(frozen=True, eq=False)
class Directions:
    """What may differ between the models that the recordings allow."""

    frames: tuple[str, ...]
    """Those of 'base' and 'tool' that were fitted, six coordinates each, a base for every set-up."""
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
