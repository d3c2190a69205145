# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
r"""
Parts that rub: friction, and the loop of hysteresis, both by bristles that bend and let go.

Friction winds the drive up, theta -> theta - windup (z + asymmetry u). A position loop needs an error
to make the torque that friction takes: Coulomb friction over the stiffness of the loop, against the
motion. z goes from -1 to 1 with the bristles between the parts that rub: they bend over ``travel``
after every reversal (pre-sliding), and let go within ``release`` once the joint rests, by creep and
by the integral action of the loop. Slow motion makes up for what lets go, so that z is the sign of
the motion, soft below travel / release. u is the same whichever way the joint moves: one while it
does, and gone once it rests. Viscous friction does what a lag does, and is `servo_lag`. A loop that
never lets go trails as play does, and is reported as `backlash`.

A loop with integral action takes the wind-up back while the joint moves, too, at the rate
``recovery``: what is left is a bump behind every reversal (the quadrant glitch of machine tools) and
behind every start. There the joint rests where it stuck, so that its bristles hold.

Hysteresis is a loop of lost motion that closes over a travel, as in a strain-wave gear. Teeth and
flexspline rub over many contacts that let go one after the other. The output trails by ``amplitude``
times z, which forgets where it came from over ``travel``:

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
from dataclasses import replace
from typing import Any

import numpy as np

from .associative_scan import bristle, bristle_tangent, linear
from .effect import Effect, FitHooks, Hooked, MemoryEffect, Traits, register
from .view import Array, Parameter, Robot, Shift, Stage, Value, View

_SHORTEST, _LONGEST = 3e-5, 1.8e-3
"""Pre-sliding travels [rad] that a search considers: a longer one is a loop, `hysteresis`."""
_UNEVEN = 0.6
"""Asymmetry beyond which one direction would hardly rub at all. A judgement."""
_A_LITTLE = 1e-9
"""Asymmetry of friction that may become uneven in a fit."""
_HELD = 1e3
"""Time [s] in which bristles let go that hold: none of a recording's rests is as long."""
_RECOVERIES = (0.5, 2.0, 8.0, 32.0)
"""Rates [1/s] of integral action that a search considers: slower than 2 s trails as play does."""


class _Fit(FitHooks):
    effect: Friction

    def fitted(self) -> list[int]:
        """Return wind-up and travel, and asymmetry and recovery where there is any."""
        more = [] if self.effect._even else [1]
        return sorted([0, 2, *more, *([3] if self.effect._recovers else [])])

    def with_coordinates(self, values: Array) -> Any:
        """Return the same at other fit coordinates; a loop that recovers goes on doing so."""
        found = super().with_coordinates(values)
        slow = self.effect._recovers and found.number('recovery') < _RECOVERIES[0]
        return replace(found, recovery=_RECOVERIES[0]) if slow else found

    def starts(self, view: View, zoom: int) -> tuple[list[Any], Array] | None:
        """Return friction of all travels and recoveries: a start far off ends beside the best."""
        if zoom or view.static:
            return None
        unit = view.radian(view.robot.index(self.effect.joint))
        rates = np.array(_RECOVERIES if self.effect._recovers else (0.0,))
        travels, rates = (
            grid.ravel()
            for grid in np.meshgrid(unit * np.geomspace(_SHORTEST, _LONGEST, 7), rates)
        )
        each = [
            replace(self.effect, windup=1.0, travel=float(travel), recovery=float(rate))
            for travel, rate in zip(travels, rates, strict=True)
        ]
        many = replace(self.effect, windup=1.0, travel=travels, recovery=rates)
        return each, many.run(view)[0]['q', view.robot.index(self.effect.joint)]


