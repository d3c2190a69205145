# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A smooth seam through taught or imported points."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from ...arrays import Array, readonly
from ...errors import PathError
from .seam_path import Path, SeamFrames, frames_on, unit, up

_CELLS = 32
"""Pieces per span over which the arc length is integrated."""


@dataclass(frozen=True, eq=False)
class Spline(Path):
    """The cubic spline through points, in arc length."""

    points: Array
    """At least two, as taught or imported, shape (M, 3) [m]."""
    normal: Array = field(default_factory=up)
    """Out of the work, shape (3,) or (M, 3); one per point is interpolated."""

    def __post_init__(self) -> None:
        points = readonly(self.points, (None, 3), 'spline points')
        if len(points) < 2:
            raise PathError(f'a spline needs at least 2 points, got {len(points)}')
        chords = np.linalg.norm(np.diff(points, axis=0), axis=1)
        if (chords < 1e-9).any():
            k = int(np.argmin(chords))
            raise PathError(f'spline points {k} and {k + 1} are the same; drop one')
        knots = np.concatenate([[0.0], np.cumsum(chords)])
        curve = CubicSpline(knots, points)
        vars(self).update(points=points, _curve=curve, _parameter=_by_arc_length(curve, knots))
        if np.ndim(self.normal) == 1:
            vars(self).update(normal=unit(self.normal, 'spline normal'), _normal_curve=None)
        else:
            normals = readonly(self.normal, (knots.size, 3), 'spline normals')
            vars(self).update(normal=normals, _normal_curve=CubicSpline(knots, normals))

    @property
    def length(self) -> float:
        """Return the arc length [m]."""
        return float(self.__dict__['_parameter'].x[-1])

    @property
    def detail(self) -> float:
        """Return a few times the mean distance between points [m]."""
        return 6.0 * self.length / (len(self.points) - 1)

    def sample(self, s: Array) -> SeamFrames:
        """Return the seam at arc lengths s, shape (N,) [m]."""
        curve, parameter = self.__dict__['_curve'], self.__dict__['_parameter']
        u = parameter(np.asarray(s, dtype=np.float64))
        velocity = curve(u, 1)
        tangent = velocity / np.linalg.norm(velocity, axis=1, keepdims=True)
        varying = self.__dict__['_normal_curve']
        return frames_on(curve(u), tangent, self.normal if varying is None else varying(u))


def _by_arc_length(curve: CubicSpline, knots: Array) -> CubicHermiteSpline:
    """Return the curve's parameter as a function of arc length."""
    fraction = np.arange(_CELLS) / _CELLS
    grid = (knots[:-1, None] + np.diff(knots)[:, None] * fraction).ravel()
    grid = np.append(grid, knots[-1])
    nodes, weights = np.polynomial.legendre.leggauss(6)
    half, middle = 0.5 * np.diff(grid), 0.5 * (grid[1:] + grid[:-1])
    speeds = np.linalg.norm(curve(middle[:, None] + half[:, None] * nodes, 1), axis=-1)
    length = np.concatenate([[0.0], np.cumsum((speeds * weights).sum(axis=1) * half)])
    speed = np.linalg.norm(curve(grid, 1), axis=1)
    if speed.min() < 1e-6 * speed.max():
        raise PathError('the spline turns back on itself at a point; add points or drop that one')
    return CubicHermiteSpline(length, grid, 1.0 / speed)
