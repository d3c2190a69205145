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


AT_REST = 0.01
"""Speed [rad/s or m/s] that controllers still tell of an arm that stands."""
TOGETHER = 0.1
"""Share of the way to the next joint state within which a measurement belongs to its own, where some
joint states have none: a stream that runs beside lies anywhere."""


def looks_static(robot: Robot, motion: JointMotion, measured: Measurements | None) -> bool:
    """
    Return whether every joint state is a station at rest.

    Joint states far apart, or joined by motions too fast for the arm. Where something was measured,
    it was measured once at a station; where nothing was, no velocity tells of a motion.
    """
    if measured is None:
        if motion.qd is not None and (abs(motion.qd) > AT_REST).any():
            return False
    elif not _once_each(motion, measured):
        return False
    if motion.t.size == 1:
        return True
    steps = np.diff(motion.t)
    if np.median(steps) >= SPARSE:
        return True
    limit = np.where(np.isfinite(robot.max_velocity), robot.max_velocity, FAST)
    too_fast = (abs(np.diff(motion.q, axis=0)) > 1.5 * limit * steps[:, None]).any(axis=1)
    return bool(too_fast.mean() > 0.5)


def _once_each(motion: JointMotion, measured: Measurements) -> bool:
    """Return whether each measurement comes nearest to a joint state of its own."""
    if not 0 < measured.t.size <= motion.t.size:
        return False
    if motion.t.size == 1:
        return True
    own = motion.nearest(measured.t)
    if np.unique(own).size < own.size:
        return False
    steps = np.diff(motion.t)
    reach = np.concatenate([steps[:1], np.minimum(steps[:-1], steps[1:]), steps[-1:]])[own]
    share = 0.5 if measured.t.size == motion.t.size else TOGETHER
    return bool((abs(measured.t - motion.t[own]) <= share * reach).all())
