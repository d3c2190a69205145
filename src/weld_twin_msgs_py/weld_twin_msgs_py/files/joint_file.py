# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Joint motion files: stations or a trajectory in joint positions, as a diagnosis proposes."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError
from weld_twin_core.motion.sample_count import refuse_endless
from weld_twin_core.recording import JointMotion

from .whole_files import write_text
from .yaml_file import read_yaml, yaml_text

KIND = 'joints'
"""The `kind` of a path file that holds a joint motion."""
EASY = 0.5
"""Share of a joint's limits used on the way from station to station."""
REST = 2.0
"""Least stay at a station [s]."""
PEAK_VELOCITY, PEAK_ACCELERATION = 1.875, 5.7735
"""Of the fifth-order step from 0 to 1 in unit time, at rest at both ends."""


def write_joint_motion(path: Path, motion: Mapping[str, Any], comment: str) -> None:
    """
    Write a motion as a path file of kind 'joints', with a line on what it is for.

    motion: 'static', 'joint_names', 't' [s] and 'q' [rad, m]; of stations, when each is measured.
    """
    content = {
        'kind': KIND,
        'stations': bool(motion['static']),
        'joint_names': list(motion['joint_names']),
        **{key: np.asarray(motion[key], float).tolist() for key in ('t', 'q')},
    }
    write_text(path, f'# {comment}\n{yaml_text(content)}', overwrite=True)


def read_joint_motion(path: Path | str, robot: Robot) -> tuple[Array, Array, bool] | None:
    """Return times (K,) [s], positions (K, n), and whether they are stations; None for a seam."""
    if Path(path).suffix.lower() not in ('.yaml', '.yml'):
        return None
    data = read_yaml(path, 'path file')
    if not isinstance(data, dict) or data.get('kind') != KIND:
        return None
    names = list(data.get('joint_names') or robot.joint_names)
    if sorted(map(str, names)) != sorted(robot.joint_names):
        raise DataError(
            f"path file '{path}' moves {', '.join(map(str, names))}, but {robot.name} has "
            + ', '.join(robot.joint_names)
        )
    try:
        t = np.array(data['t'], dtype=np.float64)
        q = np.array(data['q'], dtype=np.float64)[:, [names.index(n) for n in robot.joint_names]]
    except (KeyError, TypeError, ValueError, IndexError):
        raise DataError(
            f"path file '{path}': t must be a list of times and q a list of joint positions"
        ) from None
    if t.ndim != 1 or len(t) != len(q) or len(t) < 2 or not (np.diff(t) > 0.0).all():
        raise DataError(f"path file '{path}': t must rise, with one row of q for each")
    robot.check_positions(q)
    return t, q, bool(data.get('stations', False))


def through_stations(robot: Robot, t: Array, q: Array, rate: float) -> JointMotion:
    """Return the motion through stations, each measured at its time, or as soon as it can."""
    leave, arrive = [], [0.0]
    for k, step in enumerate(np.abs(np.diff(q, axis=0))):
        way = max(
            PEAK_VELOCITY * float((step / robot.planned_velocity).max()) / EASY,
            float(np.sqrt(PEAK_ACCELERATION * (step / robot.max_acceleration).max() / EASY)),
            1.0 / rate,
        )
        leave.append(max(arrive[-1] + REST, float(t[k + 1] - t[0]) - 0.5 * REST - way))
        arrive.append(leave[-1] + way)
    refuse_endless(arrive[-1] + REST, 1.0 / rate)
    start, end = np.array(leave), np.array(arrive[1:])
    times = np.arange(0.0, arrive[-1] + REST, 1.0 / rate)
    leg = np.clip(np.searchsorted(start, times, side='right') - 1, 0, len(leave) - 1)
    span = end[leg] - start[leg]
    share = np.clip((times - start[leg]) / span, 0.0, 1.0)
    eased = share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
    rates = 30.0 * share**2 * (1.0 - share) ** 2 / span
    step = q[leg + 1] - q[leg]
    return JointMotion(times, q[leg] + eased[:, None] * step, rates[:, None] * step)
