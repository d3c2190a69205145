# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Did something give way at an instant: instrument or base, the tool, one joint? Did the base settle?

What frames and a plausible arm leave to first order (`base_change`) is searched for a step of each. It
is dated only where it explains much more than any smooth change of the same thing or of another.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from operator import attrgetter
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...effects.dated import InstrumentKnock, JointSlip, Sudden, ToolSlip
from ...effects.effect import Effect
from ...recording import Recording
from ..algebra.problem import Problem
from .base_change import CONSTANTS, Change, Rest, other_shapes
from .lengths import instant, length
from .limits import FEW, MARGIN, MOST, TINY

TAKEN_UP = 2.5
"""Times the largest gaps from which a change did not happen: one frame that is fitted takes up half of
it, base and tool a little more; a strong shake makes such steps."""
SLOW = 2.0
"""Seconds below which nothing warms up; what dies away faster is a transient of the arm."""
MOVED_BEFORE = np.inf
"""Time constant of what moved before a recording, and stays so in all of it."""
_AGAIN = 'and measure again; or split the recording there and have the'
_WORDS: dict[type[Effect], tuple[str, str, str, str]] = {
    InstrumentKnock: (
        'instrument_knocked',
        'Instrument or base were knocked',
        'a knock at instrument or base',
        f'Fasten the instrument and the base, {_AGAIN} base aligned',
    ),
    ToolSlip: (
        'reflector_jumped',
        'The reflector jumped in its nest, or the tool in its holder',
        'a jump of the reflector or the tool',
        f'Fasten the reflector or the tool, {_AGAIN} tool aligned',
    ),
    JointSlip: (
        'joint_slipped',
        'Joint {0!r} slipped',
        'a slip of joint {0!r}',
        'See to belt, coupling and encoder of {0}, master it and measure again',
    ),
}
"""How each is reported: its kind, what happened, how it is called beside others, what to do about it."""


