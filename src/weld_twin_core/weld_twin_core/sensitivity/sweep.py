# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Sweeps of one error, and the paper's scenarios (IV.ii to IV.vi): each source, and all together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Array
from ..effects.backlash import Backlash
from ..effects.geometry import BasePose, JointOffset, LinkLength
from .evaluate import exact_deviations
from .seam_study import Study
from .tolerance import Tolerance

DEGREE = np.pi / 180.0
"""Radians."""
_RANGES: dict[str, tuple[float, float]] = {
    'joint_offset': (0.01 * DEGREE, 0.5 * DEGREE),
    'link_length': (0.0, 0.5e-3),
    'link_twist': (0.01 * DEGREE, 0.5 * DEGREE),
    'backlash': (0.0, 0.1 * DEGREE),
    'base_pose': (0.0, 1e-3),
}
"""First and last size swept; those of offsets and lengths are the paper's (III.v)."""
_BENT = 0.01
"""Departure from proportion that counts as the end of linearity."""


@dataclass(frozen=True, eq=False)
class Sweep:
    """The deviation over the size of one error."""

    name: str
    unit: str
    values: Array
    """Shape (K,) [unit]."""
    max_m: Array
    mean_m: Array
    """Shape (K,) [m]."""
    linear_m: Array
    """Largest deviation if it were proportional, from the slope at no error, shape (K,) [m]."""
    length: float
    """[m]"""

    @property
    def departure(self) -> Array:
        """Return how far D is above proportion, as a part of it, shape (K,); negative below."""
        safe = np.where(self.linear_m > 0.0, self.linear_m, 1.0)
        return np.where(self.linear_m > 0.0, self.max_m / safe - 1.0, 0.0)

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers and lists."""
        columns = {
            'values': self.values,
            'd_norm': self.max_m / self.length,
            **{key: getattr(self, key) for key in ('max_m', 'mean_m', 'departure')},
        }
        numbers = {key: column.tolist() for key, column in columns.items()}
        return {'name': self.name, 'unit': self.unit, **numbers}


def sweep(study: Study, tolerance: Tolerance, values: Array) -> Sweep:
    """
    Return the deviation over the size of one error.

    Parameters
    ----------
    study : Study
    tolerance : Tolerance
        Says which parameter of which effect.
    values : array, shape (V,)
        Sizes of the error, in the unit of the parameter.

    """
    return together(study, (tolerance,), values, tolerance.name)


def together(study: Study, tolerances: Sequence[Tolerance], values: Array, name: str) -> Sweep:
    """Return the deviation over the size, (V,) in their unit, of several errors that are all equal."""
    # The slope at no error, from an error too small to bend and large enough to compute.
    small = 1e-4 * float(np.abs(values).max())
    sizes = np.concatenate([[small], np.asarray(values, dtype=np.float64)])
    draws = np.repeat(sizes[:, None], len(tolerances), axis=1)
    distance = np.linalg.norm(exact_deviations(study, tolerances, draws), axis=-1)
    largest = distance.max(axis=-1)
    return Sweep(
        name,
        tolerances[0].unit,
        sizes[1:],
        largest[1:],
        distance[1:].mean(axis=-1),
        largest[0] / small * np.abs(sizes[1:]),
        study.length,
    )


def default_values(tolerance: Tolerance, count: int = 25) -> Array:
    """
    Return the sizes swept for an error: the paper's range, or up to three times typical.

    Parameters
    ----------
    tolerance : Tolerance
    count : int
        How many sizes, evenly spread.

    """
    last = 3.0 * (abs(tolerance.distribution.mean) + tolerance.distribution.std)
    ends = _RANGES.get(tolerance.effect, (0.0, last))
    if tolerance.effect == 'base_pose' and tolerance.parameter == 'rotvec':
        ends = _RANGES['joint_offset']
    return np.linspace(*ends, count)


def end_of_linearity(study: Study, tolerance: Tolerance, largest: float = 1.0) -> float | None:
    """Return the smallest error at which D departs from proportion by `_BENT`; None for none."""
    result = sweep(study, tolerance, np.geomspace(1e-3 * largest, largest, 121))
    bent = np.abs(result.departure) > _BENT
    return float(result.values[np.argmax(bent)]) if bent.any() else None


@dataclass(frozen=True)
class Sizes:
    """Errors of the scenarios; the same on every joint."""

    offset: float = 0.05 * DEGREE
    """[rad]"""
    length: float = 1e-4
    """[m]"""
    initial: float = 5e-4
    """Size of the initialization offset, along the diagonal of the world frame [m]."""
    width: float = 0.03 * DEGREE
    """[rad]"""


def scenario_deviations(study: Study, sizes: Sizes | None = None) -> dict[str, Array]:
    """Return the deviations (N, 3) [m] of every source alone and of all ('combined'), in seam axes."""
    size = sizes or Sizes()
    joints = study.robot.joint_names
    each = {
        'angular': tuple(JointOffset(joint, size.offset) for joint in joints),
        'link length': tuple(LinkLength(joint, size.length) for joint in joints),
        'initialization': (BasePose(xyz=np.full(3, size.initial / np.sqrt(3.0))),),
        'backlash': tuple(Backlash(joint, size.width) for joint in joints),
    }
    out = {name: study.deviations((*study.known, *effects)) for name, effects in each.items()}
    every = tuple(effect for effects in each.values() for effect in effects)
    return {**out, 'combined': study.deviations((*study.known, *every))}


def spread_of_passes(study: Study, deviations: Array) -> Array:
    """
    Return how far apart the passes of deviations (..., N, 3) over one place of the seam are, (...) [m].

    The median over twentieths of the seam.
    """
    part = np.floor(study.s / study.length * 20.0).astype(int)
    apart = [
        np.linalg.norm(np.ptp(deviations[..., part == k, :], axis=-2), axis=-1)
        for k in np.unique(part)
    ]
    return np.asarray(np.median(apart, axis=0))


def cumulative(deviations: Array) -> Array:
    """Return D_cum of deviations (N, 3) up to every sample (paper, eq. III.iv), shape (N,) [m]."""
    return np.cumsum(np.linalg.norm(deviations, axis=-1))
