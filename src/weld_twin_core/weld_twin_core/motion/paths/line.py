# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A straight seam."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...arrays import Array, readonly
from ...errors import PathError
from .seam_path import Path, SeamFrames, frames_on, unit, up


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
            object.__setattr__(self, name, readonly(getattr(self, name), (3,), f'line {name}'))
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
