# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Where a maker's controller has its frames and joints, on the model of a robot.

The models of this project stand on the floor and count joint 3 from joint 2, as ROS drivers do.
FANUC's and Yaskawa's controllers have their origin at the height of the second axis, and FANUC
counts joint 3 from the ground. Of a URDF the base and the flange are links.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from weld_twin_core.arm.controller_frames import ControllerFrames
from weld_twin_core.arm.controller_lookup import bundled_name, controller_frames
from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.errors import DataError

AT_SECOND_AXIS = {'fanuc-ls': ('fanuc', 'FANUC'), 'inform': ('yaskawa', 'Yaskawa')}
"""Languages whose controllers have the origin there, with the names of bundled robots and maker."""
COUPLED = 'fanuc-ls'
"""The language whose controller counts joint 3 from the ground."""


class Frame(NamedTuple):
    """A tool or base frame as a program names it; ``value`` None where it has no numbers."""

    name: str
    value: Array | None = None


@dataclass(frozen=True, eq=False)
class Controller:
    """
    The frames of a controller on a robot.

    Attributes
    ----------
    origin : array, shape (4, 4) [m]
        ``T_base_origin``: the controller's robot frame in the base frame of the model.
    flange : array, shape (4, 4) [m]
        The controller's flange on the last frame of the model.
    mix : array, shape (n, n)
        Joints of the model from those of the controller.
    own_tool : array, shape (4, 4) [m]
        The tool of the robot's model.
    tools, bases : mapping of str to array
        Frames that were given, by the names of the program, in lower case.
    notes : list of str
        What was assumed, in sentences.

    """

    origin: Array
    flange: Array
    mix: Array
    own_tool: Array
    tools: Mapping[str, Array] = field(default_factory=dict)
    bases: Mapping[str, Array] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def tool(self, frame: Frame) -> Array:
        """
        Return ``T_flange_tool`` on the model.

        Raises
        ------
        DataError
            The program gives no numbers for it, nor does anybody else.

        """
        given = self.tools.get(frame.name.lower())
        if given is not None or frame.value is not None:
            value = frame.value if given is None else given
            assert value is not None
            return np.asarray(self.flange @ value)
        if not frame.name:
            return self.own_tool
        if np.abs(self.own_tool[:3, 3] - self.flange[:3, 3]).max() < 1e-9:
            raise DataError(
                f'the numbers of tool {frame.name} are not in the program, and the robot file has '
                f"no tool; give them with --tool '{frame.name}=X,Y,Z,...'"
            )
        self._note(
            f'the numbers of tool {frame.name} are not in the program; the tool of the robot file '
            'was taken'
        )
        return self.own_tool

    def base(self, frame: Frame) -> Array:
        """
        Return ``T_base_frame`` on the model.

        Raises
        ------
        DataError
            The program gives no numbers for it, nor does anybody else.

        """
        given = self.bases.get(frame.name.lower())
        if given is not None:
            return np.asarray(self.origin @ given)
        if frame.value is not None:
            return np.asarray(self.origin @ frame.value)
        if not frame.name:
            return self.origin
        raise DataError(
            f'the numbers of base {frame.name} are not in the program; give them with '
            f"--base '{frame.name}=X,Y,Z,...'"
        )

    def _note(self, text: str) -> None:
        if text not in self.notes:
            self.notes.append(text)


def controller_of(
    robot: Robot,
    language: str,
    tools: Mapping[str, Array] | None = None,
    bases: Mapping[str, Array] | None = None,
) -> Controller:
    """
    Return the frames of the controller that runs a language on a robot.

    Parameters
    ----------
    robot : Robot
    language : str
        Each maker's controller runs its own, on its own robots; on others nothing is assumed.
    tools, bases : mapping of str to array, optional
        Frames that were given, shape (4, 4) [m].

    """
    frames, name = controller_frames(robot), bundled_name(robot)
    origin, mix, notes = np.array(frames.base), np.eye(robot.n), _linked(frames)
    begin, maker = AT_SECOND_AXIS.get(language, ('none', ''))
    if name.startswith(begin):
        if robot.controller is None:
            origin[2, 3] = robot.d[0]
            notes.append(
                f'positions count from the origin of {maker}, {robot.d[0]:.4g} m above the floor'
            )
        if language == COUPLED:
            mix[2, 1] = 1.0
            notes.append('J3 counts from the ground, as the teach pendant shows it')
    elif language == COUPLED and robot.controller is not None:
        notes.append(
            'J3 is taken as the joint of the robot file; if the teach pendant counts it from the '
            'ground, points in joints are read wrongly'
        )
    own = np.array(robot.T_flange_tool)
    return Controller(
        origin, np.array(frames.flange), mix, own, _lower(tools), _lower(bases), notes
    )


def _lower(frames: Mapping[str, Array] | None) -> dict[str, Array]:
    return {name.lower(): value for name, value in (frames or {}).items()}


def _linked(frames: ControllerFrames) -> list[str]:
    """Return which links of a URDF were taken for the controller's base and flange."""
    if not frames.base_link:
        return []
    return [
        f'positions count from link {frames.base_link!r} of the URDF, and tools from link '
        f'{frames.flange_link!r}; --base-link and --flange-link choose others'
    ]
