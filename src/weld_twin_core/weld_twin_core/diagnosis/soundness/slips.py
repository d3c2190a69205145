# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Did something give way at an instant: instrument or base, the tool, one joint? Did the base settle?

Residuals of the aligned model, with everything projected out that frames and a plausible arm can
explain to first order (`base_change`), are searched for a step of each of them. A step is dated
only where it explains much more than any smooth change of the same thing or of another.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...effects.dated import InstrumentKnock, JointSlip, ToolSlip
from ...effects.effect import Effect
from ...recording import Recording
from ..algebra.problem import Problem
from .base_change import CONSTANTS, BaseChange, other_shapes, smooth_shapes
from .lengths import instant, length
from .limits import (
    DATED,
    DATED_MOVING,
    DATED_SHARE,
    DATED_SIZE,
    ENDS,
    LEFT_ALIKE,
    MARGIN,
    MOST_SLIPS,
    NEARLY,
)
from .mending import measured

SLOW = 2.0
"""Seconds below which nothing warms up; what dies away faster is a transient of the arm."""
NEIGHBOURS = np.geomspace(0.8, 1.25, 7)
"""Factors on a rough time constant that are tried about it."""
KNOCKED, JUMPED, SLIPPED = 'instrument_knocked', 'reflector_jumped', 'joint_slipped'
_OTHERWISE = {
    KNOCKED: 'a knock at instrument or base',
    JUMPED: 'a jump of the reflector or the tool',
    SLIPPED: 'a slip of joint {!r}',
}


@dataclass(frozen=True)
class Slip:
    """
    Something that gave way.

    Attributes
    ----------
    kind : str
        'instrument_knocked', 'reflector_jumped' or 'joint_slipped'.
    joint : str or None
    recording : int
    time : float [s]
        Between the last measurement before and the first after.
    size : float [m]
        RMS motion of the measured points.
    nats : float
        Evidence for it.
    alike : tuple of (str, tuple of str)
        Kinds and places of what would explain the same step nearly as well.
    dated : bool
        Whether it is more than the small steps that effects of no exact formula leave.

    """

    kind: str
    joint: str | None
    recording: int
    time: float
    size: float
    nats: float
    alike: tuple[tuple[str, tuple[str, ...]], ...] = ()
    dated: bool = True

    def sentence(self, recording: Recording) -> str:
        """Return what happened, in words."""
        at = instant(recording, self.time)
        what = {
            KNOCKED: 'Instrument or base were knocked',
            JUMPED: 'The reflector jumped in its nest, or the tool in its holder',
            SLIPPED: f'Joint {self.joint!r} slipped',
        }[self.kind]
        out = f'{what} at {at} of {recording.name}: the tool is {length(self.size)} off then.'
        others = ' or '.join(
            dict.fromkeys(_OTHERWISE[kind].format(*at) for kind, at in self.alike)
        )
        return f'{out} {others[0].upper()}{others[1:]} would look the same.' if others else out

    @property
    def remedy(self) -> str:
        """Return what to do about it."""
        return {
            KNOCKED: 'Fasten the instrument and the base, and measure again; or split the '
            'recording there and have the base aligned',
            JUMPED: 'Fasten the reflector or the tool, and measure again; or split the recording '
            'there and have the tool aligned',
            SLIPPED: f'See to belt, coupling and encoder of {self.joint}, master it and measure '
            'again',
        }[self.kind]

    def effect(self) -> Effect:
        """Return the effect to be fitted, of no size yet."""
        if self.joint is not None:
            return JointSlip(self.joint, time=self.time)
        return (InstrumentKnock if self.kind == KNOCKED else ToolSlip)(time=self.time)

    @property
    def at(self) -> tuple[str, ...]:
        """Return where it is, as the list of mistakes has it."""
        if self.joint is not None:
            return (self.joint,)
        return ('instrument',) if self.kind == KNOCKED else ('tool',)


