# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A seam named on the command line or by a parameter, planned for a robot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.paths import KINDS, default_seam
from weld_twin_core.plan import Plan, plan
from weld_twin_core.profiles import named
from weld_twin_core.robot import Robot
from weld_twin_msgs_py.convert import NANOSECONDS

from .path_file import read_path


def plan_motion(
    robot: Robot, path: str, profile: str = 'smooth', rate: float = 125.0, speed: float = 0.0
) -> Plan:
    """
    Return the planned motion along a seam.

    Parameters
    ----------
    robot : Robot
    path : str
        A kind of bundled seam, or the path of a path file.
    profile : str
        Name of a time law.
    rate : float [1/s]
    speed : float [m/s]
        Speed of the time law, refused where a joint cannot follow; 0 is the law's own, slowed
        down as far as the joints need it.

    Raises
    ------
    PathError
        The seam cannot be read, reached or followed.

    """
    law = named(profile)
    if speed:
        law = replace(law, speed=speed)  # type: ignore[call-arg] - every law has one
    if path in KINDS:
        return plan(robot, default_seam(robot, path), law, rate, fit=not speed)
    seam, torch = read_path(path)
    return plan(robot, seam, law, rate, torch=torch, fit=not speed)


def stamps(t: Array, start_ns: int) -> np.ndarray:
    """Return header stamps, int64 [ns], of times (N,) [s] counted from the first sample."""
    return start_ns + np.round((t - t[0]) * NANOSECONDS).astype(np.int64)
