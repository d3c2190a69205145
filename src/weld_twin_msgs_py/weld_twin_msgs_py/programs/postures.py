# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Which posture a program asks for, in the words of each maker."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from weld_twin_core.arrays import Array

from .build import Suits
from .controllers import Controller

SIGN_DOUBT = np.radians(0.5)
"""An axis this near zero may have either sign in T, which was worked out from other digits."""
QUADRANT_DOUBT = np.radians(0.5)
"""An axis this near the edge of its quadrant may count to either."""


def turn_bits(turn: int) -> Suits:
    """
    Return what takes the postures whose axes have the signs of T.

    turn: bit k is set where axis k + 1 is below zero.
    """

    def suits(robot: object, controller: Controller) -> Any:
        del robot
        back = np.linalg.inv(controller.mix)

        def of(q: Array) -> Array:
            axes = q @ back.T[:, : q.shape[1] - len(controller.external)]
            below = np.array([bool(turn >> k & 1) for k in range(axes.shape[1])])
            fits = np.where(below, axes < SIGN_DOUBT, axes > -SIGN_DOUBT)
            return np.asarray(fits.all(axis=1))

        return of

    return suits


def quadrants(conf: Sequence[int]) -> Suits:
    """
    Return what takes the postures whose axes 1, 4 and 6 are in the quadrants of a confdata.

    conf: cf1, cf4, cf6 and cfx, which is left out: its meaning depends on the arm.
    """

    def suits(robot: object, controller: Controller) -> Any:
        del robot
        first = len(controller.external)
        places = first + np.array([0, 3, 5])

        def of(q: Array) -> Array:
            if q.shape[1] < first + 6:
                return np.ones(len(q), dtype=bool)
            low = np.array(conf[:3]) * 0.5 * np.pi
            axes = q[:, places]
            inside = (axes > low - QUADRANT_DOUBT) & (axes < low + 0.5 * np.pi + QUADRANT_DOUBT)
            return np.asarray(inside.all(axis=1))

        return of

    return suits


def nearest(near: Array) -> Suits:
    """
    Return what takes the posture nearest given joint positions, as qnear does.

    near: shape (n,).
    """

    def suits(robot: object, controller: Controller) -> object:
        del robot, controller

        def of(q: Array) -> Array:
            away = np.abs(q - near).sum(axis=1)
            return np.asarray(away == away.min())

        return of

    return suits  # type: ignore[return-value]
