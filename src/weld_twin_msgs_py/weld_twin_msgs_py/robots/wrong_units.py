# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Catching degrees and millimetres in a robot file before they become a wrong diagnosis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import ModelError

TURN = 2.0 * np.pi + 1e-6
"""A whole turn [rad], and what rounding may add."""
MANY_TURNS = 60.0
"""Joint limits beyond this [rad] are degrees: no arm turns ten times."""
LONG = 20.0
"""DH lengths beyond this [m] are millimetres."""


def refuse_wrong_units(robot: Robot) -> None:
    """
    Refuse a robot whose numbers look like degrees or millimetres.

    Raises ModelError: names the joint, the value and the unit wanted.
    """
    names, turning = robot.joint_names, ~robot.prismatic
    for key in ('alpha', 'theta', 'beta'):
        _check(names, getattr(robot, key), TURN, key, 'degrees in a radian field')
    for key in ('a', 'd'):
        _check(names, getattr(robot, key), LONG, key, 'millimetres in a metre field')
    for key in ('lower', 'upper'):
        values = np.where(turning & np.isfinite(getattr(robot, key)), getattr(robot, key), 0.0)
        _check(names, values, MANY_TURNS, key, 'degrees in a radian field')
    if robot.com is not None:
        _check(names, abs(robot.com).max(axis=1), LONG, 'com', 'millimetres in a metre field')


def _check(names: Sequence[str], values: Array, limit: float, key: str, what: str) -> None:
    if (abs(values) > limit).any():
        k = int(np.argmax(abs(values) > limit))
        raise ModelError(f'joint {names[k]!r}: {key} is {values[k]:.6g}, which looks like {what}')
