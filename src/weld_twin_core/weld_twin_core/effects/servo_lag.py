# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How a drive follows its command: a lag of first order, tau y' + y = theta, and vibration.

A position loop round a velocity loop has inertia beside its gains and can swing. With ``damping``
given the lag is that of second order with the same trail on a ramp,

    y'' / w^2 + tau y' + y = theta,  w = 2 damping / tau,

whose two poles run as one linear recursion each.

A joint that vibrates adds x to theta,

    x'' + 2 damping w x' + w^2 x = -gain theta'',  w = 2 pi frequency.

A command that is straight between samples accelerates in kicks at the samples only, so the
response is a free decay between kicks: one complex number z per joint, x = Im z.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import ModelError
from .associative_scan import linear
from .effect import Effect, FitHooks, Hooked, MemoryEffect, Traits, register
from .view import Array, Parameter, Robot, Shift, Stage, Value, View
from .wording import size

_DAMPINGS = (0.3, 0.4, 0.55, 0.75)
"""Dampings of loops that a search starts from; a stiffer one hardly differs from first order."""
_SWINGING = 0.35
"""Share of the usual misfit that is left where inertia is in the formula: on a servo axis (the
recording EMPS) a lag of first order beside friction misses 1.8 % of the trail, a loop that swings
0.4 %; a little more for arms, whose inertia changes."""
_APART = 1e-6
"""Distance of a damping from one at the least: there the two poles meet."""
_SHORTEST = 1e-9
"""Time constant [s] that a loop has at the least."""


class _Fit(FitHooks):
    effect: ServoLag

    @property
    def searched(self) -> bool:
        """Return whether it swings: a fit from another damping ends beside the best."""
        return self.effect.damping is not None

    @property
    def ideal(self) -> float:
        """Return less for a loop that swings: its inertia is in the formula."""
        return 1.0 if self.effect.damping is None else _SWINGING

    def starts(self, view: View, zoom: int) -> tuple[list[Any], Array] | None:
        """Return the loop at all dampings, and then at those close to the best."""
        if self.effect.damping is None or view.static or zoom == 2:
            return None
        i = view.robot.index(self.effect.joint)
        near = (
            np.geomspace(0.2, 1.5, 9)
            if zoom == 0
            else self.effect.damping * np.geomspace(0.9, 1.1, 9)
        )
        each = [replace(self.effect, damping=float(damping)) for damping in near]
        return each, np.stack([lag.run(view)[0]['q', i] for lag in each])


