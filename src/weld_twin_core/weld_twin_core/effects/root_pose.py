# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Root pose: a positioner stands elsewhere beside the robot than its root frame says."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arm.robot import Robot
from ..arm.rotation import rotation_matrix
from ..arrays import Array
from ..errors import ModelError
from .constant import FrameError, frame_parameters
from .registry import register
from .view import Plausible, Value, View
from .wording import frame


@register
@dataclass(frozen=True, eq=False)
class RootPose(FrameError):
    """The positioner is displaced by xyz along the robot's base axes, and turned about its root."""

    xyz: Value = (0.0, 0.0, 0.0)
    rotvec: Value = (0.0, 0.0, 0.0)

    name = 'root_pose'
    title = 'root error of the positioner'
    entered = 'root'
    depends_on = 'constant'
    place = 'base'
    channel = 'root'
    parameters = frame_parameters(
        Plausible.even(5e-3, 0.1, 'derived: a root that was measured by touch, or by hand'),
        Plausible.even(5e-3, 0.1, 'derived: five millimetres on a metre'),
    )

    def check(self, robot: Robot) -> None:
        """
        Refuse an effect this robot cannot have.

        Parameters
        ----------
        robot : Robot

        Raises
        ------
        ModelError
            As of every effect, or no positioner is there.

        """
        super().check(robot)
        if not robot.behind:
            raise ModelError(
                f'{self.name} is of a positioner, and robot {robot.name!r} has none; use base_pose'
            )

    @classmethod
    def applicable(cls, view: View, joint: str | None) -> str | None:
        """
        Return why the data cannot show it: the robot may have no such thing.

        Parameters
        ----------
        view : View
            The samples that reach the effect.
        joint : str or None
            The joint it would sit on.

        """
        return (
            super().applicable(view, joint)
            if cls.fits(view.robot, joint)
            else 'there is no positioner'
        )

    @classmethod
    def fits(cls, robot: Robot, joint: str | None) -> bool:
        """Return whether there is a positioner."""
        return robot.behind > 0

    def remedy(self, robot: Robot) -> str:
        """Return what to mend, in words; see `Hooks.remedy`."""
        rows = robot.T_base_foot
        step = (self.vector().reshape(2, 3) @ rows[:3, :3]).ravel()
        now = np.asarray(np.linalg.inv(robot.T_root_base @ rows))
        new = np.eye(4)
        new[:3, :3] = rotation_matrix(step[3:]) @ now[:3, :3]
        new[:3, 3] = now[:3, 3] + step[:3]
        moved = frame(step, 'of the base', 'of the positioner')
        return (
            f'Correct the root frame of the positioner by {moved}: in the base of the robot it '
            f'stands at {_placed(new)} in place of {_placed(now)}.'
        )


def _placed(pose: Array) -> str:
    """Return a frame as controllers take it: mm, and turns about fixed x, y and z in degrees."""
    place = ', '.join(f'{value * 1e3:.3f}' for value in pose[:3, 3])
    yaw = np.arctan2(pose[1, 0], pose[0, 0])
    pitch = np.arctan2(-pose[2, 0], np.hypot(pose[0, 0], pose[1, 0]))
    roll = np.arctan2(pose[2, 1], pose[2, 2])
    angles = ', '.join(f'{np.degrees(value):.4f}' for value in (roll, pitch, yaw))
    return f'x, y, z = ({place}) mm, turned by ({angles}) deg about them'
