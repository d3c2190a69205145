# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The points of a trajectory goal, and the motion that a trajectory controller makes of them."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..arrays import Array, readonly
from ..errors import DataError

_FINE = 0.008
"""Longest step [s] at which a motion is looked at: 125 a second, as controllers are commanded."""
_MOST = 1500
"""Looks at a long motion, so that an hour of it costs no more than 12 s at the finest."""


class Goal(NamedTuple):
    """Points in joint space."""

    t: Array
    """From the start of the goal, shape (N,) [s]; not negative, increasing."""
    q: Array
    """Shape (N, n) [rad or m]."""
    qd: Array | None = None
    qdd: Array | None = None
    """Accelerations only where there are velocities, shape (N, n) [per s, per s^2]."""

    def checked(self, joints: int) -> Goal:
        """Return the goal as finite arrays, its times increasing; DataError where it is none."""
        t = readonly(self.t, (None,), 'time_from_start')
        if t.size == 0:
            raise DataError('the goal has no point')
        if t[0] < 0.0 or (np.diff(t) <= 0.0).any():
            raise DataError('time_from_start must not be negative and must increase')
        shape = (t.size, joints)
        rates = [
            None if value is None else readonly(value, shape, name)
            for value, name in ((self.qd, 'velocities'), (self.qdd, 'accelerations'))
        ]
        bend = None if rates[0] is None else rates[1]
        return Goal(t, readonly(self.q, shape, 'positions'), rates[0], bend)

    def later(self, by: float) -> Goal:
        """Return the goal begun some seconds later."""
        return self._replace(t=self.t + by)


class Course(NamedTuple):
    """A motion at fine steps: stamps (K,) [s], positions, velocities and accelerations (K, n)."""

    t: Array
    q: Array
    qd: Array
    qdd: Array


def fine_times(goal: Goal) -> Array:
    """Return stamps at which a goal's motion is looked at, its points among them, shape (K,) [s]."""
    t = goal.t
    step = max(_FINE, float(t[-1] - t[0]) / _MOST)
    parts = [
        np.linspace(a, b, max(int(np.ceil((b - a) / step)), 1), endpoint=False)
        for a, b in pairwise(t)
    ]
    return np.concatenate([*parts, t[-1:]])


def course(goal: Goal, at: Array) -> Course:
    """
    Return the motion through the points: straight, cubic or quintic, by what the points tell.

    As ros2_controllers' joint_trajectory_controller has it; stamps (K,) [s] are within the goal.
    """
    if goal.t.size == 1:
        q = np.repeat(goal.q, at.size, axis=0)
        return Course(at, q, np.zeros_like(q), np.zeros_like(q))
    low = np.clip(np.searchsorted(goal.t, at, side='right') - 1, 0, goal.t.size - 2)
    s = (at - goal.t[low])[:, None]
    terms = _terms(goal)[:, low]
    q, qd, qdd = np.zeros((3, at.size, goal.q.shape[1]))
    for k in range(len(terms) - 1, -1, -1):
        qdd = qdd * s + 2.0 * qd
        qd = qd * s + q
        q = q * s + terms[k]
    return Course(at, q, qd, qdd)


def _terms(goal: Goal) -> Array:
    """Return the coefficients of the powers of time since a point, shape (6, N - 1, n)."""
    h = np.diff(goal.t)[:, None]
    out = np.zeros((6, h.size, goal.q.shape[1]))
    way = np.diff(goal.q, axis=0)
    out[0] = goal.q[:-1]
    if goal.qd is None:
        out[1] = way / h
        return out
    v0, v1 = goal.qd[:-1], goal.qd[1:]
    out[1] = v0
    if goal.qdd is None:
        out[2] = (3.0 * way / h - 2.0 * v0 - v1) / h
        out[3] = (v0 + v1 - 2.0 * way / h) / h**2
        return out
    a0, a1 = goal.qdd[:-1], goal.qdd[1:]
    out[2] = 0.5 * a0
    out[3] = (20.0 * way - (8.0 * v1 + 12.0 * v0) * h - (3.0 * a0 - a1) * h**2) / (2.0 * h**3)
    out[4] = (-30.0 * way + (14.0 * v1 + 16.0 * v0) * h + (3.0 * a0 - 2.0 * a1) * h**2) / (
        2.0 * h**4
    )
    out[5] = (12.0 * way - 6.0 * (v1 + v0) * h - (a0 - a1) * h**2) / (2.0 * h**5)
    return out
