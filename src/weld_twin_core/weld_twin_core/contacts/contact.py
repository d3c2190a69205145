# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One thing that is touched, and what is known between two of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import DataError

KINDS = ('point', 'length', 'sphere', 'line', 'plane')
"""What a contact can be; how each is seen is in `surfaces`."""
LOOSE = 1e-4
"""Uncertainty [m, rad] of a length or angle without one, as of a calliper or a straight edge."""
_FACE = 0.1
"""Length [m] over which the uncertainty of a known place turns a face or an edge: that of a block."""


@dataclass(frozen=True)
class Contact:
    """One thing that the tool point touches; DataError for no such kind, or half a place."""

    label: str
    kind: str = 'point'
    """'point', 'length' (distance from a centre), 'sphere', 'line' or 'plane'."""
    radius: float | None = None
    """Of a sphere, from its centre to the tool point [m]; unknown when left out."""
    at: tuple[float, float, float] | None = None
    """Where it is, in the frame that the base stands in: the point, the centre, or a point of the
    face or the edge [m]. Not known when left out."""
    axis: tuple[float, float, float] | None = None
    """Normal of a plane or direction of a line that is known."""
    sigma: float = LOOSE
    """Uncertainty of a known place [m]."""

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise DataError(
                f'contact {self.label!r} is of kind {self.kind!r}; a kind is one of '
                + ', '.join(KINDS)
            )
        turned = self.kind in ('plane', 'line')
        if (self.axis is not None) != (turned and self.at is not None):
            need = 'at and axis' if turned else 'at alone'
            raise DataError(f'contact {self.label!r}: a {self.kind} that is known has {need}')
        if self.axis is not None and not np.linalg.norm(self.axis) > 0.0:
            raise DataError(f'contact {self.label!r}: its axis has no direction')
        if not self.sigma > 0.0:
            raise DataError(f'contact {self.label!r}: sigma must be a positive number [m]')

    def as_mapping(self) -> dict[str, Any]:
        """Return what an artefact file says of it."""
        out: dict[str, Any] = {'kind': self.kind}
        if self.radius is not None:
            out['radius'] = self.radius
        if self.at is not None:
            out |= {'at': list(self.at), 'sigma': self.sigma}
        if self.axis is not None:
            out['axis'] = list(self.axis)
        return out

    @property
    def known(self) -> bool:
        """Return whether its place is known."""
        return self.at is not None

    @property
    def sigma_turn(self) -> float:
        """Return the uncertainty [rad] of a known axis."""
        return self.sigma / _FACE


@dataclass(frozen=True)
class Tie:
    """What is known between two contacts."""

    between: tuple[str, str]
    """Two labels."""
    value: float
    sigma: float = LOOSE
    """Distance [m] of points, centres or parallel planes, or angle of planes [rad]; its uncertainty."""
    kind: str = 'distance'
    """'distance' or 'angle'."""
