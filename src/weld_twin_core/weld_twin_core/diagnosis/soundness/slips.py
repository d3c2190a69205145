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
from .base_change import CONSTANTS, Change, Rest, other_shapes, smooth_shapes
from .lengths import instant, length
from .limits import FEW, MARGIN, MOST, TINY

SLOW = 2.0
"""Seconds below which nothing warms up; what dies away faster is a transient of the arm."""
KNOCKED, JUMPED, SLIPPED = 'instrument_knocked', 'reflector_jumped', 'joint_slipped'
_AGAIN = 'and measure again; or split the recording there and have the'
_WORDS = {
    KNOCKED: (
        'Instrument or base were knocked',
        'a knock at instrument or base',
        f'Fasten the instrument and the base, {_AGAIN} base aligned',
    ),
    JUMPED: (
        'The reflector jumped in its nest, or the tool in its holder',
        'a jump of the reflector or the tool',
        f'Fasten the reflector or the tool, {_AGAIN} tool aligned',
    ),
    SLIPPED: (
        'Joint {0!r} slipped',
        'a slip of joint {0!r}',
        'See to belt, coupling and encoder of {0}, master it and measure again',
    ),
}
"""How each kind is told: what happened, how it is called beside others, what to do about it."""


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
        at, what = instant(recording, self.time), _WORDS[self.kind][0].format(self.joint)
        out = f'{what} at {at} of {recording.name}: the tool is {length(self.size)} off then.'
        others = ' or '.join(dict.fromkeys(_WORDS[kind][1].format(*at) for kind, at in self.alike))
        return f'{out} {others[0].upper()}{others[1:]} would look the same.' if others else out

    @property
    def remedy(self) -> str:
        """Return what to do about it."""
        return _WORDS[self.kind][2].format(self.joint)

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
    problem: Problem, rest: Rest, joints: Sequence[str], largest: float
) -> list[Slip | Settling]:
    """
    Return what gave way in the recordings and how the base settled, most evidence first.

    A settling is named only where a steady drift does not do as well; what is neither is taken out
    before the next is looked for.

    Parameters
    ----------
    problem : Problem
        The measurements that ``rest`` is of.
    largest : float [m]
        How far the largest gaps are; nothing moved twice as far.

    """
    out: list[Slip | Settling] = []
    taken: list[tuple[int, int]] = []
    whole = rest.far
    for _ in range(MOST):
        seen = _Seen(problem, rest, joints, taken)
        best = seen.best()
        if best is None:
            break
        before, rest = rest.far, best.change.taken_out(best.shape)
        if best.slip is None:
            named = seen.named(best)
            out += [] if named is None else [named]
            continue
        taken.append((best.slip.recording, best.at))
        # Effects that no formula holds exactly leave small steps here and there; and no step is twice
        # as large as the largest gaps: one frame that is fitted takes up half of it.
        dated = before - rest.far > FEW * whole and best.slip.size < 2.0 * largest
        out.append(replace(best.slip, dated=dated))
    return out


class _Trial(NamedTuple):
    """A change of a recording, its evidence, shape in time (M,), and where it is abrupt if it is."""

    nats: float
    change: Change
    shape: Array
    recording: int
    slip: Slip | None = None
    at: int = -1

    @property
    def gain(self) -> float:
        """Return the sum of squares that it explains."""
        return float(self.change.gains(self.shape[None])[0])


