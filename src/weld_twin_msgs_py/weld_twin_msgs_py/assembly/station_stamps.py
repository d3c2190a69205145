# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Telling static stations from a recorded motion."""

from __future__ import annotations

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.recording import JointMotion, Measurements

SPARSE = 0.5
"""Joint states further apart than this [s] say nothing of the motion between them."""
FAST = 10.0
"""Speed [rad/s or m/s] no arm reaches, for robots whose limits are not known."""


def looks_static(robot: Robot, motion: JointMotion, measured: Measurements | None) -> bool:
    """
    Return whether every joint state is a station with a measurement of its own.

    As many joint states as measurements, paired one to one in time, and either far apart or
    joined by motions too fast for the arm.
    """
    if measured is None or measured.t.size != motion.t.size:
        return False
    if motion.t.size == 1:
        return True
    steps = np.diff(motion.t)
    # one to one: each measurement comes within half a step of its own joint state
    reach = 0.5 * np.concatenate([steps[:1], np.minimum(steps[:-1], steps[1:]), steps[-1:]])
    if (abs(measured.t - motion.t) > reach).any():
        return False
    if np.median(steps) >= SPARSE:
        return True
    limit = np.where(np.isfinite(robot.max_velocity), robot.max_velocity, FAST)
    too_fast = (abs(np.diff(motion.q, axis=0)) > 1.5 * limit * steps[:, None]).any(axis=1)
    return bool(too_fast.mean() > 0.5)
