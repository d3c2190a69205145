# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Inverse kinematics: of one pose, all branches; of a whole path, one branch all the way."""

from .along_path import CarriedArm, PathSolution, rest, solve_path
from .closed_form import family, solve
from .newton import polish

__all__ = ['CarriedArm', 'PathSolution', 'family', 'polish', 'rest', 'solve', 'solve_path']
