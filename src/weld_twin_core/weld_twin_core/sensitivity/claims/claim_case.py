# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One robot on one seam, measured for every claim."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...arm.robot import Robot
from ...arm.rotation import rotation_matrix, transform
from ...arrays import Array
from ...motion.paths import Path
from ...motion.profiles import Aggressive
from ..local import LocalSensitivity, local_sensitivity
from ..seam_study import Study, planned_study
from ..tolerance import Tolerance, default_tolerances

POINTS = 400
"""Path points; the aggressive motion passes each part of the seam many times."""
BENT_TORCH = transform(rotation_matrix([0.0, 0.6, 0.0]), np.array([0.1, 0.0, 0.35]))
"""A torch of usual size, bent by 34 degrees, from flange to wire tip."""


@dataclass(frozen=True, eq=False)
class Case:
    """A robot, a seam and the motions on it; see `measure_case`."""

    robot: Robot
    path: Path
    seed: int = 0

    @cached_property
    def tolerances(self) -> tuple[Tolerance, ...]:
        """Return the paper's error sources; a turn of the base is measured apart."""
        every = default_tolerances(self.robot)
        return tuple(t for t in every if (t.effect, t.parameter) != ('base_pose', 'rotvec'))

    @cached_property
    def smooth(self) -> Study:
        """Return the smooth motion."""
        return planned_study(self.robot, self.path, 'smooth', points=POINTS)

    @cached_property
    def aggressive(self) -> Study:
        """Return the aggressive motion."""
        return self.reversing(10)

    def reversing(self, reversals: int, points: int = POINTS) -> Study:
        """Return an aggressive motion that turns a number of times."""
        law = Aggressive(reversals=reversals)
        return planned_study(self.robot, self.path, law, points=points)

    @cached_property
    def local(self) -> LocalSensitivity:
        """Return the local sensitivities of the smooth motion."""
        return local_sensitivity(self.smooth, self.tolerances)

    @property
    def joint_levers(self) -> Array:
        """Return the peak slope of D by the offset of every joint, shape (n,) [m/rad]."""
        own = [k for k, t in enumerate(self.tolerances) if t.effect == 'joint_offset']
        return self.local.peak[own]


Measure = Callable[[Case], dict[str, float]]