@register
class ServoLag(MemoryEffect):
    """
    The joint trails its command; exact for a command that is straight between samples.

    ``damping`` is that of a loop of second order; None is a lag of first order.
    """

    joint: str
    time_constant: Value = 0.0
    damping: float | None = None

    traits = Traits(
        title='servo lag',
        meaning='the drive trails behind its command',
        formula='τ ẏ + y = θ, exact for a command straight between samples; with `damping` ζ a '
        'loop that swings, ÿ / ω² + τ ẏ + y = θ, ω = 2 ζ / τ',
        entered="the drive's gains and feed-forward",
        depends_on='speed',
    )
    of = 'joint'
    stage = Stage.SERVO
    parameters = (
        Parameter('time_constant', 's', typical=5e-3, lower=0.0, linear=False).plausible(
            (2e-2, 0.0, 0.3),
            'derived: the loop of a machine that follows a path closes within 0.3 s',
        ),
    )
    options = ('damping',)
    needs = frozenset({'velocity', 'time'})
    fit = Hooked(_Fit)

    def _trail(self, dt: Array, change: Array, x0: Array) -> tuple[Array, Array, Array]:
        """
        Return output minus input of the lag of first order, shape (..., N).

        x_k = decay x_{k-1} - weight change_k; the decay over each step in time and the weight of
        the input's change over it come along.
        """
        tau = np.maximum(self.number('time_constant'), 1e-12)
        decay = np.exp(-dt / tau)
        weight = np.where(dt > 0.0, -np.expm1(-dt / tau) * tau / np.where(dt > 0.0, dt, 1.0), 1.0)
        return linear(decay, -weight * change, x0), decay, weight

    def run(self, view: View, state: Any = None) -> tuple[Shift, Any]:
        """Return output minus input."""
        q = self._theta(view)
        if view.static:
            return self._moves(view, np.zeros_like(q)), None
        if self.damping is not None:
            trail, state = self._swing(view.t, q, state)
            return self._moves(view, trail), state
        t0, q0, x0 = (view.t[0], q[..., 0], np.zeros(q.shape[:-1])) if state is None else state
        dt = np.diff(view.t, prepend=t0)
        change = np.diff(q, axis=-1, prepend=np.asarray(q0)[..., None])
        x, _, _ = self._trail(dt, change, x0)
        return self._moves(view, x), (view.t[-1], q[..., -1], x[..., -1])

    def check(self, robot: Robot) -> None:
        """Refuse a loop that does not come to rest."""
        super().check(robot)
        if self.damping is not None and not 0.05 <= float(self.damping) <= 20.0:
            raise ModelError(
                f'servo_lag: damping must be between 0.05 and 20, got {self.damping!r}; leave it '
                'out for a lag of first order'
            )

    def _poles(self) -> tuple[Array, Array]:
        zeta = float(self.damping or 1.0)
        zeta += _APART * (abs(zeta - 1.0) < _APART)
        w = 2.0 * zeta / np.maximum(self.number('time_constant'), _SHORTEST)
        root = np.sqrt(complex(zeta**2 - 1.0))
        return w * (-zeta + root), w * (-zeta - root)

    def _swing(self, t: Array, q: Array, state: Any) -> tuple[Array, Any]:
        """
        Return output minus input of the loop of second order, and what to carry.

        On a straight segment what is beside the trail swings freely; each pole has its share of
        it, and every kink of the command kicks both.
        """
        tau = np.maximum(self.number('time_constant'), _SHORTEST)
        one, other = self._poles()
        rest = np.zeros(q.shape[:-1], complex)
        t0, q0, rate0, a0, b0 = state or (t[0], q[..., 0], 0.0 * q[..., 0], rest, rest)
        dt = np.diff(t, prepend=t0)
        change = np.diff(q, axis=-1, prepend=np.asarray(q0)[..., None])
        before = np.broadcast_to(np.asarray(rate0)[..., None], change[..., :1].shape)
        rate = np.where(dt > 0.0, change / np.where(dt > 0.0, dt, 1.0), 0.0)
        rate = np.where(dt > 0.0, rate, np.concatenate([before, rate[..., :-1]], axis=-1))
        kick = np.diff(rate, axis=-1, prepend=before)
        a = linear(np.exp(one * dt), -np.exp(one * dt) * (1.0 + other * tau) * kick, a0)
        b = linear(np.exp(other * dt), -np.exp(other * dt) * (1.0 + one * tau) * kick, b0)
        free = ((a - b) / (one - other)).real
        return free - tau * rate, (t[-1], q[..., -1], rate[..., -1], a[..., -1], b[..., -1])

    def gradient(self, view: View) -> list[Shift | None]:
        """Return dx/dtau by the recursion's own derivative; of a loop, by differences."""
        if self.damping is not None and not view.static:
            return super().gradient(view)
        q = self._theta(view)
        if view.static:
            return [self._moves(view, np.zeros_like(q))]
        tau = np.maximum(self.number('time_constant'), 1e-12)
        dt = np.diff(view.t, prepend=view.t[0])
        change = np.diff(q, axis=-1, prepend=q[..., :1])
        x, decay, weight = self._trail(dt, change, np.zeros(q.shape[:-1]))
        before = np.concatenate([np.zeros_like(x[..., :1]), x[..., :-1]], axis=-1)
        d_decay = decay * dt / tau**2
        d_weight = np.where(dt > 0.0, weight / tau - decay / tau, 0.0)
        slope = linear(decay, d_decay * before - d_weight * change, np.zeros(x.shape[:-1]))
        return [self._moves(view, slope)]

    def push(self, view: View, tangent: Array) -> Array:
        """Filter the tangent like the motion itself; the lag is linear in its input."""
        if view.static:
            return tangent
        if self.damping is not None:
            return np.asarray(tangent + self._swing(view.t, tangent, None)[0])
        dt = np.diff(view.t, prepend=view.t[0])
        change = np.diff(tangent, axis=-1, prepend=tangent[..., :1])
        return tangent + self._trail(dt, change, np.zeros(tangent.shape[:-1]))[0]

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> list[ServoLag]:
        """Return a fast and a slow lag; between them the response is nearly proportional."""
        if view.static:
            return []
        plain = [cls(str(joint), tau) for tau in (2e-3, 3e-2)]
        return plain + [cls(str(joint), 1e-2, damping) for damping in _DAMPINGS]

    def atoms(self, view: View) -> list[Shift]:
        return [{key: value / self.time_constant for key, value in self.displace(view).items()}]

    def remedy(self, robot: Robot) -> str:
        return (
            f'Give the controller of {self.site} more feed-forward, or record measured in place of '
            f'commanded joints: it lags by {size(self._plain("time_constant") * 1e3)} ms.'
        )


