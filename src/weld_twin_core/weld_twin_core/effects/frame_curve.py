# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Frame curve: base or tool moved along a curve that was measured, not derived."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arm.channels import Channel, Shift
from ..arm.robot import Robot
from ..arrays import Array
from ..errors import ModelError
from .curve import QUANTITIES, basis, check_knots
from .effect import Effect
from .hooks import Traits
from .registry import register
from .view import Parameter, Stage, Value, View

_FRAMES = ('base', 'tool')
_OVER = ('constant', 'temperature', 'time')


@register
@dataclass(frozen=True, eq=False)
class FrameCurve(Effect):
    """
    A spline over temperature or time, through ``xyz`` [m] and ``rotvec`` [rad] at ``knots``.

    ``over`` may be 'constant', with one knot. Both hold one value for each knot and axis, all
    knots of the first axis first. It stands for causes that nobody has a formula for; a diagnosis
    does not name it as a cause.
    """

    xyz: Value = (0.0,) * 6
    rotvec: Value = (0.0,) * 6
    knots: Sequence[float] = (0.0, 1.0)
    over: str = 'time'
    frame: str = 'base'

    name = 'frame_curve'
    traits = Traits(title='measured motion', entered='program', depends_on='time', cause=False)
    of = 'robot'
    stage = Stage.LINK
    parameters = (
        Parameter('xyz', 'm', size=0, typical=1e-4),
        Parameter('rotvec', 'rad', size=0, typical=1e-4),
    )
    options = ('knots', 'over', 'frame')

    def check(self, robot: Robot) -> None:
        """Refuse an unknown frame or quantity, and knots that do not increase."""
        super().check(robot)
        for part in (self.xyz, self.rotvec):
            count = np.shape(part)[-1]
            check_knots(self.name, self.over, self.knots, count // 3 if count % 3 == 0 else -1)
        if self.frame not in _FRAMES or self.over not in _OVER:
            raise ModelError(
                f'{self.name}: frame must be base or tool and over constant, temperature or time, '
                f'got {self.frame!r} and {self.over!r}'
            )

    @property
    def at(self) -> str:
        """Return the frame."""
        return self.frame

    @property
    def on(self) -> str:
        """Return what the curve runs over."""
        return self.over

    def displace(self, view: View) -> Shift:
        """Return the curves on the six components of the frame."""
        weights = basis(self.knots, QUANTITIES[self.over](view, 0))
        out: dict[Channel, Array] = {}
        for at, part in enumerate((self.xyz, self.rotvec)):
            values = np.asarray(part, dtype=np.float64)
            values = values.reshape(*values.shape[:-1], 3, len(self.knots))
            for axis in range(3):
                curve = np.tensordot(values[..., axis, :], weights, axes=(-1, 0))
                out[self.frame, 3 * at + axis] = curve
        return out

    def gradient(self, view: View) -> list[Shift | None]:
        """Return how much the value at each knot counts, for every axis."""
        weights = basis(self.knots, QUANTITIES[self.over](view, 0))
        return [{(self.frame, axis): row} for axis in range(6) for row in weights]

    def remedy(self, robot: Robot) -> str:
        return (
            f'Look at the {self.at}: it moves over the {self.on} in a way that no known effect '
            'gives.'
        )
