# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Root pose: a positioner stands elsewhere beside the robot than its root frame says."""

from __future__ import annotations

from dataclasses import dataclass

from ..arm.robot import Robot
from ..errors import ModelError
from .constant import FrameError
from .registry import register
from .view import Value, View


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
