# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Bearing tilt: an axis that wobbles, its run-out. The axis leans once per turn of its joint.

The lean is a small turn of the frame that the joint turns in, about that frame's x and y axes,
each a cosine and a sine of the joint's angle. A lean that goes round with the joint is the same
at every angle seen from the link, and is `link_twist`; a bearing with a high spot rocks instead.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arm.channels import Channel, Shift
from ..arrays import Array
from .effect import Effect
from .registry import register
from .view import Parameter, Stage, Value, View


@register
@dataclass(frozen=True, eq=False)
class BearingTilt(Effect):
    """The axis turns about x by lean[0] cos q + lean[1] sin q, and about y by the other two."""

    joint: str
    lean: Value = (0.0, 0.0, 0.0, 0.0)

    name = 'bearing_tilt'
    depends_on = 'angle'
    of = 'joint'
    stage = Stage.LINK
    common = False
    by_motion = True
    parameters = (Parameter('lean', 'rad', size=4, typical=2e-4),)

    def _parts(self, view: View) -> list[Shift]:
        """Return what a lean of one does, for each of the four."""
        i = view.robot.index(self.joint)
        angle = view.joint(i)
        waves = (np.cos(angle), np.sin(angle))
        return [
            {channel: share * wave for channel, share in axis.items()}
            for axis in _axes(view, i)
            for wave in waves
        ]

    def displace(self, view: View) -> Shift:
        """Return the lean of the frame before the joint."""
        out: dict[Channel, Array] = {}
        for k, part in enumerate(self._parts(view)):
            for channel, value in part.items():
                out[channel] = out.get(channel, 0.0) + self.number('lean', k) * value
        return out

    def gradient(self, view: View) -> list[Shift | None]:
        """Return the waves."""
        return list(self._parts(view))

    @classmethod
    def applicable(cls, view: View, joint: str | None) -> str | None:
        """
        Return why the data cannot show it: an axis that slides does not turn.

        Parameters
        ----------
        view : View
            The samples that reach the effect.
        joint : str or None
            The joint it would sit on.

        """
        if joint is not None and view.robot.prismatic[view.robot.index(joint)]:
            return 'a joint that slides has no bearing that turns with it'
        return super().applicable(view, joint)


def _axes(view: View, i: int) -> list[dict[Channel, float]]:
    """Return the channels that turn the frame before joint i about its x and its y."""
    if view.robot.convention == 'modified':
        return [{('alpha', i): 1.0}, {('beta', i): 1.0}]
    if i > 0:
        return [{('alpha', i - 1): 1.0}, {('beta', i - 1): 1.0}]
    axes = view.robot.T_world_base[:3, :2].T
    return [{('base', 3 + k): float(axis[k]) for k in range(3)} for axis in axes]
