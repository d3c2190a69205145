# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Circular seams: an arc through three points, and a circle about an axis."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...arrays import Array, readonly
from ...errors import PathError
from .seam_path import Path, SeamFrames, frames_on, positive, unit, up


@dataclass(frozen=True, eq=False)
class Arc(Path):
    """The circular arc from ``start`` through ``middle`` to ``end``."""

    start: Array
    middle: Array
    end: Array
    """Shape (3,) [m]."""
    normal: Array | None = None
    """Out of the work, shape (3,); left out, the normal of the arc's plane that looks up (or, for
    a plane that is upright, the one about which the arc turns left)."""

    def __post_init__(self) -> None:
        for name in ('start', 'middle', 'end'):
            vars(self)[name] = readonly(getattr(self, name), (3,), f'arc {name}')
        first, second = self.middle - self.start, self.end - self.start
        plane = np.cross(first, second)
        area = float(np.linalg.norm(plane))
        if area < 1e-9 * float(first @ first + second @ second) or area == 0.0:
            raise PathError('the three points of the arc lie on a line; use a line')
        # Circumcentre of the triangle.
        centre = self.start + np.cross(
            (second @ second) * first - (first @ first) * second, plane
        ) / (-2.0 * area**2)
        axis = plane / area
        normal = axis * (-1.0 if axis[2] < -1e-9 else 1.0) if self.normal is None else self.normal
        circle = _Circle.about(centre, axis, self.start)
        vars(self).update(_circle=circle, normal=unit(normal, 'arc normal'))

    @property
    def radius(self) -> float:
        """Return the radius [m]."""
        return self._arc.radius

    @property
    def centre(self) -> Array:
        """Return the centre, shape (3,) [m]."""
        return self._arc.centre

    @property
    def _arc(self) -> _Circle:
        return self.__dict__['_circle']  # type: ignore[no-any-return]

    @property
    def length(self) -> float:
        """Return the length of the arc [m]."""
        return self._arc.angle_of(self.end) * self.radius

    @property
    def middle_share(self) -> float:
        """Return at which share of its length the arc passes ``middle``."""
        return self._arc.angle_of(self.middle) / self._arc.angle_of(self.end)

    def sample(self, s: Array) -> SeamFrames:
        """Return the seam at arc lengths s, shape (N,) [m]."""
        position, tangent = self._arc.at(s)
        return frames_on(position, tangent, np.asarray(self.normal))


@dataclass(frozen=True, eq=False)
class Circle(Path):
    """A circular seam about an axis, as round a pipe stub."""

    centre: Array
    """Shape (3,) [m]."""
    radius: float
    """[m]"""
    axis: Array = field(default_factory=up)
    """The travel turns left about it, shape (3,)."""
    start: Array | None = None
    """Direction from the centre to where the seam begins, shape (3,); left out, along world x as
    far as the axis lets it."""
    turns: float = 1.0
    """How much of a turn; more than 1 overlaps."""
    normal: Array | None = None
    """Out of the work, shape (3,); left out, the axis."""

    def __post_init__(self) -> None:
        axis = unit(self.axis, 'circle axis')
        vars(self).update(centre=readonly(self.centre, (3,), 'circle centre'), axis=axis)
        for name in ('radius', 'turns'):
            vars(self)[name] = positive(getattr(self, name), f'circle {name}')
        aside = np.eye(3)[0 if abs(axis[0]) < 0.9 else 1] if self.start is None else self.start
        aside = np.asarray(aside, dtype=np.float64)
        start = unit(aside - (aside @ axis) * axis, 'circle start across the axis')
        circle = _Circle.about(self.centre, axis, self.centre + self.radius * start)
        normal = axis if self.normal is None else unit(self.normal, 'circle normal')
        vars(self).update(_circle=circle, normal=normal)

    @property
    def length(self) -> float:
        """Return the length of the seam [m]."""
        return 2.0 * np.pi * self.turns * self.radius

    def sample(self, s: Array) -> SeamFrames:
        """Return the seam at arc lengths s, shape (N,) [m]."""
        position, tangent = self.__dict__['_circle'].at(s)
        return frames_on(position, tangent, np.asarray(self.normal))


@dataclass(frozen=True, eq=False)
class _Circle:
    """A circle: its centre, radius and the directions to the start and along the travel."""

    centre: Array
    radius: float
    out: Array
    along: Array

    @classmethod
    def about(cls, centre: Array, axis: Array, start: Array) -> _Circle:
        """Return the circle through a start about a centre and, by the right hand, a unit axis."""
        radius = float(np.linalg.norm(start - centre))
        out = (start - centre) / radius
        return cls(centre, radius, out, np.cross(axis, out))

    def angle_of(self, point: Array) -> float:
        """Return the angle from the start to a point on the circle, in [0, 2 pi)."""
        beam = point - self.centre
        return float(np.arctan2(beam @ self.along, beam @ self.out) % (2.0 * np.pi))

    def at(self, s: Array) -> tuple[Array, Array]:
        """Return position and tangent, shape (N, 3)."""
        angle = np.asarray(s)[:, None] / self.radius
        cosine, sine = np.cos(angle), np.sin(angle)
        position = self.centre + self.radius * (cosine * self.out + sine * self.along)
        return position, cosine * self.along - sine * self.out
