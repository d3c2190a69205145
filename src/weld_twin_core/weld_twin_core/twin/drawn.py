# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Models drawn from those that the recordings allow, along a motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array

PLACES = 300
"""Places of a motion at which models are drawn; between them what a model is off by hardly changes."""


class Drawn(NamedTuple):
    """
    By how much the models that the recordings allow are off the fitted one along a motion.

    Attributes
    ----------
    near : array of int, shape (N,)
        The nearest of the places for every sample.
    same, own : array, shape (K, D, 3) [m]
        At the places, under D models: in the set-up that was recorded, and where the robot's own base
        counts. Frames that were fitted to a recording take up much of an arm's errors there, which
        are seen again where they do not.

    """

    near: NDArray[np.int_]
    same: Array
    own: Array

    def where(self, keep: NDArray[np.bool_]) -> Drawn:
        """Return some of the samples."""
        return self._replace(near=self.near[keep])


def places(count: int) -> tuple[NDArray[np.int_], NDArray[np.int_]]:
    """Return the samples at which models are drawn, shape (K,), and `Drawn.near`, shape (count,)."""
    at = np.unique(np.linspace(0, count - 1, min(PLACES, count)).round().astype(int))
    middles = 0.5 * (at[1:] + at[:-1])
    return at, np.searchsorted(middles, np.arange(count))
