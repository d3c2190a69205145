# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What the steps of the demo hand on to each other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.effects import Effect
from weld_twin_core.metrics.deviation import DeviationMetrics
from weld_twin_core.motion.planned_motion import Plan
from weld_twin_core.recording import Recording

Progress = Callable[[float], None]
"""Tells how much of a step is done, 0 to 1."""


@dataclass
class Job:
    """
    The example, and what is known of it so far.

    Attributes
    ----------
    folder : Path
        Where results go.
    effects : tuple of Effect
        What is wrong with the robot; the twin does not know.
    seam : str
        Kind of the bundled seam.
    rate : float [1/s]
        Of the joint states.
    seed : int
        Of the measurement noise.
    plan : Plan
        From the first step on.
    bag : Path
        From the second step on.
    recording : Recording
        The bag read again, from the third step on.
    deviation : array, shape (M, 3) [m]
        Measured minus twin in the world frame.
    seam_deviation : array, shape (M, 3) [m]
        The same along, across and normal to the seam.
    lines : list of str
        What to tell the user at the end.

    """

    folder: Path
    robot: Robot
    effects: tuple[Effect, ...]
    seam: str
    rate: float
    seed: int
    plan: Plan = field(init=False)
    bag: Path = field(init=False)
    recording: Recording = field(init=False)
    deviation: Array = field(init=False)
    seam_deviation: Array = field(init=False)
    metrics: DeviationMetrics = field(init=False)
    lines: list[str] = field(default_factory=list)


class Step(NamedTuple):
    """A step: what it says it does, and the function that does it."""

    title: str
    run: Callable[[Job, Progress], None]
