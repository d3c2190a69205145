# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Every measurement of the claims on one robot and seam."""

from __future__ import annotations

from ...arm.robot import Robot
from ...motion.paths import Path
from . import combined_measures, geometric_measures, motion_measures
from .claim_case import Case


def measure_case(robot: Robot, path: Path, seed: int = 0) -> dict[str, float]:
    """
    Return everything the claims need to know about a robot on a seam.

    Parameters
    ----------
    robot : Robot
    path : Path
    seed : int
        Of the draws that some measures take.

    Returns
    -------
    dict of str to float
        Measures by name; units are in the names of `rules`.

    """
    case = Case(robot, path, seed)
    out: dict[str, float] = {}
    for measure in (
        *geometric_measures.MEASURES,
        *motion_measures.MEASURES,
        *combined_measures.MEASURES,
    ):
        out |= {key: float(value) for key, value in measure(case).items()}
    return out
