# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Seams of straight pieces: one alone, or several with rounded corners."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...arrays import Array, readonly
from ...errors import PathError
from .arc import Arc
from .seam_path import Path, SeamFrames, frames_on, positive, unit, up


@dataclass(frozen=True, eq=False)
class Line(Path):
    """A straight seam from ``start`` to ``end``."""

    start: Array
    end: Array
    """Shape (3,) [m]."""
    normal: Array = field(default_factory=up)
    """Out of the work, shape (3,); only the part perpendicular to the seam counts."""

    def __post_init__(self) -> None:
        for name in ('start', 'end'):
            vars(self)[name] = readonly(getattr(self, name), (3,), f'line {name}')
        object.__setattr__(self, 'normal', unit(self.normal, 'line normal'))
        if self.length < 1e-9:
            raise PathError('the line has no length: start and end are the same point')

    @property
    def length(self) -> float:
        """Return the distance from start to end [m]."""
        return float(np.linalg.norm(self.end - self.start))

    def sample(self, s: Array) -> SeamFrames:
        """Return the seam at arc lengths s, shape (N,) [m]."""
        direction = (self.end - self.start) / self.length
        position = self.start + np.asarray(s)[:, None] * direction
        return frames_on(position, np.broadcast_to(direction, position.shape), self.normal)


@dataclass(frozen=True, eq=False)
class Polyline(Path):
    """Straight pieces through points, each corner replaced by an arc of the blend radius."""

    points: Array
    """M at least 2, shape (M, 3) [m]; inner points are the corners."""
    blend: float = 0.005
    """Radius of the rounded corners [m]."""
    normal: Array = field(default_factory=up)
    """Out of the work, shape (3,)."""

    def __post_init__(self) -> None:
        points = readonly(self.points, (None, 3), 'polyline points')
        if len(points) < 2:
            raise PathError(f'a polyline needs at least 2 points, got {len(points)}')
        vars(self).update(points=points, blend=positive(self.blend, 'polyline blend'))
        pieces = _pieces(points, self.blend)
        ends = np.cumsum([piece.length for piece in pieces])
        normal = unit(self.normal, 'polyline normal')
        vars(self).update(normal=normal, _pieces=pieces, _ends=ends)

    @property
    def length(self) -> float:
        """Return the length of the rounded seam [m]."""
        return float(self.__dict__['_ends'][-1])

    @property
    def detail(self) -> float:
        """Return the radius of the rounded corners [m]."""
        return min(self.blend, self.length)

    def sample(self, s: Array) -> SeamFrames:
        """Return the seam at arc lengths s, shape (N,) [m]."""
        s = np.asarray(s, dtype=np.float64)
        ends, pieces = self.__dict__['_ends'], self.__dict__['_pieces']
        which = np.minimum(np.searchsorted(ends, s, side='right'), len(pieces) - 1)
        position, tangent = np.empty((2, s.size, 3))
        for k, piece in enumerate(pieces):
            here = which == k
            frames = piece.sample(s[here] - (ends[k] - piece.length))
            position[here], tangent[here] = frames.position, frames.tangent
        return frames_on(position, tangent, self.normal)


def _pieces(points: Array, blend: float) -> list[Path]:
    """Return lines and arcs in order."""
    steps = np.diff(points, axis=0)
    sizes = np.linalg.norm(steps, axis=1)
    if (sizes < 1e-9).any():
        k = int(np.argmin(sizes))
        raise PathError(f'polyline points {k} and {k + 1} are the same; drop one')
    directions = steps / sizes[:, None]
    cosines = np.clip((directions[:-1] * directions[1:]).sum(axis=1), -1.0, 1.0)
    if (cosines < -1.0 + 1e-9).any():
        k = int(np.argmin(cosines)) + 1
        raise PathError(f'the polyline turns straight back at point {k}; split it there')
    cuts = np.concatenate([[0.0], blend * np.tan(0.5 * np.arccos(cosines)), [0.0]])
    pieces: list[Path] = []
    for k, size in enumerate(sizes):
        room = size - cuts[k] - cuts[k + 1]
        if room < -1e-12:
            raise PathError(
                f'a blend radius of {blend:g} m does not fit between polyline points {k} and '
                f'{k + 1}, {size:g} m apart; take a smaller radius'
            )
        start = points[k] + cuts[k] * directions[k]
        end = points[k + 1] - cuts[k + 1] * directions[k]
        if room > 1e-9:
            pieces.append(_line(start, end))
        if cuts[k + 1] > 1e-9:
            pieces.append(_corner(points[k + 1], directions[k : k + 2], cuts[k + 1], blend))
    return pieces


def _line(start: Array, end: Array) -> Line:
    direction = end - start
    aside = np.eye(3)[int(np.argmin(np.abs(direction)))]
    return Line(start, end, aside)


def _corner(corner: Array, directions: Array, cut: float, blend: float) -> Arc:
    """Return the arc that leaves the first direction and joins the second."""
    inward = directions[1] - directions[0]
    inward = inward / np.linalg.norm(inward)
    middle = corner + (np.hypot(cut, blend) - blend) * inward
    return Arc(corner - cut * directions[0], middle, corner + cut * directions[1])
