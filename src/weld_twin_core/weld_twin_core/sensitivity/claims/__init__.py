# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The paper's claims: what is measured on each robot and seam, and what that says of each."""

from ...arm.robot import Robot
from ...motion.paths import Path
from .claim_case import Case
from .combined_measures import MEASURES as COMBINED
from .geometric_measures import MEASURES as GEOMETRIC
from .motion_measures import MEASURES as MOTION
from .rules import CaseName, Claim, judge

__all__ = ['Case', 'CaseName', 'Claim', 'judge', 'measure_case']


def measure_case(robot: Robot, path: Path, seed: int = 0) -> dict[str, float]:
    """Return all that the claims need of a robot on a seam by name; units as in `rules`."""
    case = Case(robot, path, seed)
    out: dict[str, float] = {}
    for measure in (*GEOMETRIC, *MOTION, *COMBINED):
        out |= {key: float(value) for key, value in measure(case).items()}
    return out
