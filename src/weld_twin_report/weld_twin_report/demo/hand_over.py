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
    """The example, and what is known of it so far."""

    folder: Path  # where results go
    robot: Robot
    effects: tuple[Effect, ...]  # what is wrong with the robot; the twin does not know
    seam: str  # kind of the bundled seam
    rate: float  # [1/s], of the joint states
    seed: int  # of the measurement noise
    plan: Plan = field(init=False)  # from the first step on
    bag: Path = field(init=False)  # from the second step on
    recording: Recording = field(init=False)  # the bag read again, from the third step on
    deviation: Array = field(init=False)
    """Shape (M, 3) [m]: measured minus twin in the world frame."""
    seam_deviation: Array = field(init=False)
    """Shape (M, 3) [m]: the same along, across and normal to the seam."""
    metrics: DeviationMetrics = field(init=False)
    lines: list[str] = field(default_factory=list)  # what to tell the user at the end


class Step(NamedTuple):
    """A step: what it says it does, and the function that does it."""

    title: str
    run: Callable[[Job, Progress], None]
