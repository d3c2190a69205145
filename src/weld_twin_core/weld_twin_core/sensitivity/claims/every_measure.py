# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Every measurement of the claims on one robot and seam."""

from __future__ import annotations

from ...arm.robot import Robot
from ...motion.paths import Path
from .claim_case import Case
from .combined_measures import MEASURES as COMBINED
from .geometric_measures import MEASURES as GEOMETRIC
from .motion_measures import MEASURES as MOTION


def measure_case(robot: Robot, path: Path, seed: int = 0) -> dict[str, float]:
    """Return all that the claims need of a robot on a seam by name; units as in `rules`."""
    case = Case(robot, path, seed)
    out: dict[str, float] = {}
    for measure in (*GEOMETRIC, *MOTION, *COMBINED):
        out |= {key: float(value) for key, value in measure(case).items()}
    return out
