# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Studies of nothing but the DH values of revolute joints: every draw exactly, and fast.

Such draws are another robot on the same motion, which `kernels.draws` runs by the thousand. Play,
springs, frames and all else go another way; see `evaluate`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..errors import ModelError
from ..kernels.draws import DhDraws, SeamDraws
from .seam_study import Study
from .tolerance import Tolerance

_VALUES = {
    ('joint_offset', 'offset'): 'theta',
    ('link_offset', 'dd'): 'd',
    ('link_length', 'da'): 'a',
    ('link_twist', 'dalpha'): 'alpha',
}
"""Effect and parameter, and the DH value that it adds to; an offset of a joint turns its row."""


@dataclass(frozen=True, eq=False)
class DhStudy:
    """A study whose tolerances are all of DH values."""

    study: Study
    tolerances: tuple[Tolerance, ...]
    seam: SeamDraws
    """The nominal robot at the samples of the study."""

    def deviations(self, draws: Array) -> Array:
        """
        Return the deviations of draws in seam axes, shape (3, D, N) [m].

        draws: in the units of the tolerances, shape (D, P).
        """
        robot = self.study.robot
        values = {
            key: np.repeat(getattr(robot, key)[None], len(draws), axis=0)
            for key in DhDraws._fields
        }
        for column, tolerance in zip(draws.T, self.tolerances, strict=True):
            key = _VALUES[tolerance.effect, tolerance.parameter]
            values[key][:, robot.index(str(tolerance.joint))] += column
        away = self.seam.deviations(DhDraws(**values))
        return np.moveaxis(self.study.on_seam(away), -1, 0)


def dh_study(study: Study, tolerances: Sequence[Tolerance]) -> DhStudy | None:
    """Return the fast form of a study, or None where something else than DH values counts."""
    if study.known or any((t.effect, t.parameter) not in _VALUES for t in tolerances):
        return None
    joints = study.recording.joints
    q = joints.q if study.at is None else joints.at(study.at)[0]
    try:
        return DhStudy(study, tuple(tolerances), SeamDraws(study.robot, q))
    except ModelError:  # modified rows, or joints that slide
        return None
