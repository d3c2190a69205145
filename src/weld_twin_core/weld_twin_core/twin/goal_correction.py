# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
A trajectory goal moved so that the real tool goes where the goal meant, whole or not at all.

What hangs on the posture alone is taken away by `compensate` at every point, and its rates follow
from the same at two postures a little before and behind on the way. What hangs on where a joint came
from is a step where the joint turns around; it is spread over the standstill there. Lag and delay
are left: they hang on how the controller follows.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..arm.chain import forward
from ..arm.rotation import missing
from ..arrays import Array
from ..effects.effect import Effect, Stage
from ..errors import DataError
from ..recording import JointMotion, Recording
from .compensation import commandable, compensate, rms_of
from .features import Features
from .goal_motion import (
    Course,
    Goal,
    approached,
    course,
    fine_times,
    is_play,
    just_turned,
    play_steps,
    spread,
)
from .posterior import Drawn, pose_covariances
from .program_correction import BETTER, NOTHING, accuracy, too_large
from .program_model import ProgramModel
from .twin import Twin

_SHARES = (0.125, 0.25, 0.5)
"""How near its turn a joint must be for its step of play, in steps: at half of one the arm is off by as
much as without a correction, and only there."""
_BESIDE = 1e-4
"""How far before and behind a point the correction is looked at for its rates [rad or m]: the square of
it is far below the resolution of a drive, and solutions are exact to 1e-12."""
_AT_REST = 1e-9
"""Motion [rad or m, per s] that is none."""
_SURE_AT = 24
"""Places of a goal where it is asked how sure the model is; it changes slowly along a motion."""
_HOLDS = 0.9
"""Share of the models which the recordings allow whose error stays within the promised bound. What
is left over on unseen postures is sized for as many."""
_HERE = 2e-5
"""Distance of a joint [rad or m] from where a goal begins that is noise of its encoder."""
_NEAR = 0.01
"""A goal begins where the arm stands if no joint is farther from there [rad or m]."""
SMOOTH_PEAK = 5.7735
"""Largest acceleration of a step that is made smoothly, for one unit in one second."""
SMOOTH_SPEED = 1.875
"""Its largest speed."""


class GoalLimits(NamedTuple):
    """What a correction may do at most."""

    length: float = 2e-3
    turn: float = np.pi / 180.0
    """By how much a pose may be moved [m, rad]."""
    rate: float = 0.05
    turn_rate: float = 0.2
    """How fast that may change [m/s, rad/s]."""
    acceleration: float = np.inf
    """Of a joint in the corrected goal, beside what the robot file says [rad/s^2 or m/s^2]."""


class Start(NamedTuple):
    """Where the arm is when a goal comes."""

    q: Array | None = None
    """As commanded, shape (n,) [rad or m]; None where it is not known."""
    moving: bool = False
    came: Array | None = None
    """Sign of the last motion of every joint, shape (n,); 0 where it is not known."""


class Refusal(NamedTuple):
    """A goal that is not corrected."""

    reason: str
    largest: tuple[float, float] | None = None
    """The correction that it would have taken [m, rad]."""


@dataclass(frozen=True, eq=False)
class CorrectedGoal:
    """A corrected goal and what is expected of it."""

    goal: Goal
    added: Array
    """What was added to the pose at points, in the axes of the base, (N, 6) [m, rad]."""
    before: float
    after: float
    """Expected RMS distance of the real tool from where the goal means it [m]."""
    bound: float | None
    """Bound on the distance on the way [m]; None where the model tells no doubt."""
    waits: float = 0.0
    """How much later the goal begins, so that the correction sets in smoothly [s]."""
    notes: tuple[str, ...] = ()
    """What is not corrected, in sentences."""

    @property
    def largest(self) -> tuple[float, float]:
        """Return by how much a pose is moved at most [m, rad]."""
        return _largest(self.added)


class _RefusedError(DataError):
    """Why a goal is not corrected; ends the work on it."""


def corrected_goal(
    model: ProgramModel, goal: Goal, limits: GoalLimits | None = None, start: Start | None = None
) -> CorrectedGoal | Refusal:
    """Return a goal corrected at every point, or why it is not; DataError where it is none."""
    checked = goal.checked(model.robot.n)
    work = _Work(model, checked, limits or GoalLimits(), start or Start())
    try:
        return work.result()
    except _RefusedError as refused:
        return Refusal(str(refused), work.largest)