_FREQUENCIES = np.geomspace(1.0, 40.0, 64)
"""Modes [Hz] that a fit may start from, and"""
_VIBRATING = (0.03, 0.08, 0.25)
"""their dampings."""
_HIGHEST = 0.4
"""Frequency times the step in time of the joint stream that a search goes up to."""


class _VibrationFit(FitHooks):
    effect: Vibration

    def starts(self, view: View, zoom: int) -> tuple[list[Effect], Array] | None:
        """
        Return modes of all frequencies and dampings: far from the mode the fit has other optima.

        On evenly spaced stamps, on which the recursion is a plain filter.
        """
        if zoom or view.static or view.t.size < 3:
            return None
        step = float(np.median(np.diff(view.t)))
        t = np.arange(view.t[0], view.t[-1] + step, step)
        q = np.interp(t, view.t, view.joint(view.robot.index(self.effect.joint)))
        kick = np.concatenate([np.zeros(2), np.diff(q, n=2)]) / step
        modes = [
            Vibration(self.effect.joint, float(f), z, 1.0)
            for f in _FREQUENCIES[_FREQUENCIES * step < _HIGHEST]
            for z in _VIBRATING
        ]
        poles, damped = (np.array(part) for part in zip(*(m._mode() for m in modes), strict=True))
        response = _ringing(np.exp(poles * step), damped, kick)
        return list(modes), np.stack([np.interp(view.t, t, own) for own in response])


