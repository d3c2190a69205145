# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
r"""
Hysteresis: a loop of lost motion that closes over a travel, as in a strain-wave gear.

Teeth and flexspline rub over many contacts that let go one after the other. The output trails by
``amplitude`` times z, which forgets where it came from over ``travel``:

.. math:: \frac{dz}{d\theta} = \frac{1 - z\,\mathrm{sign}(\dot\theta)}{\mathrm{travel}}

That is Dahl's model, and Bouc and Wen's [1]_ with n = 1 and beta = gamma. After a reversal backlash
loses its width at once and nothing more; here the loss builds up, and 95 % are reached after three
travels. On a joint that is straight between samples z is an affine recursion, and so a scan.

References
----------
.. [1] Y.-K. Wen, "Method for random vibration of hysteretic systems", J. Eng. Mech. Div. 102, 1976.

"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from .associative_scan import bristle, bristle_tangent
from .effect import Effect, FitHooks, Hooked, MemoryEffect, Traits, register
from .view import Array, Parameter, Robot, Shift, Stage, Value, View

_SHORTEST, _LONGEST = 4e-3, 0.3
"""Travels [rad] that a search considers: shorter is a gap, longer a wrong gear ratio."""


class _Fit(FitHooks):
    effect: Hysteresis

    def starts(self, view: View, zoom: int) -> tuple[list[Any], Array] | None:
        """Return loops of all travels: a start that is far off ends beside the best."""
        if zoom:
            return None
        i = view.robot.index(self.effect.joint)
        travels = view.radian(i) * np.geomspace(_SHORTEST, _LONGEST, 10)
        z = Hysteresis(self.effect.joint, 1.0, travels)._loop(view.joint(i), None)[0]
        return [Hysteresis(self.effect.joint, 1.0, float(travel)) for travel in travels], -z


@register
class Hysteresis(MemoryEffect):
    """The joint trails by ``amplitude`` once it has moved far one way; at first it does not."""

    joint: str
    amplitude: Value = 0.0
    travel: Value = 0.03

    name = 'hysteresis'
    traits = Traits(
        title='hysteresis',
        meaning='a joint stays behind where it came from, more the farther it came',
        formula='θ → θ − amplitude z, dz/dθ = (1 − z sign θ̇) / travel, z = 0 at first',
        entered="the joint's gear",
        depends_on='direction',
        changes_in_use=True,
        common=False,
        by_motion=True,
    )
    of = 'joint'
    stage = Stage.PLAY
    parameters = (
        Parameter('amplitude', 'rad', typical=2e-4, lower=0.0, idealised=0.03)
        .plausible(
            (2e-4, 0.0, 3e-3),
            'loops of strain-wave joints are 20 arcsec to 1 arcmin wide at 2 % of their torque '
            '(robotics.zhinno.com, robot-joint-backlash-explained); range derived: a gear worn out',
        )
        .plausible_sliding(
            (2e-5, 0.0, 1e-3), 'derived: guides and nuts lose hundredths of a millimetre'
        ),
        Parameter('travel', 'rad', typical=0.03, lower=1e-5, linear=False, idealised=0.3)
        .plausible(
            (0.1, 2e-3, 0.5),
            'derived: a shorter loop is a gap, backlash; a longer one a gear ratio that differs by '
            'direction',
        )
        .plausible_sliding(
            (1e-2, 2e-4, 0.05), 'derived: a shorter loop is a gap, a longer one a wrong scale'
        ),
    )
    needs = frozenset({'order'})
    fit = Hooked(_Fit)

    def _loop(self, q: Array, state: Any) -> tuple[Array, Array, Any]:
        """Return z, the steps, and what to carry."""
        before, z0 = (q[..., 0], np.zeros(q.shape[:-1])) if state is None else state
        step = np.diff(q, axis=-1, prepend=np.asarray(before)[..., None])
        z = bristle(step, self.number('travel'), 0.0, np.asarray(z0))
        return z, step, (q[..., -1], z[..., -1])

    def run(self, view: View, state: Any = None) -> tuple[Shift, Any]:
        """Return minus amplitude times z on the joint, and where it and z were last."""
        z, _, state = self._loop(self._theta(view), state)
        return self._moves(view, -self.number('amplitude') * z), state

    def gradient(self, view: View) -> list[Shift | None]:
        z, step, _ = self._loop(self._theta(view), None)
        travel = self.number('travel')
        slope = bristle_tangent(step, travel, 0.0, z, -np.abs(step) / travel**2)
        return [self._moves(view, -z), self._moves(view, -self.number('amplitude') * slope)]

    def push(self, view: View, tangent: Array) -> Array:
        """Add how the loop follows the tangent's own steps."""
        z, step, _ = self._loop(self._theta(view), None)
        travel = self.number('travel')
        own = np.diff(tangent, axis=-1, prepend=tangent[..., :1])
        change = np.where(step < 0.0, -own, own) / travel
        return tangent - self.number('amplitude') * bristle_tangent(step, travel, 0.0, z, change)

    @classmethod
    def applicable(cls, view: View, joint: str | None) -> str | None:
        """Return why the data cannot show it: at stations the loop has closed, and is backlash."""
        if view.static:
            return 'static stations only show which way a joint came, as backlash does'
        return super().applicable(view, joint)

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        unit = view.radian(view.robot.index(str(joint)))
        for travel in (0.01, 0.04, 0.16):
            yield cls(str(joint), 0.0, travel * unit)

    def atoms(self, view: View) -> list[Shift]:
        return [self._moves(view, -self._loop(self._theta(view), None)[0])]

    def remedy(self, robot: Robot) -> str:
        return (
            f'Compensate the lost motion of {self.site}, or approach seams from one side: it trails '
            f'by {self._travelled(robot, self._plain("amplitude"))} once it has moved '
            f'{self._travelled(robot, 3.0 * self._plain("travel"))} one way; see to its gear if that '
            'grows.'
        )
