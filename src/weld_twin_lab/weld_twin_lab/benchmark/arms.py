# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The arm, the joint positions and the seams that the contenders work on."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from weld_twin_core.arm.catalog import load
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arm.rotation import transform
from weld_twin_core.arrays import Array

DH_KEYS = ('theta', 'd', 'a', 'alpha')
SIZE = 1e-3
"""Standard deviation of an error [rad or m], that of an arm which was never calibrated."""


def calibrated_arm() -> Robot:
    """Return a UR5 whose DH values are all off nominal by about a millimetre or milliradian."""
    rng = np.random.default_rng(5)
    arm = load('ur5')
    rows: dict[str, Any] = {
        key: getattr(arm, key) + SIZE * rng.normal(size=arm.n) for key in DH_KEYS
    }
    tool = transform(np.eye(3), np.array([0.03, -0.02, 0.25]))
    return replace(arm, **rows, T_flange_tool=tool)


def random_positions(arm: Robot, count: int, seed: int = 0) -> Array:
    """Return joint positions of which no two are the same, shape (count, n) [rad]."""
    return np.random.default_rng(seed).uniform(-np.pi, np.pi, (count, arm.n))


def smooth_motion(arm: Robot, count: int) -> Array:
    """Return joint positions along a smooth seam, shape (count, n) [rad]."""
    s = np.linspace(0.0, 1.0, count)[:, None]
    phases = np.arange(arm.n)
    rates = 0.7 + 0.13 * ((5 * phases) % 7)
    return np.array([0.3, -1.2, 1.5, -1.9, -1.5, 0.2, 0.5])[phases] + 0.2 * np.sin(
        s * rates + phases
    )


def links(robot: Robot) -> list[Array]:
    """Return the constant transforms between joint axes, for ``links[0] Rz(q0) links[1] ...``."""
    out = [np.array(robot.T_world_base)]
    for i in range(robot.n):
        out.append(turn_z(robot.theta[i], robot.d[i]) @ turn_x(robot.alpha[i], robot.a[i]))
    out[-1] = out[-1] @ robot.T_flange_tool
    return out


def turn_z(angle: float, along: float) -> Array:
    """Return Rz(angle) Tz(along), shape (4, 4)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, along], [0, 0, 0, 1.0]])


def turn_x(angle: float, along: float) -> Array:
    """Return Rx(angle) Tx(along), shape (4, 4)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0, along], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1.0]])