def not_corrected(model: ProgramModel) -> list[str]:
    """Return the names of the effects that no point of a goal mends, each once."""
    remaining = [e for e in model.effects if e.stage != Stage.NOISE and not _mended(e)]
    return list(dict.fromkeys(e.name for e in remaining))


def _mended(effect: Effect) -> bool:
    return commandable(effect) and effect.stage != Stage.SERVO


class _Work:
    """One goal on its way."""

    def __init__(self, model: ProgramModel, goal: Goal, limits: GoalLimits, start: Start) -> None:
        self.model, self.goal, self.limits, self.start = model, goal, limits, start
        mended = [e for e in model.effects if _mended(e)]
        self.real = Twin(model.robot, mended)
        self.still = tuple(e for e in mended if not is_play(e))
        self.plays = tuple(e for e in mended if is_play(e))
        self.bare = model.robot.with_frames(base=np.eye(4))
        self.largest: tuple[float, float] | None = None
        self.meant = course(goal, fine_times(goal))

    def result(self) -> CorrectedGoal:
        """Return the corrected goal; raise why it is refused."""
        self._refuse_outside()
        self._refuse_beyond(self.meant, 'the goal itself')
        before = self._missing(self.meant)
        notes = self._left()
        if np.abs(before).max() < NOTHING:
            none = np.zeros((self.goal.t.size, 6))
            return CorrectedGoal(
                self.goal, none, 0.0, 0.0, self._bound(before, self.meant), 0.0, tuple(notes)
            )
        sure = self._covariances()
        self._refuse_unsure(before, sure)
        result, after, more = self._chosen(before)
        added = self._added(result, self.goal.t)
        waits = self._waits(result)
        if waits:
            more.append(
                f'the correction sets in before the goal, which begins {waits:.3f} s later'
            )
        if self.start.q is None:
            more.append(
                'where the arm stands is not known: the correction sets in at the first point'
            )
        return CorrectedGoal(
            result.later(waits),
            added,
            rms_of(before),
            rms_of(after),
            self._bound(after, course(result, self.meant.t)),
            waits,
            (*notes, *more),
        )

    def _left(self) -> list[str]:
        """Return what is neither corrected nor promised, in sentences."""
        out = [
            f'{name} is not corrected: it hangs on how the controller follows, not on where it goes'
            for name in not_corrected(self.model)
        ]
        if self.model.lawless:
            names = ' and '.join(self.model.lawless)
            out.append(
                f'no bound is told: what {names} loses by direction is known without its law, which '
                'decides where it turns around'
            )
        return out

    def _chosen(self, before: Array) -> tuple[Goal, Array, list[str]]:
        """Return the first way of correcting that keeps the limits and gains; raise why none does."""
        reasons: list[str] = []
        size = np.linalg.norm(before[:, :3], axis=1)
        for result, play in self._ways():
            added = self._added(result, self.goal.t)
            self.largest = self.largest or _largest(added)
            try:
                length, turn = _largest(added)
                if length > self.limits.length or turn > self.limits.turn:
                    raise _RefusedError(too_large(length, turn, self.limits[:2]))
                self._refuse_beyond(course(result, self.meant.t), 'the corrected goal')
                self._refuse_quick(result)
            except _RefusedError as refused:
                reasons.append(str(refused))
                continue
            after = self._missing(course(result, self.meant.t))
            worst = float(np.linalg.norm(after[:, :3], axis=1).max())
            # How the arm comes to where a goal begins is one place; most of the way must gain.
            if rms_of(after) > BETTER * rms_of(before) + NOTHING or worst > size.max() + NOTHING:
                reasons.append(
                    f'too little is gained: {rms_of(after) * 1e3:.3f} mm (at worst {worst * 1e3:.3f}) '
                    f'would be left of {rms_of(before) * 1e3:.3f} mm (at worst {size.max() * 1e3:.3f})'
                )
                continue
            remaining = [f'play is not corrected: {reasons[0]}'] if self.plays and not play else []
            self.largest = _largest(added)
            return result, after, remaining
        raise _RefusedError(reasons[0])

    def _ways(self) -> Iterator[tuple[Goal, bool]]:
        """Yield corrected goals, the best first, and whether play is corrected in them."""
        still = self._without_play()
        if self.plays:
            fine = self.meant
            recording = self._recording(fine)
            came = self.start.came
            steps = play_steps(self.model.robot, self.plays, recording, came)
            for share in _SHARES:
                more = spread(steps, fine, share, self.goal.t, came, rests=self._rests)
                yield (
                    Goal(
                        still.t,
                        still.q + more.q,
                        None if still.qd is None else still.qd + more.qd,
                        None if still.qdd is None else still.qdd + more.qdd,
                    ),
                    True,
                )
        yield still, False

    def _without_play(self) -> Goal:
        """Return the goal corrected for what hangs on the posture alone."""
        goal = self.goal
        q = self._solved(goal.t, goal.q)
        if goal.qd is None:
            return goal._replace(q=q)
        bend = np.zeros_like(goal.q) if goal.qdd is None else goal.qdd
        e = self._beside(goal.qd, bend)
        ahead = self._solved(goal.t + e, goal.q + e * goal.qd + 0.5 * e**2 * bend)
        behind = self._solved(goal.t - e, goal.q - e * goal.qd + 0.5 * e**2 * bend)
        qd = (ahead - behind) / (2.0 * e)
        qdd = None if goal.qdd is None else (ahead - 2.0 * q + behind) / e**2
        return Goal(goal.t, q, qd, qdd)

    @staticmethod
    def _beside(qd: Array, qdd: Array) -> float:
        """Return the time [s] in which no joint goes farther than `_BESIDE`."""
        fast, bent = np.abs(qd).max(initial=_AT_REST), np.abs(qdd).max(initial=_AT_REST)
        return float(min(_BESIDE / fast, np.sqrt(2.0 * _BESIDE / bent), 1.0))

    def _solved(self, t: Array, q: Array) -> Array:
        recording = self.model.recording(JointMotion(t, q))
        return compensate(self.model.robot, self.still, recording).motion.q

    # What is known of it ---------------------------------------------------------------------

    def _recording(self, way: Course) -> Recording:
        return self.model.recording(JointMotion(way.t, way.q, way.qd))

    def _approached(self, way: Course) -> Recording:
        """Return a course, and how the arm came to where it begins."""
        here = self.start.q if self._near else None
        return approached(self._recording(way), self.start.came, here)

    def _missing(self, way: Course) -> Array:
        """Return what is missing to the real tool on a course, shape (K, 6) [m, rad]."""
        real = self.real.poses(self._approached(way)).matrices[-way.t.size :]
        return missing(forward(self.model.robot, self.meant.q), real)

    def _covariances(self) -> Array | None:
        """Return how sure the model is at some places of the goal, shape (P, 6, 6)."""
        if self.model.posterior is None:
            return None
        return pose_covariances(
            self.model.posterior,
            self.real,
            self._recording(self.meant),
            self.meant.t[self._places],
            self.model.setup,
        )

    @property
    def _places(self) -> Array:
        count = self.meant.t.size
        return np.unique(np.linspace(0, count - 1, min(_SURE_AT, count)).round().astype(int))

    def _bound(self, after: Array, way: Course) -> float | None:
        """Return the bound on the distance on a way that is promised beforehand [m]."""
        posterior = self.model.posterior
        if posterior is None or self.model.lawless:
            return None
        recording = self._approached(way)
        turned = just_turned(recording.joints, way.t)
        edges = np.flatnonzero((turned[1:] != turned[:-1]).any(axis=1))
        places = np.unique(np.concatenate([self._places, edges, edges + 1]))
        seen = Features(self.real, recording, way.t[places])
        # Where joints turn around more is left than beside, and few places would miss that.
        near = np.searchsorted(places, np.arange(len(after))).clip(max=places.size - 1)
        result = accuracy([after], [Drawn(near, posterior.drawn(seen, self.model.setup))])
        return None if result is None else result.likely_within(_HOLDS)

    def _added(self, result: Goal, at: Array) -> Array:
        """Return what a corrected goal adds to the pose at stamps, shape (N, 6), seen from the base."""
        return missing(*(forward(self.bare, course(g, at).q) for g in (result, self.goal)))

    def _waits(self, result: Goal) -> float:
        """Return how much later the goal has to begin [s] for its correction to set in smoothly."""
        here = self.start.q
        if here is None or not self._rests:
            return 0.0
        step = result.q[0] - here
        if np.abs(step).max() < _HERE:
            return 0.0
        old, new = forward(self.bare, np.stack([here, result.q[0]]))
        length, turn = np.abs(_largest(missing(new, old)[None]))
        most = np.minimum(self.model.robot.max_acceleration, self.limits.acceleration)
        needed = max(
            SMOOTH_SPEED * length / self.limits.rate,
            SMOOTH_SPEED * turn / self.limits.turn_rate,
            float(np.sqrt(SMOOTH_PEAK * np.abs(step) / most).max()),
        )
        return float(max(0.0, needed - float(self.goal.t[0])))

    @property
    def _near(self) -> bool:
        """Return whether the arm is where the goal begins."""
        here = self.start.q
        return here is not None and bool(np.abs(self.goal.q[0] - here).max() <= _NEAR)

    @property
    def _rests(self) -> bool:
        """Return whether the arm stands where the goal begins, or comes to rest with it there."""
        rate = self.goal.qd
        begins_at_rest = rate is not None and bool(np.abs(rate[0]).max() < _AT_REST)
        return self._near and (begins_at_rest or not self.start.moving)

    # Reasons to refuse -----------------------------------------------------------------------

    def _refuse_outside(self) -> None:
        result = self.model.postures_outside(self.meant.q)
        if result:
            at = self.meant.t[result[0].first]
            raise _RefusedError(f'outside what was recorded from {at:.2f} s on: {result[0].why}')

    def _refuse_unsure(self, before: Array, sure: Array | None) -> None:
        if sure is None:
            return
        size = before[self._places, :3]
        doubt = float(np.sqrt(np.trace(sure[:, :3, :3], axis1=1, axis2=2).mean()))
        self.largest = _largest(before)
        if rms_of(size) < doubt:
            raise _RefusedError(
                f'the model is less sure of this goal ({doubt * 1e3:.3f} mm) than the correction is '
                f'large ({rms_of(size) * 1e3:.3f} mm)'
            )

    def _refuse_quick(self, result: Goal) -> None:
        if self.meant.t.size < 2:
            return
        rates = np.diff(self._added(result, self.meant.t), axis=0)
        rates /= np.diff(self.meant.t)[:, None]
        length, turn = _largest(rates)
        if length > self.limits.rate or turn > self.limits.turn_rate:
            raise _RefusedError(
                f'the correction would change by up to {length * 1e3:.2f} mm/s and '
                f'{np.degrees(turn):.2f} degrees/s, at most {self.limits.rate * 1e3:g} mm/s and '
                f'{np.degrees(self.limits.turn_rate):g} degrees/s are allowed'
            )

    def _refuse_beyond(self, way: Course, what: str) -> None:
        """Refuse a course beyond the limits of position, velocity or acceleration."""
        robot = self.model.robot
        bend = way.qdd if self.goal.qd is not None else _bends(self.goal, way)
        most = np.minimum(robot.max_acceleration, self.limits.acceleration)
        for values, low, high, name, unit in (
            (way.q, robot.lower, robot.upper, 'position', ''),
            (way.qd, -robot.max_velocity, robot.max_velocity, 'velocity', '/s'),
            (bend, -most, most, 'acceleration', '/s^2'),
        ):
            over = np.maximum(low - values, values - high)
            if over.max() > 1e-9:
                k, i = np.unravel_index(int(over.argmax()), over.shape)
                limit = low[i] if values[k, i] < low[i] else high[i]
                side = ('rad', 'm')[int(robot.prismatic[i])] + unit
                raise _RefusedError(
                    f'{what} breaks the limit of {name} of {robot.joint_names[i]}: '
                    f'{values[k, i]:.4g} {side}, the limit is {limit:.4g}'
                )


def _bends(goal: Goal, way: Course) -> Array:
    """Return the accelerations of straight pieces by their points alone, shape (K, n)."""
    out = np.zeros_like(way.q)
    if goal.t.size > 2:
        speed = np.diff(way.q, axis=0) / np.diff(way.t)[:, None]
        inner = np.searchsorted(way.t, goal.t[1:-1])
        span = 0.5 * (goal.t[2:] - goal.t[:-2])[:, None]
        out[inner] = (speed[inner] - speed[inner - 1]) / span
    return out


def _largest(twists: Array) -> tuple[float, float]:
    """Return the largest length and turn of twists (N, 6)."""
    return (
        float(np.linalg.norm(twists[:, :3], axis=1).max()),
        float(np.linalg.norm(twists[:, 3:], axis=1).max()),
    )
