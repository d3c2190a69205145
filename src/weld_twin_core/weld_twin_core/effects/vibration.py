# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Vibration: x'' + 2 damping w x' + w^2 x = -gain theta'', theta -> theta + x, w = 2 pi frequency.

A command that is straight between samples accelerates in kicks at the samples only, so the
response is a free decay between kicks: one complex number z per joint, x = Im z.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from .associative_scan import linear
from .effect import Effect, FitHooks, Hooked, MemoryEffect, Traits, register
from .view import Array, Parameter, Robot, Shift, Stage, Value, View

_FREQUENCIES = np.geomspace(1.0, 40.0, 64)
"""Modes [Hz] that a fit may start from, and"""
_DAMPINGS = (0.03, 0.08, 0.25)
"""their dampings."""
_HIGHEST = 0.4
"""Frequency times the step in time of the joint stream that a search goes up to."""


class _Fit(FitHooks):
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
            for z in _DAMPINGS
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

    name = 'vibration'
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
    fit = Hooked(_Fit)

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
