# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Base and tool fitted to one recording, and nothing else."""

from __future__ import annotations

from ...arm.robot import Robot
from ...recording import Recording
from ..algebra.fit import fit
from ..algebra.problem import Model, Problem, usable
from .alignment import initial_frames


def frames_only(recording: Recording, robot: Robot, align: frozenset[str]) -> Model:
    """
    Return the robot with the frames that best agree with a recording.

    Parameters
    ----------
    recording : Recording
        With measurements.
    robot : Robot
    align : frozenset of str
        Which frames are fitted: 'base', 'tool' or both.

    Raises
    ------
    DataError
        Nothing was measured, or the clocks of joints and measurements do not meet.

    """
    problem = Problem((usable(recording),), align)
    start = initial_frames(problem, Model(robot, (robot.T_world_base,)))
    return fit(problem, start, problem.unit_scale()).model