@register
class Vibration(MemoryEffect):
    """Damped oscillation of one joint, excited by its acceleration; gain 1 is a free end."""

    joint: str
    frequency: Value = 10.0
    damping: Value = 0.05
    gain: Value = 0.0

    traits = Traits(
        title='vibration',
        meaning='a joint swings after it was accelerated',
        formula='ẍ + 2 damping ω ẋ + ω² x = −gain θ̈, ω = 2π frequency; θ → θ + x',
        entered='how the motion is planned, and of stiffness',
        depends_on='acceleration',
    )
    of = 'joint'
    stage = Stage.SERVO
    parameters = (
        Parameter(
            'frequency', 'Hz', typical=10.0, lower=1e-3, linear=False, idealised=0.015
        ).plausible(
            (np.inf, 1.0, 100.0), 'derived: softer is a swing, stiffer does not reach the tool'
        ),
        Parameter(
            'damping', '-', typical=0.05, lower=0.0, upper=0.999, linear=False, idealised=0.03
        ).plausible(
            (np.inf, 1e-3, 0.7), 'derived: steel rings longest at 0.001; beyond 0.7 nothing swings'
        ),
        Parameter('gain', '-', typical=0.3, idealised=0.04).plausible(
            (1.0, 5.0), 'derived: one is the whole inertia on one spring'
        ),
    )
    needs = frozenset({'velocity', 'time'})
    fit = Hooked(_VibrationFit)

    def _mode(self) -> tuple[Array, Array]:
        """Return the complex pole and the damped angular frequency [1/s]."""
        w = 2.0 * np.pi * self.number('frequency')
        damped = w * np.sqrt(1.0 - self.number('damping') ** 2)
        return -self.number('damping') * w + 1j * damped, damped

    def _response(
        self, view: View, q: Array, state: Any = None
    ) -> tuple[Array, Array, Array, Array, Any]:
        """Return the response z of gain 1 to motion, its decay, steps and kicks, and the state."""
        rest = np.zeros(q.shape[:-1], complex)
        # The velocity before the first step is not known; NaN marks it, and it kicks nothing.
        start = (view.t[0], q[..., 0], np.full(q.shape[:-1], np.nan), rest)
        t0, q0, rate0, z0 = start if state is None else state
        dt = np.diff(view.t, prepend=t0)
        change = np.diff(q, axis=-1, prepend=np.asarray(q0)[..., None])
        before = np.asarray(rate0)[..., None]
        rate = np.where(dt > 0.0, change / np.where(dt > 0.0, dt, 1.0), before)
        kick = np.nan_to_num(np.diff(rate, axis=-1, prepend=before))
        pole, damped = self._mode()
        decay = np.exp(pole * dt)
        z = linear(decay, -decay * kick / damped, z0)
        return z, decay, dt, kick, (view.t[-1], q[..., -1], rate[..., -1], z[..., -1])

    def run(self, view: View, state: Any = None) -> tuple[Shift, Any]:
        if view.static:
            return self._moves(view, np.zeros_like(self._theta(view))), None
        z, _, _, _, state = self._response(view, self._theta(view), state)
        return self._moves(view, self.number('gain') * z.imag), state

    def gradient(self, view: View) -> list[Shift | None]:
        if view.static:
            zero: list[Shift | None] = [self._moves(view, np.zeros_like(self._theta(view)))] * 3
            return zero
        z, decay, dt, kick, _ = self._response(view, self._theta(view))
        zeta, gain, turn = self.number('damping'), self.number('gain'), 2.0 * np.pi
        pole, damped = self._mode()
        w, root = turn * self.number('frequency'), np.sqrt(1.0 - zeta**2)
        out: list[Shift | None] = []
        for d_pole, d_log_damped in (
            (pole / w * turn, turn / w),
            (w * (-1.0 - 1j * zeta / root), -zeta / root**2),
        ):
            drive = decay * kick / damped * d_log_damped + dt * d_pole * z
            out.append(self._moves(view, gain * linear(decay, drive, np.zeros(z.shape[:-1])).imag))
        return [*out, self._moves(view, z.imag)]

    def push(self, view: View, tangent: Array) -> Array:
        if view.static:
            return tangent
        return np.asarray(tangent + self.number('gain') * self._response(view, tangent)[0].imag)

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> Iterable[Effect]:
        """Yield modes from 2 to 40 Hz, as far as the joint stream's rate can show them."""
        if view.static or view.t.size < 3:
            return
        highest = _HIGHEST / float(np.median(np.diff(view.t)))
        for frequency in np.geomspace(2.0, 40.0, 22):
            if frequency < highest:
                yield cls(str(joint), float(frequency), 0.05, 0.0)

    def atoms(self, view: View) -> list[Shift]:
        """Return both quadratures of the response, so that frequency may be a little off."""
        z = self._response(view, self._theta(view))[0]
        return [self._moves(view, z.imag), self._moves(view, z.real)]

    def from_atoms(self, coefficients: Array) -> Vibration:
        """Return the mode whose gain is the in-phase coefficient."""
        return Vibration(self.joint, self.frequency, self.damping, float(coefficients[0]))

    def remedy(self, robot: Robot) -> str:
        return (
            f'Limit the jerk of {self.site}, or shape its motion for '
            f'{self._plain("frequency"):.3g} Hz (damping {self._plain("damping"):.2g}); look '
            'for a loose mount.'
        )


def _ringing(decay: Array, damped: Array, kick: Array) -> Array:
    """Return the responses of many modes to even kicks, shape (modes, N): sample by sample, all."""
    z, out = np.zeros(decay.shape, complex), np.empty((kick.size, decay.size))
    gain = -decay / damped
    for k, push in enumerate(kick):
        z = decay * z + gain * push
        out[k] = z.imag
    return np.ascontiguousarray(out.T)
