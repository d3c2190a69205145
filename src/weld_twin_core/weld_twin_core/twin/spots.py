# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Places that were touched, and how far from them what was learned there is believed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arm.chain import forward
from ..arm.robot import Robot
from ..arrays import Array
from ..recording import Recording

_TESTED = 3
"""Places from which on each can be left out and foretold from the others."""
_ALONE = 0.1
"""Distance [m] from a place within which it is believed where no place could be left out: that of a
plate with sockets. Of an arm touched at one place alone, a third of the others came out worse."""


@dataclass(frozen=True, eq=False)
class Spots:
    """Where contacts were, as the arm has it."""

    robot: Robot
    """It says where a posture has the tool point."""
    at: Array
    """The middle of every place, seen from the base, shape (P, 3) [m]."""
    reach: float
    """How far from the nearest of them the model was tested: the greatest distance from a place to
    the next, as each was foretold from the others [m]."""

    @classmethod
    def of(cls, recordings: Sequence[Recording], robot: Robot) -> Spots | None:
        """Return the places of contacts, a recording each; None where an instrument measured."""
        if any(recording.contacts is None for recording in recordings):
            return None
        bare = robot.with_frames(base=np.eye(4))
        at = np.array([_points(bare, r.joints.q).mean(axis=0) for r in recordings])
        reach = _ALONE
        if len(at) >= _TESTED:
            apart = np.linalg.norm(at[:, None] - at, axis=2) + np.diag(np.full(len(at), np.inf))
            reach = max(reach, float(apart.min(axis=1).max()))
        return cls(bare, at, reach)

    def away(self, q: Array) -> Array:
        """Return how far the tool point is from the nearest place, shape (M,) [m]."""
        points = _points(self.robot, q)
        return np.asarray(np.linalg.norm(points[:, None] - self.at, axis=2).min(axis=1))

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers and lists."""
        return {'at': self.at.tolist(), 'reach': self.reach}


def _points(robot: Robot, q: Array) -> Array:
    return np.asarray(forward(robot, q)[:, :3, 3])
