# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The problem that recordings pose, and the nominal model with frames to start from."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from ...arm.robot import Robot
from ...effects.effect import Effect
from ...recording import Recording
from ..algebra.fit import fit
from ..algebra.problem import Anchor, Model, Problem, frames_named, usable
from .alignment import initial_frames
from .places import posed


def aligned(
    recordings: Recording | Sequence[Recording],
    robot: Robot,
    align: str | Iterable[str],
    known: Sequence[Effect],
) -> tuple[Problem, Model]:
    """
    Return the recordings as a problem, and the model that a search starts from.

    Parameters
    ----------
    recordings : Recording, or sequence of Recording
    robot : Robot
        The nominal model.
    align : str or iterable of str
        Frames fitted as nuisance in every hypothesis: 'base', 'tool', 'base,tool'.
    known : sequence of Effect
        Put into the twin first.

    Raises
    ------
    DataError
        Nothing was measured, or no measurement falls inside a joint stream.
    ModelError
        ``align`` names something else than base and tool.

    """
    recordings = (recordings,) if isinstance(recordings, Recording) else tuple(recordings)
    if any(recording.contacts is not None for recording in recordings):
        return posed(recordings, robot, frames_named(align), known)
    problem = Problem(tuple(usable(r) for r in recordings), frames_named(align))
    model = Model(robot, tuple(robot.T_world_base for _ in recordings), tuple(known))
    model = initial_frames(problem, model)
    return replace(problem, anchor=Anchor(model.bases, model.robot.T_flange_tool)), model


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
