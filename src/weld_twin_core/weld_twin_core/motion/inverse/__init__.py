# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Inverse kinematics: of one pose, all branches; of a whole path, one branch all the way."""

from .all_branches import solve
from .along_path import PathSolution, solve_path
from .carried_arm import CarriedArm, rest
from .closed_form import family
from .newton import polish

__all__ = ['CarriedArm', 'PathSolution', 'family', 'polish', 'rest', 'solve', 'solve_path']
