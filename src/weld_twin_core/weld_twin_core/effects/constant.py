# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What constant errors have in common: they displace one channel, or a frame, and never change."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ..arm.channels import Channel, Shift
from ..arm.robot import Robot
from ..arrays import Array
from .effect import Effect
from .view import Parameter, Plausible, Stage, View, single
from .wording import metres, radians


class ChannelError(Effect):
    """A constant error of one channel of one joint or row; the parameter displaces it."""

    channel: ClassVar[str]
    off: ClassVar[str] = 'it is off by'
    """How a robot file is wrong that lacks it."""

    def remedy(self, robot: Robot) -> str:
        """Return which number of the robot file to mend; see `Effect.remedy`."""
        error = self._plain(self.parameters[0].name)
        now = float(getattr(robot, self.channel)[robot.index(str(self.site))])
        if self.channel in ('a', 'd'):
            old, new = f'{now * 1e3:.3f} mm', f'{(now + error) * 1e3:.3f} mm'
        else:
            old, new = f'{np.degrees(now):.4f} deg', f'{np.degrees(now + error):.4f} deg'
        by = metres(error) if self.channel in ('a', 'd') else radians(error)
        return (
            f'Enter {self.channel} = {new} for {self.site} in the kinematic model in place of '
            f'{old}: {self.off} {by}.'
        )

    def displace(self, view: View) -> Shift:
        """Return the parameter on the channel."""
        channel = (self.channel, view.robot.index(str(self.site)))
        return single(channel, self.number(self.parameters[0].name), view)

    def gradient(self, view: View) -> list[Shift | None]:
        """Return one: the displacement is the parameter."""
        return [single((self.channel, view.robot.index(str(self.site))), np.ones(()), view)]


def frame_parameters(
    xyz: Plausible, rotvec: Plausible, typical: tuple[float, float] = (5e-4, 1e-3)
) -> tuple[Parameter, ...]:
    """Return the parameters of an error of a frame, with how large each may be."""
    return (
        Parameter('xyz', 'm', size=3, typical=typical[0], range=xyz),
        Parameter('rotvec', 'rad', size=3, typical=typical[1], range=rotvec),
    )


class FrameError(Effect):
    """A constant error of the base or tool frame: a displacement and a turn."""

    channel: ClassVar[str]
    of = 'robot'
    stage = Stage.LINK

    def displace(self, view: View) -> Shift:
        """Return xyz and rotvec on the six components of the frame."""
        out: dict[Channel, Array] = {}
        for k in range(3):
            out |= single((self.channel, k), self.number('xyz', k), view)
            out |= single((self.channel, k + 3), self.number('rotvec', k), view)
        return out

    def gradient(self, view: View) -> list[Shift | None]:
        """Return one for each component."""
        return [single((self.channel, k), np.ones(()), view) for k in range(6)]