@dataclass(frozen=True, eq=False)
class Slip:
    """
    Something that gave way: the effect to be fitted, of no size yet, and in which recording.

    ``size`` is the RMS motion of the measured points [m], ``log_bayes_factor`` the evidence for it.
    ``others`` would explain the same step nearly as well. It is ``dated`` where it is more than the
    small steps that effects of no exact formula leave.
    """

    effect: Sudden
    recording: int
    size: float
    log_bayes_factor: float
    others: tuple[Sudden, ...] = ()
    dated: bool = True

    @property
    def kind(self) -> str:
        return _WORDS[type(self.effect)][0]

    @property
    def time(self) -> float:
        """Return when [s], between the last measurement before and the first after."""
        return self.effect.time

    @property
    def alike(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        """Return kind and place of what would explain the same step nearly as well."""
        return tuple((_WORDS[type(other)][0], (other.at,)) for other in self.others)

    def sentence(self, recording: Recording) -> str:
        what, when = _WORDS[type(self.effect)][1], instant(recording, self.time)
        out = f'{what.format(self.effect.at)} at {when} of {recording.name}: the tool is '
        out += f'{length(self.size)} off then.'
        others = ' or '.join(_WORDS[type(other)][2].format(other.at) for other in self.others)
        return f'{out} {others[0].upper()}{others[1:]} would look the same.' if others else out

    @property
    def remedy(self) -> str:
        return _WORDS[type(self.effect)][3].format(self.effect.at)


class Settling(NamedTuple):
    """A settling of the base: where, time constant [s], RMS motion [m] at its start."""

    recording: int
    time_constant: float
    size: float


def changes(
    problem: Problem, rest: Rest, joints: Sequence[str], largest: float
) -> list[Slip | Settling]:
    """
    Return what gave way in the recordings and how the base settled, most evidence first.

    A settling is named only where a steady drift does not do as well; what is neither is taken out
    before the next is looked for. Nothing moved twice as far as the largest gaps are [m].
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
        if best.effect is None:
            out += seen.named(best)
            continue
        taken.append((best.recording, best.at))
        # Effects that no formula holds exactly leave small steps here and there.
        size = best.change.size(best.shape)
        dated = before - rest.far > FEW * whole and size < TAKEN_UP * largest
        out.append(Slip(best.effect, best.recording, size, best.sure, best.others, dated))
    return out


class _Trial(NamedTuple):
    """A change in time, shape (M,): a step of something before a sample, or settling or not."""

    sure: float
    change: Change
    shape: Array
    recording: int
    effect: Sudden | None = None
    at: int = -1
    others: tuple[Sudden, ...] = ()
    constant: float = 0.0

    @property
    def gain(self) -> float:
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
        for k, recording in enumerate(self.problem.recordings):
            # What is left of a moving arm hangs together, however good the model.
            least = MARGIN if recording.joints.static else 2.0 * MARGIN
            smooth = max(self._smooth(k), key=_sure)
            steps = list(self._steps(k))
            step, surest = _simplest(steps), max((t.sure for t in steps), default=0.0)
            if step is not None and surest > max(least, MARGIN + smooth.sure):
                trials.append(step._replace(sure=surest))
            elif smooth.sure > least:
                trials.append(smooth)
        return max(trials, key=_sure, default=None)

    @cached_property
    def _base(self) -> Change:
        return self.rest.change('base')

    @cached_property
    def _kinds(self) -> list[tuple[Sudden, Change]]:
        # Where only points are seen the tool cannot turn.
        tool = self.rest.change('tool', slice(max(self.rest.rows)))
        own = [self.rest.change('joints', slice(i, i + 1)) for i in range(len(self.joints))]
        slips = [(JointSlip(name), one) for name, one in zip(self.joints, own, strict=True)]
        return [(InstrumentKnock(), self._base), (ToolSlip(), tool), *slips]

    def _shapes(self, k: int) -> list[tuple[float, Array]]:
        """Return smooth changes of a recording, by time constant; 0 where none settles."""
        age = self._age(k)
        out = [(constant, np.exp(-age / constant)) for constant in CONSTANTS.tolist()]
        out += [(0.0, shape) for shape in other_shapes(age)]
        # It may have moved between recordings, not within one.
        out += [(MOVED_BEFORE, np.ones(age.size))] if len(self.problem.recordings) > 1 else []
        return [(constant, self._in_recording(shape, k)) for constant, shape in out]

    def _smooth(self, k: int) -> Iterator[_Trial]:
        shapes = self._shapes(k)
        for _, change in self._kinds:
            best = int(change.gains(np.array([shape for _, shape in shapes])).argmax())
            constant, shape = shapes[best]
            yield _Trial(change.log_bayes_factor(shape), change, shape, k, constant=constant)

    def _steps(self, k: int) -> Iterator[_Trial]:
        t = self.problem.recordings[k].seen.t
        # At the ends of a recording a step cannot be told from the end's own troubles.
        edge = max(3, int(FEW * t.size / 2.0))
        allowed = np.zeros(t.size, dtype=bool)
        allowed[edge : t.size - edge] = True
        for recording, at in self.taken:
            if recording == k:
                allowed[max(at - edge, 0) : at + edge] = False
        for effect, change in self._kinds if allowed.any() else ():
            at = int(np.where(allowed, change.step_gains(k), -np.inf).argmax())
            shape = self._in_recording((np.arange(t.size) >= at).astype(np.float64), k)
            # Every instant was asked; the best of many is better than it should be.
            log_bayes_factor = change.log_bayes_factor(shape) - float(np.log(t.size))
            slip = replace(effect, time=float(t[at - 1] + t[at]) / 2.0)  # type: ignore[call-arg]
            yield _Trial(log_bayes_factor, change, shape, k, slip, at)

    def named(self, smooth: _Trial) -> Iterator[Slip | Settling]:
        """Yield what a smooth change of the base is by name, where no other shape does as well."""
        k, base = smooth.recording, self._base
        others = [
            shape
            for constant, shape in self._shapes(k)
            if constant == 0.0 or (smooth.constant == MOVED_BEFORE != constant)
        ]
        recording, size = self.problem.recordings[k], base.size(smooth.shape)
        late = smooth.constant * float(np.ptp(recording.seen.t))
        slow = recording.joints.static or late > SLOW
        if smooth.change is not base or smooth.constant == 0.0 or not slow:
            return
        steady = base.log_bayes_factor(base.best(others))
        of_joints = self.rest.change('joints').log_bayes_factor(smooth.shape)
        if smooth.sure < MARGIN + max(steady, of_joints):
            return
        if smooth.constant == MOVED_BEFORE:  # of the first recording: before the second
            start = float(self.problem.recordings[max(k, 1)].seen.t[0])
            knock = InstrumentKnock(time=start)
            yield Slip(knock, max(k, 1), size, smooth.sure, dated=False)
        else:
            yield Settling(k, late, size)

    def _age(self, k: int) -> Array:
        """Return time in a recording as a share of it, shape (M,)."""
        t = self.problem.recordings[k].seen.t
        return np.asarray((t - t[0]) / max(float(np.ptp(t)), TINY))

    def _in_recording(self, shape: Array, k: int) -> Array:
        out = np.zeros(self.rest.recording.size)
        out[self.rest.recording == k] = shape
        return out


def _simplest(trials: Sequence[_Trial]) -> _Trial | None:
    """Return the step with most evidence, or one of fewer numbers that explains nearly as much."""
    if not trials:
        return None
    # What a model leaves lets six numbers explain a little more than one; where it is little, it counts.
    most = max(trial.gain for trial in trials)
    whole = float((trials[0].change.rest.residual ** 2).sum())
    least = max((1.0 - FEW) * most, whole - 2.0 * (whole - most))
    enough = [trial for trial in trials if trial.gain >= least > 0.0]
    if not enough:  # nothing to explain, so no number explains it
        return None
    fewest = min(trial.change.columns.shape[2] for trial in enough)
    best = max((t for t in enough if t.change.columns.shape[2] == fewest), key=_sure)
    return best._replace(others=tuple(t.effect for t in enough if t is not best and t.effect))


_sure = attrgetter('sure')
