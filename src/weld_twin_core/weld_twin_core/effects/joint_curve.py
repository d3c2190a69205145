# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Joint curve: one value of a joint's row bent by a curve that was measured, not derived."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arm.channels import ROW_CHANNELS, Shift
from ..arm.robot import Robot
from ..arrays import Array
from ..errors import ModelError
from .curve import QUANTITIES, basis, basis_slope, check_knots
from .effect import Effect
from .hooks import FitHooks, Hooked, SearchHooks, Traits, TwinHooks
from .registry import register
from .view import Parameter, Stage, Value, View

_KNOT = 0.1
"""Least distance [rad] of the knots of a joint's curve: ripple of the orders up to ten or so bends
within some tenths of a radian. A joint that travels less has no curve."""
LEAST_KNOTS, MOST_KNOTS = 2, 8
"""Fewest and most intervals of such a curve: one would be a line, more than eight are waves."""


class _Search(SearchHooks):
    kind: type[JointCurve]

    def bend(self, joint: str, angles: Array) -> JointCurve | None:
        """Return a level curve over the angle, None where its knots would be too near."""
        low, high = float(angles.min()), float(angles.max())
        count = min(int((high - low) / _KNOT), MOST_KNOTS)
        if count < LEAST_KNOTS:
            return None
        return self.kind(
            joint, np.zeros(count + 1), tuple(np.linspace(low, high, count + 1).tolist())
        )


class _Fit(FitHooks):
    effect: JointCurve

    def alike(self) -> list[tuple[str, ...]]:
        """Return one label for each joint: every gear is as uneven as it was cut."""
        return [(self.effect.name, self.effect.joint)] * self.coordinates().size


class _Twin(TwinHooks):
    effect: JointCurve

    def off_outside(self) -> float:
        """Return the RMS of a curve over the angle: no formula says how it goes on beyond."""
        if (self.effect.over, self.effect.channel) != ('angle', 'q'):
            return 0.0
        return float(np.sqrt(np.mean(np.square(self.effect.values))))

    def slope(self, view: View) -> Shift:
        """Return the slope of a curve over the angle that bends the joint itself."""
        if (self.effect.over, self.effect.channel) != ('angle', 'q'):
            return {}
        index = view.robot.index(self.effect.joint)
        rise = basis_slope(self.effect.knots, view.joint(index))
        values = np.asarray(self.effect.values, dtype=np.float64)
        return {self.effect._site(view): np.tensordot(values, rise, axes=(-1, 0))}


@register
@dataclass(frozen=True, eq=False)
class JointCurve(Effect):
    """
    A spline over ``over``, through ``values`` at ``knots``, added to ``channel`` of a joint.

    ``over`` is 'angle', 'direction', 'speed', 'load', 'temperature', 'time', or 'constant' with a
    single knot; ``channel`` is 'q', the joint's position, or a value of its row ('theta', 'd', 'a',
    'alpha', 'beta'), whose unit the values have. It stands for causes that nobody has a formula
    for.
    """

    joint: str
    values: Value = (0.0, 0.0)
    knots: Sequence[float] = (-1.0, 1.0)
    over: str = 'angle'
    channel: str = 'q'

    name = 'joint_curve'
    traits = Traits(
        title='measured curve', entered='program', cause=False, by_motion=True, bends=True
    )
    of = 'joint'
    stage = Stage.LINK
    parameters = (Parameter('values', 'rad', size=0, typical=2e-4),)
    options = ('knots', 'over', 'channel')
    search = Hooked(_Search)
    fit = Hooked(_Fit)
    twin = Hooked(_Twin)

    def check(self, robot: Robot) -> None:
        """Refuse an unknown joint, quantity or channel, and knots that do not increase."""
        super().check(robot)
        check_knots(self.name, self.over, self.knots, np.shape(self.values)[-1])
        if self.channel not in ('q', *ROW_CHANNELS):
            raise ModelError(
                f'{self.name}: channel must be one of q, {", ".join(ROW_CHANNELS)}, '
                f'got {self.channel!r}'
            )

    @property
    def on(self) -> str:
        """Return what the curve runs over."""
        return self.over

    def _basis(self, view: View) -> Array:
        index = view.robot.index(self.joint)
        return basis(self.knots, QUANTITIES[self.over](view, index))

    def _site(self, view: View) -> tuple[str, int]:
        return self.channel, view.robot.index(self.joint)

    def displace(self, view: View) -> Shift:
        """Return the curve on the channel."""
        values = np.asarray(self.values, dtype=np.float64)
        return {self._site(view): np.tensordot(values, self._basis(view), axes=(-1, 0))}

    def gradient(self, view: View) -> list[Shift | None]:
        """Return how much the value at each knot counts."""
        return [{self._site(view): row} for row in self._basis(view)]

    def remedy(self, robot: Robot) -> str:
        return (
            f'Look at {self.site}: it is off by a curve over the {self.on} that no known effect '
            'gives.'
        )
