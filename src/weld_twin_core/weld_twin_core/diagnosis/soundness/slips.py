# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Did something give way at an instant: the instrument or the base, the tool, or one joint?

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
from ...effects.effect import Effect
from ...effects.instrument_knock import InstrumentKnock
from ...effects.joint_slip import JointSlip
from ...effects.tool_slip import ToolSlip
from ...recording import Recording
from ..algebra.problem import Problem
from .base_change import BaseChange, smooth_shapes
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

    """

    kind: str
    joint: str | None
    recording: int
    time: float
    size: float
    nats: float
    alike: tuple[tuple[str, tuple[str, ...]], ...] = ()

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


def slips(
    problem: Problem, change: BaseChange, joints: Sequence[str], largest: float
) -> list[Slip]:
    """
    Return what gave way in the recordings, most evidence first.

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
    out: list[Slip] = []
    taken: list[tuple[int, int]] = []
    whole = change.far
    for _ in range(MOST_SLIPS):
        best = _Seen(problem, change, joints, taken).best()
        if best is None:
            break
        before, change = change.far, change.past(best.changed, best.shape)
        if best.slip is not None:
            taken.append((best.slip.recording, best.at))
            if best.slip.size < DATED_SIZE * largest and before - change.far > DATED_SHARE * whole:
                out.append(best.slip)
    return out


class _Trial(NamedTuple):
    """A change, its evidence, its shape in time (M,), and where it is abrupt if it is."""

    nats: float
    changed: BaseChange
    shape: Array
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
        t = measured(self.problem.recordings[k]).t
        age = (t - t[0]) / max(float(np.ptp(t)), 1e-9)
        possible = smooth_shapes(age)
        if len(self.problem.recordings) > 1:  # moved between recordings, not within one
            possible.append(np.ones(t.size))
        shapes = np.array([self._placed(shape, k) for shape in possible])
        for _, _, changed in self._kinds:
            shape = shapes[int(changed.gains(shapes).argmax())]
            yield _Trial(changed.nats(shape), changed, shape)

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
            yield _Trial(nats, changed, shape, slip, at)

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
