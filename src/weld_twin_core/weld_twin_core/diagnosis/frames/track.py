# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A recording as alignment sees it: measured poses or points beside those of the flange."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Array

LEVER = 0.1
"""Metres that a radian counts as, where turns and positions are weighed together."""
FLOOR = 1e-5
"""Gap [m] below which a sample gains no more weight."""
TIE = 1e-6
"""Pull towards the given frames, relative; decides only what the data leave open."""


@dataclass(frozen=True, eq=False)
class Track:
    """
    One recording for alignment, or the same recording in several trials, their axis in front.

    ``position`` (M, 3) and ``rotation`` (M, 3, 3) or None were measured, ``point`` and ``turn``
    are those of the flange in the base frame.
    """

    position: Array
    rotation: Array | None
    point: Array
    turn: Array

    @classmethod
    def side_by_side(cls, trials: Sequence[Track]) -> Track:
        """Return trials of one recording as one, where all have turns or none has."""
        turns = [trial.rotation for trial in trials if trial.rotation is not None]
        return cls(
            np.stack([trial.position for trial in trials]),
            np.stack(turns) if turns else None,
            np.stack([trial.point for trial in trials]),
            np.stack([trial.turn for trial in trials]),
        )

    def gap(self, base: Array, tool: Array) -> Array:
        """Return how far each sample is off, position and turn together, shape (M,) [m]."""
        turn = base[:3, :3] @ self.turn
        reached = self.point @ base[:3, :3].T + base[:3, 3] + turn @ tool[:3, 3]
        off: Array = np.linalg.norm(self.position - reached, axis=1)
        if self.rotation is None:
            return off
        return off + LEVER * chord(self.rotation, turn @ tool[:3, :3])

    @property
    def turns(self) -> Array:
        """Return measured rotations, none where only points were measured."""
        return np.zeros((0, 3, 3)) if self.rotation is None else self.rotation


def nearest_rotation(matrix: Array) -> Array:
    """Return the rotations R that make trace(R' matrix) largest, shape (..., 3, 3)."""
    u, _, vt = np.linalg.svd(matrix)
    u[..., 2] *= np.linalg.det(u @ vt)[..., None]
    return np.asarray(u @ vt)


def chord(first: Array, second: Array) -> Array:
    """Return 2 sin(angle / 2) of the turns between rotations, shape (..., M): small ones' angle."""
    return np.asarray(np.linalg.norm(first - second, axis=(-2, -1)) / np.sqrt(2.0))
