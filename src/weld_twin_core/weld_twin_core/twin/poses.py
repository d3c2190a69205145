# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Tool poses as a pair of arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..arm.rotation import rotation_matrix, transform
from ..arrays import Array

if TYPE_CHECKING:
    from ..effects.effect import View


class Poses(NamedTuple):
    """
    Tool poses in the world frame.

    Examples
    --------
    >>> import numpy as np
    >>> import weld_twin_core as wt
    >>> poses = wt.Poses(np.zeros((1, 3)), np.eye(3)[None])
    >>> poses.position.shape, poses.rotation.shape
    ((1, 3), (1, 3, 3))

    """

    position: Array
    """Shape (..., M, 3) [m]."""
    rotation: Array
    """``R_world_tool``, shape (..., M, 3, 3)."""

    @property
    def matrices(self) -> Array:
        """Return ``T_world_tool``, shape (..., M, 4, 4)."""
        return transform(self.rotation, self.position)

    def displaced(self, by: Array) -> Poses:
        """Return the poses shifted and turned about the world's axes, ``by`` (..., M, 6) [m, rad]."""
        return Poses(self.position + by[..., :3], rotation_matrix(by[..., 3:]) @ self.rotation)


def posed(view: View, chain: Poses | None = None) -> Poses:
    """Return the poses of a chain, left out the view's own, displaced on 'pose' channels."""
    if chain is None:
        chain = Poses(view.frames.position, view.frames.rotation)
    position, rotation = chain
    error = [view.shift.get(('pose', k)) for k in range(6)]
    if any(e is not None for e in error[:3]):
        position = position + _stack(error[:3])
    if any(e is not None for e in error[3:]):
        rotation = rotation_matrix(_stack(error[3:])) @ rotation
    return Poses(position, rotation)


def _stack(parts: list[Any]) -> Array:
    filled = [np.asarray(0.0 if part is None else part) for part in parts]
    return np.stack(np.broadcast_arrays(*filled), axis=-1)
