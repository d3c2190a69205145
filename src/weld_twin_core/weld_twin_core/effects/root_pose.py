# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Root pose: a positioner stands elsewhere beside the robot than its root frame says."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..arm.robot import Robot
from ..arm.rotation import rotation_matrix
from ..arrays import Array
from .constant import FrameError, frame_parameters
from .hooks import Hooked, SearchHooks
from .registry import register
from .view import Plausible, Value
from .wording import frame, placed


class _Search(SearchHooks):
    def fits(self, robot: Robot, joint: str | None) -> bool:
        """Return whether there is a positioner."""
        return robot.behind > 0


@register
@dataclass(frozen=True, eq=False)
class RootPose(FrameError):
    """The positioner is displaced by xyz along the robot's base axes, and turned about its root."""

    xyz: Value = (0.0, 0.0, 0.0)
    rotvec: Value = (0.0, 0.0, 0.0)

    name = 'root_pose'
    traits = replace(
        FrameError.traits,
        title='root error of the positioner',
        meaning='the positioner stands elsewhere than its root frame says',
        entered='root',
        depends_on='constant',
        place='base',
        lacking='is of a positioner, and robot {robot!r} has none; use base_pose',
    )
    channel = 'root'
    parameters = frame_parameters(
        Plausible.even(5e-3, 0.1, 'derived: a root that was measured by touch, or by hand'),
        Plausible.even(5e-3, 0.1, 'derived: five millimetres on a metre'),
    )
    search = Hooked(_Search)

    def stands(self, robot: Robot, base: Array) -> tuple[Array, Array]:
        """
        Return where the positioner's rows begin, as the robot file has it and as it is.

        Parameters
        ----------
        base : array, shape (4, 4) [m]
            The base that it is told in, in the frame where the robot's own rows begin.

        Returns
        -------
        array, array
            ``T_base_root``, shape (4, 4) [m].

        """
        now, step = np.linalg.inv(robot.T_root_base), self.vector()
        new = now.copy()
        new[:3, :3] = rotation_matrix(step[3:]) @ now[:3, :3]
        new[:3, 3] += step[:3]
        there = np.linalg.inv(base)
        return np.asarray(there @ now), np.asarray(there @ new)

    def remedy(self, robot: Robot) -> str:
        rows = robot.T_base_foot
        step = (self.vector().reshape(2, 3) @ rows[:3, :3]).ravel()
        now, new = self.stands(robot, rows)
        moved = frame(step, 'of the base', 'of the positioner')
        return (
            f'Correct the root frame of the positioner by {moved}: in the base of the robot it '
            f'stands at {placed(new)} in place of {placed(now)}.'
        )