@register
class Friction(MemoryEffect):
    """
    Lost motion that is there while the joint moves and goes when it rests.

    Going up the joint trails by windup (1 + asymmetry), going down by windup (1 - asymmetry).
    Friction that is even stays so in a fit, and so does a loop without integral action.
    """

    joint: str
    windup: Value = 0.0
    asymmetry: Value = 0.0
    travel: Value = 3e-4
    release: float = 0.3
    recovery: Value = 0.0

    traits = Traits(
        title='friction',
        meaning='a joint lags behind while it moves, and gives that up when it rests',
        formula='θ → θ − windup (z + asymmetry u), ż = (sign θ̇ − z) abs(θ̇) / travel − z / '
        'release, u̇ = (1 − u) abs(θ̇) / travel − u / release, both 0 at first; a loop that '
        'takes it back loses what it trails by at `recovery`',
        apart={'backlash': 'push the link to and fro while the motor holds: only play gives way'},
        entered="the joint's gear, bearings and grease",
        depends_on='direction',
        changes_in_use=True,
        common=False,
        by_motion=True,
    )
    of = 'joint'
    stage = Stage.PLAY
    parameters = (
        Parameter('windup', 'rad', typical=2e-4, lower=0.0, idealised=0.03)
        .plausible(
            (2e-4, 0.0, 5e-3),
            'derived: a loop of 10 Hz lets a robot joint trail by tenths of a milliradian; range '
            'derived: a third of a degree stops a motion',
        )
        .plausible_sliding(
            (2e-5, 0.0, 1e-3),
            'a servo axis trails by 11.8 um (recording EMPS, docs/transfer.md); range derived: a '
            'millimetre is stuck',
        ),
        Parameter(
            'asymmetry', '-', typical=0.1, lower=-_UNEVEN, upper=_UNEVEN, linear=False
        ).plausible(
            (0.2, 0.6),
            'a servo axis trails by 11.8 um with 2.3 um between its two ways (recording EMPS, '
            'docs/transfer.md), 0.2; range derived: beyond, one way hardly rubs at all',
        ),
        Parameter('travel', 'rad', typical=3e-4, lower=1e-7, linear=False, idealised=0.3)
        .plausible(
            (1e-3, 1e-6, 2e-3),
            'derived: contacts of bearings and seals bend by micrometres on centimetres; a longer '
            'travel is a loop of the gear, hysteresis',
        )
        .plausible_sliding(
            (1e-4, 1e-7, 2e-4),
            'derived: rolling guides bend by micrometres to a tenth of a millimetre',
        ),
        Parameter(
            'recovery', '1/s', typical=2.0, lower=0.0, linear=False, idealised=0.3
        ).plausible(
            (20.0, 0.0, 200.0),
            'derived: integral times of servo loops are some milliseconds to some seconds',
        ),
    )
    options = ('release',)
    needs = frozenset({'velocity', 'time'})
    fit = Hooked(_Fit)

    def _bent(self, view: View, state: Any) -> tuple[Array, Array, Array, Any]:
        """Return z and u stacked, shape (..., 2, N), the steps, what is lost, what to carry."""
        q = self._theta(view)
        travel = self.number('travel')[..., None]
        samples = np.broadcast_shapes(q.shape[:-1], travel.shape[:-2])
        start = (view.t[0], q[..., 0], np.zeros((*samples, 2)))
        t0, before, z0 = start if state is None else state
        step = np.diff(q, axis=-1, prepend=np.asarray(before)[..., None])
        lost = np.diff(view.t, prepend=t0) / self.release
        both = np.stack([step, np.abs(step)], axis=-2)
        z = bristle(both, travel, lost, z0)
        return z, both, lost, (view.t[-1], q[..., -1], z[..., -1])

    def _left(self, bent: Array, lost: Array, before: Any = (0.0, 0.0)) -> Array:
        """Return what a loop leaves of bends (..., 2, N), from the last of both that were before."""
        if not self._recovers:
            return bent
        last, left = before
        rate = self.number('recovery')[..., None]
        kept = np.exp(-rate * self.release * lost)
        step = np.diff(bent, axis=-1, prepend=np.broadcast_to(last, bent.shape[:-1])[..., None])
        return linear(kept, kept * step, np.broadcast_to(left, bent.shape[:-1]))

    def run(self, view: View, state: Any = None) -> tuple[Shift, Any]:
        """Return minus the wind-up, larger in the direction that rubs more."""
        if view.static:
            return self._moves(view, np.zeros_like(self._theta(view))), None
        bends, left = (None, (0.0, 0.0)) if state is None else state
        z, _, lost, bends_after = self._bent(view, bends)
        after = self._left(z, lost, left)
        state = bends_after, (z[..., -1], after[..., -1])
        return self._moves(view, -self.number('windup') * self._mixed(after)), state

    def _mixed(self, both: Array) -> Array:
        """Return the even part and the asymmetry's share of the uneven one, shape (..., N)."""
        return np.asarray(both[..., 0, :] + self.number('asymmetry') * both[..., 1, :])

    def gradient(self, view: View) -> list[Shift | None]:
        if view.static:
            return [self._moves(view, np.zeros_like(self._theta(view)))] * 4
        z, both, lost, _ = self._bent(view, None)
        travel = self.number('travel')[..., None]
        slope = bristle_tangent(both, travel, lost, z, -np.abs(both) / travel**2)
        left, slope = self._left(z, lost), self._left(slope, lost)
        # What is left falls by itself in every step of time: the same recursion, driven by it.
        step = self.release * lost
        rate = self.number('recovery')[..., None]
        fallen = linear(np.exp(-rate * step), -step * left, np.zeros(left.shape[:-1]))
        windup = self.number('windup')
        parts = (left, windup * slope, windup * fallen)
        even, bent, rated = (-self._mixed(part) for part in parts)
        return [self._moves(view, each) for each in (even, -windup * left[..., 1, :], bent, rated)]

    def push(self, view: View, tangent: Array) -> Array:
        """Add how the bristles follow the tangent's own steps."""
        if view.static:
            return tangent
        z, both, lost, _ = self._bent(view, None)
        travel = self.number('travel')[..., None]
        own = np.diff(tangent, axis=-1, prepend=tangent[..., :1])[..., None, :]
        change = np.where(both[..., :1, :] < 0.0, -own, own) / travel
        slope = self._left(bristle_tangent(both, travel, lost, z, change), lost)
        return np.asarray(tangent - self.number('windup') * self._mixed(slope))

    @property
    def _even(self) -> bool:
        return np.ndim(self.asymmetry) == 0 and self.asymmetry == 0.0

    @property
    def _recovers(self) -> bool:
        return bool(np.any(np.asarray(self.recovery) > 0.0))

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """Yield friction of short and long pre-sliding, even and uneven, and loops that recover."""
        unit = view.radian(view.robot.index(str(joint)))
        for travel in (1e-4, 6e-4):
            for asymmetry in (0.0, _A_LITTLE):
                yield cls(str(joint), 0.0, asymmetry, travel * unit)
        for recovery in _RECOVERIES:
            yield cls(str(joint), 0.0, 0.0, 3e-4 * unit, _HELD, recovery)

    def atoms(self, view: View) -> list[Shift]:
        """Return the even part, and the uneven one where there is any: both are linear."""
        parts = range(1 if self._even else 2)
        if view.static:
            # As many as in motion, so that stations and paths can be diagnosed together.
            return [self._moves(view, np.zeros_like(self._theta(view))) for _ in parts]
        z, _, lost, _ = self._bent(view, None)
        left = self._left(z, lost)
        return [self._moves(view, -left[..., k, :]) for k in parts]

    def from_atoms(self, coefficients: Array) -> Friction:
        """Return the wind-up of the even part; what the uneven part is of it is the asymmetry."""
        windup = max(float(coefficients[0]), 0.0)
        asymmetry = 0.0
        if len(coefficients) > 1:
            uneven = float(coefficients[1]) / windup if windup > 0.0 else 0.0
            asymmetry = float(np.clip(uneven, -_UNEVEN, _UNEVEN)) or _A_LITTLE
        return replace(self, windup=windup, asymmetry=asymmetry)

    def remedy(self, robot: Robot) -> str:
        return (
            f'Give the controller of {self.site} feed-forward against friction, and see to its '
            f'lubrication: in motion it trails by {self._travelled(robot, self._plain("windup"))}.'
        )


_SHORTEST_LOOP, _LONGEST_LOOP = 4e-3, 0.3
"""Travels [rad] that a search considers: shorter is a gap, longer a wrong gear ratio."""


class _LoopFit(FitHooks):
    effect: Hysteresis

    def starts(self, view: View, zoom: int) -> tuple[list[Any], Array] | None:
        """Return loops of all travels: a start that is far off ends beside the best."""
        if zoom:
            return None
        i = view.robot.index(self.effect.joint)
        travels = view.radian(i) * np.geomspace(_SHORTEST_LOOP, _LONGEST_LOOP, 10)
        z = Hysteresis(self.effect.joint, 1.0, travels)._loop(view.joint(i), None)[0]
        return [Hysteresis(self.effect.joint, 1.0, float(travel)) for travel in travels], -z


@register
class Hysteresis(MemoryEffect):
    """The joint trails by ``amplitude`` once it has moved far one way; at first it does not."""

    joint: str
    amplitude: Value = 0.0
    travel: Value = 0.03

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
    fit = Hooked(_LoopFit)

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
