# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The controller's own base and flange on a robot whose rows begin and end elsewhere.

Denavit-Hartenberg rows begin on the first axis and end on the last one, wherever a URDF has its
base link and its flange: an axis `0 0 -1` turns the base of the rows over, and the end of the rows
slides along the last axis. The numbers of a controller mean the links.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..arrays import Array, readonly, refuse_unknown
from ..errors import DataError
from .rotation import matrix_from_quaternion, quaternion_from_matrix, transform

_KEYS = {'base', 'flange', 'foot', 'base_link', 'flange_link'}


@dataclass(frozen=True, eq=False)
class ControllerFrames:
    """Where a controller has its base and flange; DataError where a frame is none."""

    base: Array = field(default_factory=lambda: np.eye(4))
    """The controller's base, which programs count from, in that of the rows, shape (4, 4) [m]."""
    flange: Array = field(default_factory=lambda: np.eye(4))
    """The controller's flange in the frame at the end of the last row, shape (4, 4) [m]."""
    foot: Array | None = None
    """The link that the arm stands in, in the base frame of the rows: deviations, wrenches and
    places of the base speak of it, shape (4, 4) [m]. Left out, it is the controller's base; they
    differ for arms as Universal Robots', whose `base` is turned against `base_link`."""
    base_link: str = ''
    flange_link: str = ''
    """What a URDF calls them; empty where there is none."""

    def __post_init__(self) -> None:
        for key in ('base', 'flange', 'foot'):
            given = self.base if key == 'foot' and self.foot is None else getattr(self, key)
            frame = readonly(given, (4, 4), f'{key} of the controller')
            object.__setattr__(self, key, frame)

    @classmethod
    def from_mapping(cls, data: Mapping[str, Any]) -> ControllerFrames:
        """Build the frames from a robot file's mapping; DataError for an unknown key."""
        refuse_unknown(data, sorted(_KEYS), 'controller', DataError)
        return cls(
            frame_of(data.get('base'), 'controller base'),
            frame_of(data.get('flange'), 'controller flange'),
            frame_of(data['foot'], 'controller foot') if 'foot' in data else None,
            str(data.get('base_link', '')),
            str(data.get('flange_link', '')),
        )

    def to_mapping(self) -> dict[str, Any]:
        """Return the mapping that `from_mapping` reads."""
        assert self.foot is not None
        names = {'base_link': self.base_link, 'flange_link': self.flange_link}
        return {
            'base': pose_mapping(self.base),
            'flange': pose_mapping(self.flange),
            'foot': pose_mapping(self.foot),
            **{key: name for key, name in names.items() if name},
        }


def frame_of(value: Any, name: str) -> Array:
    """Return the frame (4, 4) of ``xyz`` [m] and ``quat_xyzw``, of None the identity; else DataError."""
    if value is None:
        return np.eye(4)
    position = readonly(value.get('xyz', (0.0, 0.0, 0.0)), (3,), f'{name} xyz')
    quaternion = value.get('quat_xyzw', (0.0, 0.0, 0.0, 1.0))
    return transform(matrix_from_quaternion(quaternion, f'{name} quat_xyzw'), position)


def pose_mapping(matrix: Array) -> dict[str, list[float]]:
    """Return the mapping that `frame_of` reads, of a frame (4, 4) [m]."""
    return {
        'xyz': matrix[:3, 3].tolist(),
        'quat_xyzw': quaternion_from_matrix(matrix[:3, :3]).tolist(),
    }
