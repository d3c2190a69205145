# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What every seam has: a length, and position, tangent and work normal at any arc length."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array, readonly
from ...errors import PathError


class SeamFrames(NamedTuple):
    """
    The seam at some arc lengths, in the world frame; every field is (N, 3).

    ``tangent`` points along the travel and ``normal`` out of the work, both of length 1 and
    perpendicular to each other.
    """

    position: Array
    tangent: Array
    normal: Array

    @property
    def across(self) -> Array:
        """Return the direction across the seam, normal x tangent, to the left of the travel."""
        return np.cross(self.normal, self.tangent)


class Path(ABC):
    """A seam, sampled by arc length."""

    @property
    @abstractmethod
    def length(self) -> float:
        """Return the length of the seam [m]."""

    @property
    def detail(self) -> float:
        """Return the length [m] over which the seam bends; samples must be closer than that."""
        return self.length

    @abstractmethod
    def sample(self, s: Array) -> SeamFrames:
        """Return the seam at arc lengths s, shape (N,) [m]."""


def up() -> Array:
    """Return the world's z, the work normal of a seam in the flat position."""
    return np.array([0.0, 0.0, 1.0])


def unit(vector: ArrayLike, name: str) -> Array:
    """Return a vector of length 1, shape (3,); PathError where it has none."""
    value = readonly(vector, (3,), name)
    size = float(np.linalg.norm(value))
    if size < 1e-12:
        raise PathError(f'{name} must not be the zero vector')
    return readonly(value / size, (3,), name)


def positive(value: object, name: str) -> float:
    """Return a number that is positive and finite; PathError where it is not."""
    if not (isinstance(value, (int, float)) and np.isfinite(value) and value > 0.0):
        raise PathError(f'{name} must be a positive number, got {value!r}')
    return float(value)


def frames_on(position: Array, tangent: Array, normal: Array) -> SeamFrames:
    """Return frames with a normal (N, 3) made square to the travel; PathError where it lies along."""
    flat = normal - (normal * tangent).sum(axis=-1, keepdims=True) * tangent
    size = np.linalg.norm(flat, axis=-1, keepdims=True)
    if (size < 1e-6).any():
        x, y, z = position[int(np.argmin(size))]
        raise PathError(
            f'the work normal lies along the seam at ({x:.3f}, {y:.3f}, {z:.3f}) m; '
            "give a 'normal' that points out of the work"
        )
    return SeamFrames(position, tangent, flat / size)