@dataclass(frozen=True, eq=False)
class _Seen:
    """What is left so far, and the steps taken out already."""

    problem: Problem
    rest: Rest
    joints: Sequence[str]
    taken: Sequence[tuple[int, int]]

    def best(self) -> _Trial | None:
        """Return the step or smooth change with most evidence; None where nothing is sure."""
        trials = []
        for k in range(len(self.problem.recordings)):
            smooth = max(self._smooth(k), key=_nats)
            steps = list(self._steps(k))
            step, surest = _simplest(steps), max((t.nats for t in steps), default=0.0)
            if step is not None and surest > MARGIN + max(smooth.nats, 0.0):
                trials.append(step._replace(nats=surest))
            elif smooth.nats > MARGIN:
                trials.append(smooth)
        return max(trials, key=_nats, default=None)

    @cached_property
    def _base(self) -> Change:
        return self.rest.change('base')

    @cached_property
    def _kinds(self) -> list[tuple[str, str | None, Change]]:
        # Where only points are seen the tool cannot turn.
        tool = self.rest.change('tool', slice(max(self.rest.rows)))
        own = (self.rest.change('joints', slice(i, i + 1)) for i in range(len(self.joints)))
        slips = ((SLIPPED, name, one) for name, one in zip(self.joints, own, strict=True))
        return [(KNOCKED, None, self._base), (JUMPED, None, tool), *slips]

    def _smooth(self, k: int) -> Iterator[_Trial]:
        age = self._age(k)
        possible = smooth_shapes(age)
        if len(self.problem.recordings) > 1:  # moved between recordings, not within one
            possible.append(np.ones(age.size))
        shapes = [self._placed(shape, k) for shape in possible]
        for _, _, change in self._kinds:
            shape = change.best(shapes)
            yield _Trial(change.nats(shape), change, shape, k)

    def _steps(self, k: int) -> Iterator[_Trial]:
        t = self.problem.recordings[k].seen.t
        # At the ends of a recording a step cannot be told from the end's own troubles.
        edge = max(3, int(FEW * t.size / 2.0))
        allowed = np.zeros(t.size, dtype=bool)
        allowed[edge : t.size - edge] = True
        for recording, at in self.taken:
            if recording == k:
                allowed[max(at - edge, 0) : at + edge] = False
        for kind, joint, change in self._kinds if allowed.any() else ():
            at = int(np.where(allowed, change.step_gains(k), -np.inf).argmax())
            shape = self._placed((np.arange(t.size) >= at).astype(np.float64), k)
            # Every instant was asked; the best of many is better than it should be.
            log_bayes_factor = change.nats(shape) - float(np.log(t.size))
            time = float(t[at - 1] + t[at]) / 2
            slip = Slip(kind, joint, k, time, change.size(shape), log_bayes_factor)
            yield _Trial(log_bayes_factor, change, shape, k, slip, at)

    def named(self, smooth: _Trial) -> Slip | Settling | None:
        """Return what a smooth change of the base is by name, where no other shape does as well."""
        if smooth.change is not self._base:
            return None
        k, age = smooth.recording, self._age(smooth.recording)
        t = self.problem.recordings[k].seen.t
        if np.array_equal(smooth.shape, self._placed(np.ones(age.size), k)):
            if not self._surpasses(smooth.nats, smooth.shape, k, smooth_shapes(age)):
                return None
            # A move of the set-up before a recording: of the first, before the second.
            k, size = max(k, 1), self._base.size(smooth.shape)
            start = float(self.problem.recordings[k].seen.t[0])
            return Slip(KNOCKED, None, k, start, size, smooth.nats, dated=False)

        def settled(constant: float) -> Array:
            return self._placed(np.exp(-age / constant), k)

        best = self._base.best([settled(constant) for constant in CONSTANTS])
        constant = next(c for c in CONSTANTS if np.array_equal(settled(c), best))
        shape, late = settled(constant), constant * float(np.ptp(t))
        log_bayes_factor = self._base.nats(shape)
        slow = self.problem.recordings[k].joints.static or late > SLOW
        if not slow or not self._surpasses(log_bayes_factor, shape, k, other_shapes(age)):
            return None
        return Settling(k, late, self._base.size(shape), log_bayes_factor)

    def _surpasses(
        self, log_bayes_factor: float, shape: Array, k: int, others: Sequence[Array]
    ) -> bool:
        """Return whether a change of the base tells much more than in other shapes, or of joints."""
        best = self._base.best([self._placed(other, k) for other in others])
        alternative = max(self._base.nats(best), self.rest.change('joints').nats(shape))
        return log_bayes_factor > MARGIN + alternative

    def _age(self, k: int) -> Array:
        """Return time in a recording as a share of it, shape (M,)."""
        t = self.problem.recordings[k].seen.t
        return np.asarray((t - t[0]) / max(float(np.ptp(t)), TINY))

    def _placed(self, shape: Array, k: int) -> Array:
        out = np.zeros(self.rest.recording.size)
        out[self.rest.recording == k] = shape
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
    whole = float((trials[0].change.rest.residual ** 2).sum())
    least = max((1.0 - FEW) * most, whole - 2.0 * (whole - most))
    enough = [trial for trial in trials if trial.gain >= least > 0.0]
    if not enough:  # nothing to explain, so no number explains it
        return None
    fewest = min(trial.change.columns.shape[2] for trial in enough)
    best = max((t for t in enough if t.change.columns.shape[2] == fewest), key=_nats)
    if best.slip is None:
        return best
    alike = tuple((t.slip.kind, t.slip.at) for t in enough if t is not best and t.slip is not None)
    return best._replace(slip=replace(best.slip, alike=alike))


def _nats(trial: _Trial) -> float:
    return trial.nats
