# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A seam named on the command line or by a parameter, planned for a robot."""

from dataclasses import replace

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.motion.paths import KINDS, default_seam, from_mapping
from weld_twin_core.motion.planned_motion import Plan, plan
from weld_twin_core.motion.profiles import Profile, named
from weld_twin_core.motion.sample_count import refuse_endless
from weld_twin_core.recording import JointMotion
from weld_twin_msgs_py.files.joint_file import read_joint_motion, through_stations
from weld_twin_msgs_py.files.path_file import read_external, read_path
from weld_twin_msgs_py.messages.from_messages import NANOSECONDS


def plan_motion(
    robot: Robot, path: str, profile: str = 'smooth', rate: float = 125.0, speed: float = 0.0
) -> Plan:
    """
    Return the planned motion along a bundled seam or one of a file, at a rate [1/s].

    speed: of the time law, refused where a joint cannot follow [m/s]; 0 is the law's own,
    slowed down as far as the joints need it.
    """
    law = _law(profile, speed)
    if path in KINDS:
        return plan(robot, default_seam(robot, path), law, rate, fit=not speed)
    seam, torch = read_path(path)
    external = read_external(path, robot)
    return plan(robot, seam, law, rate, torch=torch, fit=not speed, told=external)


def joint_motion(
    robot: Robot, path: str, profile: str = 'smooth', rate: float = 125.0, speed: float = 0.0
) -> JointMotion:
    """Return the motion of a file of kind 'joints', or the planned one along a seam."""
    given = None if path in KINDS else read_joint_motion(path, robot)
    if given is None:
        return plan_motion(robot, path, profile, rate, speed).motion
    t, q, stations = given
    if stations:
        return through_stations(robot, t, q, rate)
    return sampled(robot, JointMotion(t - t[0], q), rate)


def plan_through(
    robot: Robot, points: Array, profile: str = 'smooth', rate: float = 125.0, speed: float = 0.0
) -> Plan:
    """Return the planned motion along the spline through points, (N, 3) [m], torch upright."""
    seam = from_mapping({'kind': 'points', 'points': points.tolist()})
    return plan(robot, seam, _law(profile, speed), rate, fit=not speed)


def _law(profile: str, speed: float) -> Profile:
    law = named(profile)
    if not speed:
        return law
    return replace(law, speed=speed)  # type: ignore[type-var]  # all have one


def sampled(robot: Robot, motion: JointMotion, rate: float) -> JointMotion:
    """Return a motion at so many samples a second, by cubics through its points."""
    refuse_endless(float(motion.t[-1]), 1.0 / rate)
    count = max(round(float(motion.t[-1]) * rate), 1)
    t = np.linspace(0.0, float(motion.t[-1]), count + 1)
    q, qd = motion.at(t)
    robot.check_positions(q)
    fast = np.abs(qd).max(axis=0) > robot.max_velocity
    if fast.any():
        k = int(np.argmax(fast))
        raise DataError(
            f'joint {robot.joint_names[k]!r} would move at {np.abs(qd[:, k]).max():.3g}/s, its '
            f'limit is {robot.max_velocity[k]:.3g}; give the trajectory more time'
        )
    return JointMotion(t, q, qd)


def backward(motion: JointMotion) -> JointMotion:
    """Return the same motion run from its end to its beginning."""
    t = motion.t[0] + motion.t[-1] - motion.t[::-1]
    return JointMotion(t, motion.q[::-1], -motion.velocity[::-1])


def thinned(motion: JointMotion, most: int) -> JointMotion:
    """Return at most about so many samples of a motion, the first and the last among them."""
    keep = np.unique(np.linspace(0, motion.t.size - 1, min(most, motion.t.size)).round())
    rows = keep.astype(int)
    return JointMotion(motion.t[rows], motion.q[rows], motion.velocity[rows])


def stamps(t: Array, start_ns: int) -> np.ndarray:
    """Return header stamps, int64 [ns], of times (N,) [s] counted from the first sample."""
    return np.asarray(start_ns + np.round((t - t[0]) * NANOSECONDS).astype(np.int64))
