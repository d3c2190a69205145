# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Servo lag: first-order lag of the commanded motion, tau y' + y = theta."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arm.channels import Shift
from ..arrays import Array
from .associative_scan import linear
from .effect import MemoryEffect
from .registry import register
from .view import Parameter, Stage, Value, View


@register
@dataclass(frozen=True, eq=False)
class ServoLag(MemoryEffect):
    """The joint trails its command; exact for a command that is straight between samples."""

    joint: str
    time_constant: Value = 0.0

    name = 'servo_lag'
    depends_on = 'speed'
    of = 'joint'
    stage = Stage.SERVO
    parameters = (Parameter('time_constant', 's', typical=5e-3, lower=0.0, linear=False),)
    needs = frozenset({'velocity', 'time'})

    def _coefficients(self, dt: Array) -> tuple[Array, Array]:
        """Return the decay over a step and the weight of the input's change over it."""
        tau = np.maximum(self.number('time_constant'), 1e-12)
        decay = np.exp(-dt / tau)
        weight = np.where(dt > 0.0, -np.expm1(-dt / tau) * tau / np.where(dt > 0.0, dt, 1.0), 1.0)
        return decay, weight

    def run(self, view: View, state: Any = None) -> tuple[Shift, Any]:
        """Return output minus input: x_k = decay x_{k-1} - weight (theta_k - theta_{k-1})."""
        i = view.robot.index(self.joint)
        q = view.joint(i)
        if view.static:
            return {('q', i): np.zeros_like(q)}, None
        t0, q0, x0 = (view.t[0], q[..., 0], np.zeros(q.shape[:-1])) if state is None else state
        dt = np.diff(view.t, prepend=t0)
        change = np.diff(q, axis=-1, prepend=np.asarray(q0)[..., None])
        decay, weight = self._coefficients(dt)
        x = linear(decay, -weight * change, x0)
        return {('q', i): x}, (view.t[-1], q[..., -1], x[..., -1])

    def gradient(self, view: View) -> list[Shift | None]:
        """Return dx/dtau by the recursion's own derivative."""
        i = view.robot.index(self.joint)
        q = view.joint(i)
        if view.static:
            return [{('q', i): np.zeros_like(q)}]
        tau = np.maximum(self.number('time_constant'), 1e-12)
        dt = np.diff(view.t, prepend=view.t[0])
        change = np.diff(q, axis=-1, prepend=q[..., :1])
        decay, weight = self._coefficients(dt)
        x = linear(decay, -weight * change, np.zeros(q.shape[:-1]))
        before = np.concatenate([np.zeros_like(x[..., :1]), x[..., :-1]], axis=-1)
        d_decay = decay * dt / tau**2
        d_weight = np.where(dt > 0.0, weight / tau - decay / tau, 0.0)
        slope = linear(decay, d_decay * before - d_weight * change, np.zeros(x.shape[:-1]))
        return [{('q', i): slope}]

    def push(self, view: View, tangent: Array) -> Array:
        """Filter the tangent like the motion itself; the lag is linear in its input."""
        if view.static:
            return tangent
        dt = np.diff(view.t, prepend=view.t[0])
        change = np.diff(tangent, axis=-1, prepend=tangent[..., :1])
        decay, weight = self._coefficients(dt)
        x: Array = linear(decay, -weight * change, np.zeros(tangent.shape[:-1]))
        return tangent + x

    @classmethod
    def seeds(cls, view: View, joint: str | None, pull: Array | None = None) -> list[ServoLag]:
        """
        Return a fast and a slow lag; between them the response is nearly proportional.

        Parameters
        ----------
        view : View
            The samples that reach the effect.
        joint : str or None
            The joint it would sit on; None for the robot as a whole.
        pull : array, shape (N,), optional
            How strongly the residual would move the joint at every sample [rad or m, up to
            scale].

        """
        return [] if view.static else [cls(str(joint), tau) for tau in (2e-3, 3e-2)]

    def atoms(self, view: View) -> list[Shift]:
        """Return the displacement per second of time constant."""
        return [{key: value / self.time_constant for key, value in self.displace(view).items()}]

    def from_atoms(self, coefficients: Array) -> ServoLag:
        """Return the lag whose time constant is the coefficient, never negative."""
        return ServoLag(self.joint, max(float(coefficients[0]), 0.0))
