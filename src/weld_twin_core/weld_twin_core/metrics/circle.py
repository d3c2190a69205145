# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A circle through the points of a path, for circular tests like those of ISO 230-4."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array

_ROUND = 0.01
"""Part of the radius that a commanded circle may be off by: planners round off little more."""
_SECTORS = 36
"""Sectors of ten degrees, of which a full circle leaves none empty."""
_LEAST = 24
"""Points from which on a circle is looked for."""


@dataclass(frozen=True, eq=False)
class Circle:
    """A circle in space."""

    centre: Array
    """Shape (3,) [m]."""
    axes: Array
    """Unit vectors in its plane, shape (2, 3); angles count from the first to the second."""
    radius: float
    """[m]"""

    def angles(self, points: Array) -> Array:
        """Return the angle [rad] of every point, shape (N,)."""
        u, v = self.axes @ (points - self.centre).T
        return np.asarray(np.arctan2(v, u))

    def outwards(self, points: Array) -> Array:
        """Return the unit vector outwards at every point, shape (N, 3)."""
        angle = self.angles(points)
        return np.outer(np.cos(angle), self.axes[0]) + np.outer(np.sin(angle), self.axes[1])


def circle_of(points: Array) -> Circle | None:
    """
    Return the circle that points go round at least once, None where they go round none.

    Plane by principal directions, circle by Kasa's linear least squares [1]_.

    points: shape (N, 3) [m].

    References
    ----------
    .. [1] Kasa, I. (1976). A circle fitting procedure and its error analysis.

    """
    if len(points) < _LEAST:
        return None
    middle = points.mean(axis=0)
    _, _, directions = np.linalg.svd(points - middle, full_matrices=False)
    plane = directions[:2]
    flat = (points - middle) @ plane.T
    system = np.column_stack([2.0 * flat, np.ones(len(flat))])
    (x, y, rest), *_ = np.linalg.lstsq(system, (flat**2).sum(axis=1), rcond=None)
    radius = float(np.sqrt(max(rest + x * x + y * y, 0.0)))
    result = Circle(middle + np.array([x, y]) @ plane, plane, radius)
    off = np.linalg.norm(points - result.centre - radius * result.outwards(points), axis=1)
    sectors = np.unique(((result.angles(points) + np.pi) / (2 * np.pi) * _SECTORS).astype(int))
    if radius <= 0.0 or float(off.max()) > _ROUND * radius or sectors.size < _SECTORS:
        return None
    return result
