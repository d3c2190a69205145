# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Length and directions of a seam given by sampled positions.

Seam axes are along (the direction of travel), across (to the left of it, seen with the normal
pointing at the viewer) and normal (out of the plate, the side of the torch).
"""

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, readonly
from ..errors import DataError

_STILL = 1e-9
"""Below this distance [m] two positions are the same."""


def path_length(position: ArrayLike) -> float:
    """Return the length [m] of the polyline through positions, shape (N, 3)."""
    points = readonly(position, (None, 3), 'path positions')
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


def path_tangents(position: ArrayLike) -> Array:
    """
    Return unit directions of travel, shape (N, 3), of positions, shape (N, 3) [m].

    The chord between the neighbours of each sample; at rest, the last direction of travel (at a
    rest before the start, the first). Raises DataError: the positions do not move.
    """
    points = readonly(position, (None, 3), 'path positions')
    index = np.arange(len(points))
    after, before = np.minimum(index + 1, len(points) - 1), np.maximum(index - 1, 0)
    chord = points[after] - points[before]
    length = np.linalg.norm(chord, axis=1)
    moving = np.flatnonzero(length > _STILL)
    if moving.size == 0:
        raise DataError('the path does not move, so it has no direction; give the seam tangent')
    latest = moving[np.maximum(np.searchsorted(moving, index, side='right') - 1, 0)]
    tangents: Array = chord[latest] / length[latest, None]
    return tangents


def seam_axes(tangent: ArrayLike, normal: ArrayLike) -> Array:
    """Return rows along, across, normal made square, shape (..., 3, 3); DataError for none."""
    along, normal = np.broadcast_arrays(
        np.asarray(tangent, dtype=np.float64), np.asarray(normal, dtype=np.float64)
    )
    along = _unit(along, 'the seam tangent is zero; give a direction')
    out = normal - (normal * along).sum(axis=-1, keepdims=True) * along
    relative = np.linalg.norm(normal, axis=-1, keepdims=True)
    out = np.where(np.linalg.norm(out, axis=-1, keepdims=True) < _STILL * relative, 0.0, out)
    out = _unit(out, 'the seam normal lies along the seam; give one that points away from it')
    return np.stack([along, np.cross(out, along), out], axis=-2)


def seam_components(deviation: ArrayLike, tangent: ArrayLike, normal: ArrayLike) -> Array:
    """Return deviations (..., 3) [m] of the world as components along `seam_axes`."""
    vector = np.asarray(deviation, dtype=np.float64)
    components: Array = (seam_axes(tangent, normal) @ vector[..., None])[..., 0]
    return components


def _unit(vector: Array, message: str) -> Array:
    length = np.linalg.norm(vector, axis=-1, keepdims=True)
    if not (length > 0.0).all():
        raise DataError(message)
    unit: Array = vector / length
    return unit
