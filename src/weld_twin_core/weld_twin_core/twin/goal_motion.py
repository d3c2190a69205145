# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
The points of a trajectory goal, and the motion that a trajectory controller makes of them.

What play asks for where a joint turns around is spread over the standstill there. A gap is crossed
by a step of the command. No arm makes a step, so it is spread over the time in which the joint is
near where it turns around: the output rests meanwhile, at most as far from where it is wanted as
the joint is from there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arm.robot import Robot
from ..arrays import Array, readonly
from ..effects.effect import Effect, MemoryEffect, Stage
from ..errors import DataError
from ..recording import JointMotion, Recording
from .stages import run_all
from .twin import Twin

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


_CAME_FROM = 0.02
"""How far a joint is taken to have come [rad or m] where the direction is known: more than any play."""
_ROUNDS = 16
"""Each takes what is added into account for the motion that plays see. A gap is then crossed within one
part in so many of its width, which is within the narrowest standstill that a step is spread over."""
_STEP = 1e-7
"""What is added for play and varies by less [rad or m] has no step."""


class _Spread(NamedTuple):
    """What is added for play at stamps (K,): values, rates and bends, each (K, n)."""

    q: Array
    qd: Array
    qdd: Array


def is_play(effect: Effect) -> bool:
    """Tell whether an effect is lost motion, which hangs on where a joint came from."""
    return isinstance(effect, MemoryEffect) and effect.stage == Stage.PLAY


def lost_motion(robot: Robot, plays: Sequence[Effect], recording: Recording) -> Array:
    """Return by how much play displaces every joint at every sample, shape (N, n) [rad or m]."""
    twin = Twin(robot, plays)
    shift, _ = run_all(twin.effects, twin.joint_view(recording), False)
    return np.zeros_like(recording.joints.q) if shift is None else np.asarray(shift)


def approached(recording: Recording, came: Array | None, stands: Array | None = None) -> Recording:
    """
    Return a recording that begins with a motion to its first sample from where joints came.

    That is by the sign of every joint's last motion, 0 where it is not known, which ended where
    the arm ``stands``, shape (n,) each; left out, at the first sample.
    """
    motion = recording.joints
    way = np.zeros((0, motion.q.shape[1]))
    if came is not None and np.any(came):
        end = motion.q[0] if stands is None else stands
        way = np.stack([end - _CAME_FROM * np.sign(came), end])
    elif stands is not None:
        way = stands[None]
    if not way.size:
        return recording
    t = motion.t[0] - np.arange(float(len(way)), 0.0, -1.0)
    rest = np.zeros_like(way)
    rates = None if motion.qd is None else np.concatenate([rest, motion.qd])
    joined = JointMotion(np.concatenate([t, motion.t]), np.concatenate([way, motion.q]), rates)
    return replace(recording, joints=joined)


def play_steps(
    robot: Robot, plays: tuple[Effect, ...], recording: Recording, came: Array | None
) -> Array:
    """Return what takes play away, as steps (K, n) [rad or m], of the motion wanted behind the gaps."""
    motion = recording.joints
    steps = np.zeros_like(motion.q)
    for _ in range(_ROUNDS):
        moved = JointMotion(motion.t, motion.q + steps, motion.qd)
        before = approached(replace(recording, joints=moved), came)
        steps = -lost_motion(robot, plays, before)[-motion.t.size :]
    return steps


def spread(
    steps: Array,
    course: Course,
    share: float,
    at: Array,
    came: Array | None = None,
    *,
    rests: bool = False,
) -> _Spread:
    """
    Return steps of `play_steps` spread over the standstill of each reversal, at samples (N,) [s].

    A joint may be as far from where it turns around while its step is made as a share of the
    largest step. An arm that ``rests`` stands still before the first sample, and makes its first
    steps there.
    """
    out = _Spread(*np.zeros((3, at.size, steps.shape[1])))
    place = np.searchsorted(course.t, at)
    for i, column in enumerate(steps.T):
        out.q[:, i] = column[place]
        size = float(np.ptp(column))
        if size < _STEP:
            continue
        before = 0.0 if came is None else float(came[i])
        for a, b in _standstills(course.q[:, i], before, share * size):
            inside = (at >= course.t[a]) & (at <= course.t[b])
            if rests and a == 0:
                out.q[inside, i] = column[b]
                continue
            span = float(course.t[b] - course.t[a])
            s = (at[inside] - course.t[a]) / span
            way = column[b] - column[a]
            out.q[inside, i] = column[a] + way * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
            out.qd[inside, i] = way / span * 30.0 * s**2 * (1.0 - s) ** 2
            out.qdd[inside, i] = way / span**2 * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)
    return out


def _standstills(q: Array, before: float, near: float) -> list[tuple[int, int]]:
    """
    Return first and last sample about every place where a joint turns around, joined if they meet.

    A joint that came from nobody knows where turns around at its start.
    """
    ways = np.concatenate([[np.sign(before)], np.sign(np.diff(q))])
    last = np.maximum.accumulate(np.where(ways != 0.0, np.arange(ways.size), 0))
    held = ways[last]
    turns = np.flatnonzero((held[1:] != held[:-1]) & (held[1:] != 0.0))
    out: list[tuple[int, int]] = []
    for k in turns:
        away = np.flatnonzero(np.abs(q - q[k]) > near)
        split = int(np.searchsorted(away, k))
        a = int(away[split - 1]) + 1 if split else 0
        b = int(away[split]) - 1 if split < away.size else q.size - 1
        a, b = min(a, int(k)), max(b, int(k) + 1)
        if out and a <= out[-1][1]:
            out[-1] = out[-1][0], max(b, out[-1][1])
        else:
            out.append((a, b))
    return out


_TAKEN_UP = 1e-3
"""Way after a turn [rad or m] within which lost motion is taken up: it is tenths of a milliradian."""
_BACK = 1e-5
"""Way back [rad or m] from which on it is a turn: more than an encoder's noise, less than any play."""


def just_turned(motion: JointMotion, at: Array) -> NDArray[np.bool_]:
    """Return whether moving joints turned less than `_TAKEN_UP` before stamps (M,) [s], shape (M, n)."""
    out = np.zeros((at.size, motion.q.shape[1]), dtype=bool)
    if motion.static:
        return out
    q, _ = motion.at(at)
    for i, column in enumerate(motion.q.T):
        turns = _turns(column)
        if not turns.size:
            continue
        before = np.searchsorted(motion.t[turns], at, side='right') - 1
        since = np.abs(q[:, i] - column[turns[before]])
        out[:, i] = (before >= 0) & (since < _TAKEN_UP)
    return out


def _turns(q: Array) -> NDArray[np.int_]:
    """Return the samples at which a joint turned around, by more than `_BACK`."""
    # Only samples at which the step changes its sign can be turns: few of a long motion.
    steps = np.sign(np.diff(q))
    moved = np.flatnonzero(steps)
    if not moved.size:
        return moved
    corners = [0, *(moved[1:][np.diff(steps[moved]) != 0.0]).tolist(), q.size - 1]
    result: list[int] = []
    way, far = 0.0, 0
    for k in corners[1:]:
        gone = float(q[k] - q[far])
        if way == 0.0:
            if abs(gone) > _BACK:
                way, far = float(np.sign(gone)), k
        elif way * gone >= 0.0:
            far = k
        elif abs(gone) > _BACK:
            result.append(far)
            way, far = -way, k
    return np.array(result, dtype=int)
