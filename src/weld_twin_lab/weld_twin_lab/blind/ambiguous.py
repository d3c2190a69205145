# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Causes that no measurement, or not this one, can tell from another.

Each construction gives the causes at work and every answer that is as right as the truth.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from weld_twin_core.arm.chain import frames
from weld_twin_core.arm.robot import Robot

from .cause_sizes import Cause, draw

Site = tuple[str, str | None]
PARALLEL = 1e-6
"""Sine of the angle between two axes up to which they are parallel; tables of rows are exact."""


class Construction(NamedTuple):
    """Causes, and other lists of sites that predict the same."""

    causes: list[Cause]
    alike: list[list[Site]]


def construct(name: str, robot: Robot, span: float, rng: np.random.Generator) -> Construction:
    """Return an ambiguous construction of its typical size."""
    return CONSTRUCTIONS[name](robot, span, rng)


def _at_an_end(
    family: str, at: int, frame: str, robot: Robot, span: float, rng: np.random.Generator
) -> Construction:
    """Turn or raise the first or last joint; a frame turned about or moved along it is the same."""
    cause = {**draw(family, robot, span, rng), 'joint': robot.joint_names[at]}
    return Construction([cause], [[(frame, None)]])


def _base_turn(robot: Robot, span: float, rng: np.random.Generator) -> Construction:
    """Turn the base about the first axis."""
    base = robot.T_world_base
    turn = 5e-4 * float(rng.choice([-1.0, 1.0])) * base[:3, 2]
    shift = base[:3, 3] - _turned(base[:3, 3], turn)
    cause = {'effect': 'base_pose', 'xyz': shift.tolist(), 'rotvec': turn.tolist()}
    return Construction([cause], [[('joint_offset', robot.joint_names[0])]])


def _parallel(robot: Robot, span: float, rng: np.random.Generator) -> Construction:
    """Lengthen a link along one of parallel axes; the neighbours shift the tool alike."""
    axes = np.array([row.z for row in frames(robot, np.zeros(robot.n)).rows])
    for at in rng.permutation(robot.n):
        mates = [k for k in range(robot.n) if k != at and _linked(axes, at, k)]
        if mates:
            cause = {**draw('link_offset', robot, span, rng), 'joint': robot.joint_names[at]}
            alike: list[list[Site]] = [[('link_offset', robot.joint_names[k])] for k in mates]
            return Construction([cause], alike)
    return construct('first axis', robot, span, rng)


def _lag_on_every_joint(robot: Robot, span: float, rng: np.random.Generator) -> Construction:
    """Let every joint lag alike; a clock that is late is nearly the same."""
    causes: list[Cause] = [
        {'effect': 'servo_lag', 'joint': joint, 'time_constant': 0.008}
        for joint in robot.joint_names
    ]
    return Construction(causes, [[('time_delay', None)]])


CONSTRUCTIONS: dict[str, Callable[..., Construction]] = {
    'first axis': partial(_at_an_end, 'joint_offset', 0, 'base_pose'),
    'base turn': _base_turn,
    'parallel axes': _parallel,
    'equal lag': _lag_on_every_joint,
    'last axis': partial(_at_an_end, 'joint_offset', -1, 'tool_pose'),
    'pedestal': partial(_at_an_end, 'link_offset', 0, 'base_pose'),
}


def _turned(point: np.ndarray, turn: np.ndarray) -> np.ndarray:
    return point + np.cross(turn, point)


def _linked(axes: np.ndarray, a: int, b: int) -> bool:
    """Tell whether the axes of joints a to b are parallel one after the other."""
    run = axes[min(a, b) : max(a, b) + 1]
    return bool(np.abs(np.cross(run, run[0])).max() < PARALLEL)
