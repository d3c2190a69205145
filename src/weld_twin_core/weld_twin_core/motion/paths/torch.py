# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How the torch stands on the seam.

The tool's z is the wire and points to the work. With all angles zero the wire runs against the
work normal, the tool's x points along the travel and its y to the right of it. From there the
torch is turned about its own axes: by ``work`` about x (it leans to the side), by ``travel``
about y (positive: the wire points forward, *push*; negative: *drag*), by ``rotation`` about the
wire. Work and travel angle are counted from the perpendicular.

References
----------
.. [1] AWS A3.0M, Standard Welding Terms and Definitions: work angle, travel angle.

"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...arm.rotation import rotation_matrix, transform
from ...arrays import Array, refuse_unknown
from ...errors import PathError
from .seams import SeamFrames

HEADINGS = ('fixed', 'seam')


@dataclass(frozen=True)
class Torch:
    """Torch angles along a seam."""

    work: float = 0.0
    travel: float = 0.0
    rotation: float = 0.0
    """[rad]"""
    heading: str = 'fixed'
    """'fixed': the torch turns about the wire no more than it must, as the wire does not care;
    'seam': the tool's x follows the travel."""

    def __post_init__(self) -> None:
        if self.heading not in HEADINGS:
            raise PathError(
                f'torch heading must be one of {", ".join(HEADINGS)}, got {self.heading!r}'
            )
        for name in ('work', 'travel', 'rotation'):
            value = getattr(self, name)
            if not (isinstance(value, (int, float)) and abs(value) <= 2.0 * np.pi):
                raise PathError(f'torch {name} must be an angle in radians, got {value!r}')

    def poses(self, frames: SeamFrames, first: SeamFrames | None = None) -> Array:
        """Return tool poses (N, 4, 4); a fixed heading refers to the first frame, or ``frames[0]``."""
        tilted = self._tilted(frames)
        if self.heading == 'fixed':
            start = frames if first is None else first
            reference = self._tilted(SeamFrames(*(field[:1] for field in start)))[0, :, 0]
            tilted = _headed(tilted[..., 2], reference)
        turned = tilted @ rotation_matrix([0.0, 0.0, self.rotation])
        return transform(turned, frames.position)

    def _tilted(self, frames: SeamFrames) -> Array:
        upright = np.stack([frames.tangent, -frames.across, -frames.normal], axis=-1)
        lean = rotation_matrix([self.work, 0.0, 0.0]) @ rotation_matrix([0.0, self.travel, 0.0])
        return upright @ lean

    @classmethod
    def from_mapping(cls, data: Mapping[str, Any]) -> Torch:
        """Build a torch from a mapping of its attributes; PathError where one is wrong."""
        if not isinstance(data, Mapping):
            raise PathError(f"'torch' must be a mapping of keys, got {type(data).__name__}")
        refuse_unknown(data, cls.__dataclass_fields__, 'torch', PathError)
        return cls(**data)


def _headed(wire: Array, reference: Array) -> Array:
    """Return rotations with z along the wire and x as near the reference as that allows."""
    x = reference - (wire @ reference)[:, None] * wire
    size = np.linalg.norm(x, axis=1, keepdims=True)
    if (size < 1e-3).any():
        raise PathError(
            'the wire turns into the direction the torch heads for; '
            "use heading 'seam' or split the seam"
        )
    x = x / size
    return np.stack([x, np.cross(wire, x), wire], axis=-1)
