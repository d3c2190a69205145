# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether measured positions can belong to these joint angles at all."""

from __future__ import annotations

import numpy as np

from weld_twin_core.arm.chain import forward
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array

_ROUNDS = 30
"""Rounds of fitting the frames in turn; a guess of units needs no more digits."""


def misfit(robot: Robot, q: Array, position: Array) -> Array:
    """
    Return the distance of each position from the nominal arm, shape (M,) [m].

    Measuring frame and tool point are fitted, in turns: a rigid fit (Kabsch), then a linear one.

    Parameters
    ----------
    robot : Robot
    q : array, shape (M, n)
    position : array, shape (M, 3) [m]

    """
    T = forward(robot, q)
    flange, turn = T[:, :3, 3], T[:, :3, :3]
    tool = np.zeros(3)
    for _ in range(_ROUNDS):
        tip = flange + turn @ tool
        centre, there = tip.mean(axis=0), position.mean(axis=0)
        R = _best_turn(position - there, tip - centre)
        design = np.concatenate([R @ turn, np.tile(np.eye(3), (len(q), 1, 1))], axis=2)
        target = position - flange @ R.T
        solution = np.linalg.lstsq(design.reshape(-1, 6), target.reshape(-1), rcond=None)[0]
        tool = solution[:3]
        rest = target - (design @ solution)
    return np.asarray(np.linalg.norm(rest, axis=1))


def _best_turn(to: Array, origin: Array) -> Array:
    """Return the rotation (3, 3) that turns centred points (M, 3) closest to others (Kabsch)."""
    u, _, vt = np.linalg.svd(to.T @ origin)
    sign = np.sign(np.linalg.det(u @ vt))
    return np.asarray(u @ np.diag([1.0, 1.0, sign]) @ vt)
