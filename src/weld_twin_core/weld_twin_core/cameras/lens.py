# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a lens makes of a point: a pinhole with radial and tangential distortion.

The model is Brown's [1]_ as ROS and OpenCV write it: ``plumb_bob`` (k1 k2 p1 p2 k3), and
``rational_polynomial`` with three more for the denominator (k4 k5 k6).

References
----------
.. [1] D. C. Brown, "Decentering distortion of lenses", Photogrammetric Engineering 32, 1966.

"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array, readonly
from ..errors import DataError

UNKNOWNS = 9
"""Numbers of a lens that may be off: fx fy cx cy [px] and k1 k2 p1 p2 k3."""
_NEAR = 1e-6
"""Depth [m] that counts as none; keeps a point in the plane of the lens from a division by zero."""
_ROUNDS = 20
"""Newton steps at the most from a pixel to its ray; four are enough for lenses of usual cameras."""
_SETTLED = 1e-12
"""Change of a ray at which its search ends."""
_SIZES = (0, 4, 5, 8)
"""Numbers of distortion that are understood; what is missing is zero."""


@dataclass(frozen=True, eq=False)
class Lens:
    """Intrinsics of a camera; DataError for focal lengths or coefficients that make no sense."""

    focal: Array
    centre: Array
    """fx and fy, shape (2,) [px]; cx and cy."""
    distortion: Array
    """k1 k2 p1 p2 k3 k4 k5 k6, in the order of OpenCV, shape (8,); fewer are filled with zeros."""

    def __post_init__(self) -> None:
        for name in ('focal', 'centre'):
            object.__setattr__(self, name, readonly(getattr(self, name), (2,), name))
        if not (self.focal > 0.0).all():
            raise DataError(f'focal lengths must be positive [px], got {self.focal.tolist()}')
        given = readonly(self.distortion, (None,), 'distortion')
        if given.size not in _SIZES:
            raise DataError(
                f'a lens has 0, 4, 5 or 8 numbers of distortion (k1 k2 p1 p2 k3 k4 k5 k6), '
                f'got {given.size}'
            )
        whole = np.pad(given, (0, 8 - given.size))
        object.__setattr__(self, 'distortion', readonly(whole, (8,), 'distortion'))

    def project(self, points: Array) -> Array:
        """Return where points (N, 3) [m], z ahead, x right, y down, appear, shape (N, 2) [px]."""
        points = np.asarray(points, dtype=float)
        return self._bent(points[:, :2] / _depth(points))[0] * self.focal + self.centre

    def derivatives(self, points: Array) -> tuple[Array, Array, Array]:
        """Return pixels (N, 2), and their change with points (N, 2, 3) and lens (N, 2, 9)."""
        depth = _depth(points)
        flat = points[:, :2] / depth
        bent, turn, own = self._bent(flat)
        by_flat = np.zeros((len(points), 2, 3))
        by_flat[:, 0, 0] = by_flat[:, 1, 1] = 1.0 / depth[:, 0]
        by_flat[:, :, 2] = -flat / depth
        by_lens = np.zeros((len(points), 2, UNKNOWNS))
        by_lens[:, 0, 0], by_lens[:, 1, 1] = bent.T
        by_lens[:, 0, 2] = by_lens[:, 1, 3] = 1.0
        by_lens[:, :, 4:] = self.focal[:, None] * own
        by_point = self.focal[:, None] * (turn @ by_flat)
        return bent * self.focal + self.centre, by_point, by_lens

    def rays(self, pixels: Array) -> Array:
        """Return where rays of pixels (N, 2) meet the plane one ahead, (N, 2), by Newton's way."""
        wanted = (np.asarray(pixels, dtype=float) - self.centre) / self.focal
        flat = wanted.copy()
        for _ in range(_ROUNDS):
            bent, turn, _ = self._bent(flat)
            step = np.linalg.solve(turn, (wanted - bent)[..., None])[..., 0]
            flat = flat + step
            if np.abs(step).max(initial=0.0) < _SETTLED:
                break
        return np.asarray(flat)

    def turned(self, size: Array, *, clockwise: bool) -> Lens:
        """
        Return the lens for images that were stored a quarter turn on.

        size: width and height of the image that it was calibrated with, shape (2,) [px].
        clockwise: which way the stored image has to be turned to become that one.
        """
        bent = self.distortion.copy()
        (wide, high), (x, y) = size, self.centre
        if clockwise:  # u = y, v = width - x
            bent[2:4] = -bent[3], bent[2]
            centre = np.array([y, wide - x])
        else:  # u = height - y, v = x
            bent[2:4] = bent[3], -bent[2]
            centre = np.array([high - y, x])
        return replace(self, focal=self.focal[::-1].copy(), centre=centre, distortion=bent)

    def moved(self, step: Array) -> Lens:
        """Return the lens after a step of its unknowns, shape (9,)."""
        bent = self.distortion.copy()
        bent[:5] += step[4:]
        return replace(
            self, focal=self.focal + step[:2], centre=self.centre + step[2:4], distortion=bent
        )

    def _bent(self, flat: Array) -> tuple[Array, Array, Array]:
        """Return the distorted (N, 2), its change with x and y (N, 2, 2), and with k and p."""
        x, y = flat.T
        k1, k2, p1, p2, k3, k4, k5, k6 = self.distortion
        s = x * x + y * y
        upper, lower = 1.0 + s * (k1 + s * (k2 + s * k3)), 1.0 + s * (k4 + s * (k5 + s * k6))
        rise = k1 + s * (2.0 * k2 + 3.0 * s * k3)
        fall = k4 + s * (2.0 * k5 + 3.0 * s * k6)
        radial = upper / lower
        slope = (rise - radial * fall) / lower
        ways, way = np.stack([x, y]), np.stack([x, y], axis=1)
        shift = np.stack(
            [2 * p1 * x * y + p2 * (s + 2 * x * x), p1 * (s + 2 * y * y) + 2 * p2 * x * y], axis=1
        )
        turn = 2.0 * slope[:, None, None] * way[:, :, None] * way[:, None, :]
        turn[:, 0, 0] += radial + 2 * p1 * y + 6 * p2 * x
        turn[:, 1, 1] += radial + 6 * p1 * y + 2 * p2 * x
        cross = 2 * p1 * x + 2 * p2 * y
        turn[:, 0, 1] += cross
        turn[:, 1, 0] += cross
        powers = np.stack([s, s * s, s**3]) / lower
        own = np.empty((len(flat), 2, 5))
        own[:, :, [0, 1, 4]] = (ways[:, None] * powers).transpose(2, 0, 1)
        own[:, 0, 2] = own[:, 1, 3] = 2.0 * x * y
        own[:, 1, 2], own[:, 0, 3] = s + 2.0 * y * y, s + 2.0 * x * x
        return flat * radial[:, None] + shift, turn, own


def _depth(points: Array) -> Array:
    """Return the depth of points, shape (N, 1) [m], never none."""
    z = points[:, 2:]
    return np.where(np.abs(z) < _NEAR, _NEAR, z)