class Settling(NamedTuple):
    """A settling of the base: where, time constant [s], RMS motion [m] at its start, nats."""

    recording: int
    time_constant: float
    size: float
    nats: float


def changes(
    problem: Problem, change: BaseChange, joints: Sequence[str], largest: float
) -> list[Slip | Settling]:
    """
    Return what gave way in the recordings and how the base settled, most evidence first.

    A settling is named only where a steady drift does not do as well; what is neither is taken out
    before the next is looked for.

    Parameters
    ----------
    problem : Problem
        The measurements that ``change`` is of.
    change : BaseChange
    joints : sequence of str
        Names in chain order.
    largest : float [m]
        How far the largest gaps are; nothing moved twice as far.

    """
    out: list[Slip | Settling] = []
    taken: list[tuple[int, int]] = []
    whole = change.far
    for _ in range(MOST_SLIPS):
        seen = _Seen(problem, change, joints, taken)
        best = seen.best()
        if best is None:
            break
        before, change = change.far, change.past(best.changed, best.shape)
        if best.slip is None:
            named = seen.named(best)
            out += [] if named is None else [named]
            continue
        taken.append((best.slip.recording, best.at))
        seldom = before - change.far > DATED_SHARE * whole
        dated = seldom and best.slip.size < DATED_SIZE * largest
        out.append(replace(best.slip, dated=dated))
    return out


class _Trial(NamedTuple):
    """A change of a recording, its evidence, shape in time (M,), and where it is abrupt if it is."""

    nats: float
    changed: BaseChange
    shape: Array
    recording: int
    slip: Slip | None = None
    at: int = -1

    @property
    def gain(self) -> float:
        """Return the sum of squares that it explains."""
        return self.changed.gain(self.shape)


@dataclass(frozen=True, eq=False)
class _Seen:
    """The change so far explained, and the steps taken out already."""

    problem: Problem
    change: BaseChange
    joints: Sequence[str]
    taken: Sequence[tuple[int, int]]

    def best(self) -> _Trial | None:
        """Return the step or smooth change with most evidence; None where nothing is sure."""
        trials = []
        for k, recording in enumerate(self.problem.recordings):
            sure = DATED if recording.joints.static else DATED_MOVING
            smooth = max(self._smooth(k), key=_nats)
            steps = list(self._steps(k))
            step, surest = _simplest(steps), max((t.nats for t in steps), default=0.0)
            if step is not None and surest > max(sure, MARGIN + smooth.nats):
                trials.append(step._replace(nats=surest))
            elif smooth.nats > sure:
                trials.append(smooth)
        return max(trials, key=_nats, default=None)

    @cached_property
    def _kinds(self) -> list[tuple[str, str | None, BaseChange]]:
        return [
            (KNOCKED, None, self.change),
            (JUMPED, None, self.change.of_tool),
            *((SLIPPED, name, self.change.of_joint(i)) for i, name in enumerate(self.joints)),
        ]

    def _smooth(self, k: int) -> Iterator[_Trial]:
        age = self._age(k)
        possible = smooth_shapes(age)
        if len(self.problem.recordings) > 1:  # moved between recordings, not within one
            possible.append(np.ones(age.size))
        shapes = np.array([self._placed(shape, k) for shape in possible])
        for _, _, changed in self._kinds:
            shape = shapes[int(changed.gains(shapes).argmax())]
            yield _Trial(changed.nats(shape), changed, shape, k)

    def _steps(self, k: int) -> Iterator[_Trial]:
        t = measured(self.problem.recordings[k]).t
        edge = max(3, int(ENDS * t.size))
        allowed = np.zeros(t.size, dtype=bool)
        allowed[edge : t.size - edge] = True
        for recording, at in self.taken:
            if recording == k:
                allowed[max(at - edge, 0) : at + edge] = False
        if not allowed.any():
            return
        for kind, joint, changed in self._kinds:
            at = int(np.where(allowed, changed.step_gains(k), -np.inf).argmax())
            shape = self._placed((np.arange(t.size) >= at).astype(np.float64), k)
            # Every instant was asked; the best of many is better than it should be.
            nats = changed.nats(shape) - float(np.log(t.size))
            time = 0.5 * float(t[at - 1] + t[at])
            slip = Slip(kind, joint, k, time, changed.size(shape), nats)
            yield _Trial(nats, changed, shape, k, slip, at)

    def named(self, smooth: _Trial) -> Slip | Settling | None:
        """Return what a smooth change of the base is by name, where no other shape does as well."""
        if smooth.changed is not self.change:
            return None
        k, age = smooth.recording, self._age(smooth.recording)
        if np.array_equal(smooth.shape, self._placed(np.ones(age.size), k)):
            return self._moved_between(smooth, smooth_shapes(age))

        def gain(constant: float) -> float:
            return self.change.gain(self._placed(np.exp(-age / constant), k))

        rough = max(CONSTANTS, key=gain)
        constant = float(max(rough * NEIGHBOURS, key=gain))
        shape = self._placed(np.exp(-age / constant), k)
        t = measured(self.problem.recordings[k]).t
        late, size = constant * float(np.ptp(t)), self.change.size(shape)
        slow = self.problem.recordings[k].joints.static or late > SLOW
        nats = self.change.nats(shape)
        if not slow or not self._surpasses(nats, shape, k, other_shapes(age)):
            return None
        return Settling(k, late, size, nats)

    def _moved_between(self, smooth: _Trial, others: Sequence[Array]) -> Slip | None:
        """Return a move of the set-up before a recording: of the first, before the second."""
        if not self._surpasses(smooth.nats, smooth.shape, smooth.recording, others):
            return None
        k = max(smooth.recording, 1)
        start, size = float(measured(self.problem.recordings[k]).t[0]), smooth.changed.size
        return Slip(KNOCKED, None, k, start, size(smooth.shape), smooth.nats, dated=False)

    def _surpasses(self, nats: float, shape: Array, k: int, others: Sequence[Array]) -> bool:
        """Return whether a change of the base tells much more than in other shapes, or of joints."""
        shapes = np.array([self._placed(other, k) for other in others])
        best = shapes[int(self.change.gains(shapes).argmax())]
        rival = max(self.change.nats(best), self.change.of_joints.nats(shape))
        return nats > MARGIN + rival

    def _age(self, k: int) -> Array:
        """Return time in a recording as a share of it, shape (M,)."""
        t = measured(self.problem.recordings[k]).t
        return np.asarray((t - t[0]) / max(float(np.ptp(t)), 1e-9))

    def _placed(self, shape: Array, k: int) -> Array:
        mine = self.change.recording == k
        out = np.zeros(mine.size)
        out[mine] = shape
        return out


def _simplest(trials: Sequence[_Trial]) -> _Trial | None:
    """
    Return the step with most evidence, or one of fewer numbers that explains nearly as much.

    What a model leaves for other reasons lets six numbers explain a little more than one, always;
    where hardly anything is left for other reasons, that little counts.
    """
    if not trials:
        return None
    most = max(trial.gain for trial in trials)
    whole = float((trials[0].changed.residual ** 2).sum())
    least = max(NEARLY * most, whole - LEFT_ALIKE * (whole - most))
    enough = [trial for trial in trials if trial.gain >= least > 0.0]
    if not enough:  # nothing to explain, so no number explains it
        return None
    fewest = min(trial.changed.columns.shape[2] for trial in enough)
    best = max((t for t in enough if t.changed.columns.shape[2] == fewest), key=_nats)
    if best.slip is None:
        return best
    alike = tuple((t.slip.kind, t.slip.at) for t in enough if t is not best and t.slip is not None)
    return best._replace(slip=replace(best.slip, alike=alike))


def _nats(trial: _Trial) -> float:
    return trial.nats
