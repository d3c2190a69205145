# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Did something give way at an instant: instrument or base, the tool, one joint? Did the base settle?

Residuals of an arm follow its pose, and poses follow time, so any motion looks a little like a change
of the frame. Constant frames, all that the library has of joints and links but changes in time, and the
instrument's scale are projected out to first order; what is left is searched for a step of each thing.
It is dated only where it explains much more than any smooth change of the same thing or of another.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from operator import attrgetter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from ...arrays import Array
from ...effects.dated import InstrumentKnock, JointSlip, Sudden, ToolSlip
from ...effects.effect import Effect
from ...effects.instrument import MeasurementScale
from ...effects.plausible import spreads
from ...recording import Recording
from ...twin.features import Features
from ..algebra.definite import outside, span_of
from ..algebra.fit import HUBER
from ..algebra.independent_rows import effective_share
from ..algebra.motions import moved_most, plain_causes
from ..algebra.problem import Model, Problem, Scale
from ..limits import FEW, MARGIN, MOST, TINY, WIDER
from ..result import Site
from .lag import KEPT
from .lengths import instant, length

LASTING = ('constant', 'angle', 'direction', 'speed', 'acceleration', 'load', 'temperature')
"""What errors of an arm depend on that are no change in time."""
FEWEST = 12.0
"""Independent rows that are counted at the least: two frames have as many numbers."""
TIED = 1e-6
"""Pull of a change to zero, in units of its columns: decides what data leave open."""
CONSTANTS = np.geomspace(0.05, 0.7, 13)
"""Time constants of settling, as shares of the recording."""
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
class Rest:
    """What frames and arm leave of every sample, and what may have changed while it was measured."""

    residual: Array  # shape (M, c) in units of noise
    basis: Array  # orthonormal: what frames and arm can explain, shape (P, M c)
    things: Mapping[str, tuple[Array, Array]]
    """What 'base', 'tool' and 'joints' do to every sample, whitened, and to its position [m]."""
    rows: tuple[int, ...]  # components of a sample, by recording
    samples: tuple[int, ...]  # by recording
    noise: float  # unit of the positions [m]

    def rms(self, k: int) -> float:
        """Return the RMS distance [m] that is left of recording k, as a lag counts it."""
        own = np.sort((self.residual[self.recording == k][:, :3] ** 2).sum(axis=1))
        return self.noise * float(np.sqrt(own[: max(int(KEPT * own.size), 1)].mean()))

    @cached_property
    def recording(self) -> NDArray[np.int_]:
        return np.repeat(np.arange(len(self.samples)), self.samples)

    @property
    def far(self) -> float:
        """Return the sum of squares of positions that is left; turns may be nothing but noise."""
        return float((self.residual[:, :3] ** 2).sum())

    @cached_property
    def share(self) -> float:
        own = [self.residual[self.recording == k][:, :c].ravel() for k, c in enumerate(self.rows)]
        return effective_share(np.concatenate(own), self.rows, self.samples)

    def change(self, thing: str, some: slice = slice(None)) -> Change:
        columns, metres = self.things[thing]
        return Change(self, columns[:, :, some], metres[:, :, some])


@dataclass(frozen=True, eq=False)
class Change:
    """One thing that may have changed in some shape of time, (M,), against what is left."""

    rest: Rest
    columns: Array
    metres: Array

    @cached_property
    def _terms(self) -> tuple[Array, Array, Array]:
        """Return every sample's share of right hand side (M, i), overlap (M, p, i), normal."""
        turned = np.swapaxes(self.columns, 1, 2)
        right = np.matmul(turned, self.rest.residual[:, :, None])[:, :, 0]
        basis = self.rest.basis.reshape(-1, *self.rest.residual.shape).transpose(1, 0, 2)
        overlap = np.matmul(basis, self.columns)
        return right, overlap, np.matmul(turned, self.columns)

    def _summed(self, shapes: Array) -> tuple[Array, Array]:
        """Return right hand sides (S, i) and normal matrices (S, i, i) of shapes, (S, M)."""
        right, overlap, normal = self._terms
        count, size = shapes.shape[0], right.shape[1]
        across = (shapes @ overlap.reshape(len(overlap), -1)).reshape(count, -1, size)
        own = (shapes**2 @ normal.reshape(len(normal), -1)).reshape(count, size, size)
        return shapes @ right, own - np.matmul(np.swapaxes(across, 1, 2), across)

    def gains(self, shapes: Array) -> Array:
        """Return the sum of squares that each of several shapes, (S, M), explains, (S,)."""
        right, normal = self._summed(shapes)
        return np.asarray((right * _solved(right, normal)).sum(axis=1))

    def best(self, shapes: Sequence[Array]) -> Array:
        return shapes[int(self.gains(np.array(shapes)).argmax())]

    def step_gains(self, k: int, after: NDArray[np.bool_]) -> Array:
        """
        Return the gain of a step before every sample of recording k, shape (M_k,).

        after: samples of recordings that came later, shape (M,).
        """
        mine = self.rest.recording == k
        # Sums over each sample and all later ones.
        right, overlap, normal = (
            np.cumsum(t[mine][::-1], axis=0)[::-1] + t[after].sum(axis=0) for t in self._terms
        )
        normal = normal - np.matmul(np.swapaxes(overlap, 1, 2), overlap)
        return np.asarray((right * _solved(right, normal)).sum(axis=1))

    def size(self, shape: Array) -> float:
        """Return the RMS motion [m] of the measured points for the fitted change."""
        active = 2.0 * np.abs(shape) > FEW * np.abs(shape).max()
        moved = self.metres[active] @ _solved(*self._summed(shape[None]))[0]
        return float(np.sqrt((moved**2).sum(axis=1).mean()))

    def taken_out(self, shape: Array) -> Rest:
        """Return what is left once the change is fitted, too."""
        rest = self.rest
        new = span_of(outside(_rows(self.columns * shape[:, None, None]), rest.basis))
        remaining = outside(rest.residual.reshape(1, -1), new).reshape(rest.residual.shape)
        return replace(rest, residual=remaining, basis=np.concatenate([rest.basis, new]))

    def log_bayes_factor(self, shape: Array) -> float:
        """
        Return the evidence for a change.

        Noise of positions and of turns, strays among them, and how many rows are independent, are
        those the change leaves: a step makes residuals that hang together, and hides strays.
        """
        rest, after = self.rest, self.taken_out(shape)
        # Of few stations frames and arm take most rows up; those tell nothing for a change.
        size = float(sum(c * m for c, m in zip(rest.rows, rest.samples, strict=True)))
        free = max(1.0 - len(after.basis) / size, 0.0)
        total, fall = 0.0, 0.0
        for part in (slice(0, 3), slice(3, 6)):
            weight = _of_strays(after.residual[:, part])
            each = ((c.residual[:, part] ** 2).sum(axis=1) for c in (rest, after))
            before, remaining = (float(weight @ square) for square in each)
            if before > 0.0:
                count = max(after.share * free * after.residual[:, part].size, FEWEST)
                fall += count * float(np.log(before / max(remaining, TINY**2 * before)))
                total += count
        return (fall - float(self.columns.shape[2] * np.log(max(total, FEWEST)))) / 2.0


def rest_of(parts: list[Array], problem: Problem, model: Model) -> Rest:
    """Return the residual of a model, (c, M) parts, ready to be searched for changes in time."""
    scale, n, features = _scale(parts), model.robot.n, problem.features(model)
    remaining = _whitened(problem, [part[None] for part in parts], scale)
    arm = _whitened(problem, _of_arm(problem, model, features), scale)
    things = {}
    for thing, channel, count in (('base', 'base', 6), ('tool', 'tool', 6), ('joints', 'q', n)):
        moved = [np.stack([f.column((channel, j)) for j in range(count)]) for f in features]
        metres = np.concatenate([part[:, :3].transpose(2, 1, 0) for part in moved])
        own = [problem.seen(k, part) for k, part in enumerate(moved)]
        things[thing] = _whitened(problem, own, scale), metres
    bases = [things['base'][0]]
    if 'base' in problem.align:
        number = np.repeat(np.arange(len(parts)), problem.samples)
        bases = [bases[0] * (number == k)[:, None, None] for k in range(len(parts))]
    frames = span_of(_rows(np.concatenate([*bases, things['tool'][0]], axis=2)))
    # Of the arm only what is strong enough to be seen.
    basis = np.concatenate([frames, _strong(outside(_rows(arm), frames))])
    remaining = outside(_rows(remaining), basis).reshape(remaining.shape[:2])
    return Rest(remaining, basis, things, problem.rows, problem.samples, scale.position)


def _of_arm(problem: Problem, model: Model, features: list[Features]) -> list[Array]:
    """Return columns of all that an arm and the scale of its instrument do, (P, c, M) per recording."""
    view = features[moved_most(features, None)].view
    parts = []
    for effect in (*plain_causes(model.robot, view, LASTING), MeasurementScale()):
        size = WIDER * spreads(model.robot, effect)
        known = np.isfinite(size)
        columns = problem.effect_columns(features, effect, atoms=False)
        parts.append([part[known] * size[known, None, None] for part in columns])
    return [np.concatenate(own) for own in zip(*parts, strict=True)]


def _scale(parts: list[Array]) -> Scale:
    """Return a scale wide enough for both sides of a step: a robust one sides with the longer."""
    size = [
        float(np.quantile(np.abs(np.concatenate([p[rows].ravel() for p in parts])), 1.0 - FEW))
        / ndtri(1.0 - FEW / 2.0)
        if any(p[rows].size for p in parts)
        else 1.0
        for rows in (slice(0, 3), slice(3, 6))
    ]
    position, turn = (max(s, TINY) for s in size)
    off = [np.linalg.norm(p[:3], axis=0) / (np.sqrt(3) * position) for p in parts]
    weights = tuple(np.minimum(1.0, (HUBER / np.maximum(o, TINY)) ** 2) for o in off)
    return Scale(position, turn, weights)


def _of_strays(residual: Array) -> Array:
    """Return the weight of every sample (M, c) beside the size of most, (M,)."""
    off = np.linalg.norm(residual, axis=1)
    # Points have empty rows where poses have turns.
    usual = np.median(off[off > TINY]) if (off > TINY).any() else TINY
    return np.asarray(np.minimum(1.0, (HUBER * usual / np.maximum(off, TINY)) ** 2))


def _whitened(problem: Problem, parts: Sequence[Array], scale: Scale) -> Array:
    """Return (P, c_k, M_k) columns of all recordings whitened as one array, (M, c, P)."""
    most = max(problem.rows)
    each = [problem.in_noise(k, part, scale).transpose(1, 2, 0) for k, part in enumerate(parts)]
    # Points are filled up with empty rows.
    return np.concatenate([np.pad(p, ((0, 0), (0, most - p.shape[1]), (0, 0))) for p in each])


def _rows(columns: Array) -> Array:
    return np.asarray(columns.reshape(columns.shape[0] * columns.shape[1], -1).T)


def _strong(columns: Array) -> Array:
    """Return orthonormal directions of columns, (P, rows), that are stronger than the noise."""
    strength, ways = np.linalg.eigh(columns @ columns.T)
    seen = strength > 1.0
    return np.asarray((ways[:, seen] / np.sqrt(strength[seen])).T @ columns)


def _solved(right: Array, normal: Array) -> Array:
    """Return the change of each of several systems, (S, i), zero where nothing moves."""
    mass = np.diagonal(normal, axis1=1, axis2=2)
    live = mass > TINY**2 * float(mass.max(initial=TINY))
    size = np.where(live, np.sqrt(np.maximum(mass, 0.0)), np.inf)
    scaled = normal / (size[:, :, None] * size[:, None, :]) + TIED * np.eye(mass.shape[1])
    unit = (right / size)[:, :, None]
    return np.asarray(np.linalg.solve(scaled, unit)[:, :, 0] / size)


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
    def any_of(self) -> tuple[Sudden, ...]:
        """Return everything that it may have been; the evidence of a whole fit decides."""
        return (self.effect, *self.others)

    def told_as(self, one: Sudden, sets: Sequence[Sequence[Site]]) -> Slip:
        """Return it as one of these, beside those that all data do not tell from that one."""
        own = next((group for group in sets if Site.of(one) in group), ())
        others = (each for each in self.any_of if each is not one and Site.of(each) in own)
        return replace(self, effect=one, others=tuple(others))

    def time(self, recording: Recording) -> float:
        """Return when [s] by its recording's stamps, between the measurements before and after."""
        return self.effect.time - recording.later

    @property
    def alike(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        return tuple((_WORDS[type(other)][0], (other.at,)) for other in self.others)

    def sentence(self, recording: Recording) -> str:
        what, time = _WORDS[type(self.effect)][1], self.time(recording)
        inside = time > recording.seen.t[0]
        when = f'at {instant(recording, time)} of' if inside else 'before'
        out = f'{what.format(self.effect.at)} {when} {recording.name}: the tool is '
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
            # At rest a smooth shape was the best of many, as the instant of a step was, which has paid
            # for it; and among the causes a step has to earn its place beside all others.
            still = recording.joints.static
            ahead = -float(np.log(len(self._shapes(k)))) if still else MARGIN
            if step is not None and surest > max(least, smooth.sure + ahead):
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
        late = [np.exp(-(1.0 - age) / constant) for constant in CONSTANTS]
        waves = [wave(n * np.pi * age) for n in (1, 2) for wave in (np.sin, np.cos)]
        out += [(0.0, shape) for shape in (age, age**2, *late, *waves)]
        # It may have moved between recordings, not within one.
        out += [(MOVED_BEFORE, np.ones(age.size))] if len(self.problem.recordings) > 1 else []
        return [(constant, self._in_recording(shape, k)) for constant, shape in out]

    def _smooth(self, k: int) -> Iterator[_Trial]:
        shapes = self._shapes(k)
        # What a joint or the tool did between recordings is a step.
        within = [each for each in shapes if each[0] != MOVED_BEFORE]
        for effect, change in self._kinds:
            own = shapes if isinstance(effect, InstrumentKnock) else within
            best = int(change.gains(np.array([shape for _, shape in own])).argmax())
            constant, shape = own[best]
            yield _Trial(change.log_bayes_factor(shape), change, shape, k, constant=constant)

    def _steps(self, k: int) -> Iterator[_Trial]:
        recording = self.problem.recordings[k]
        t, after = recording.seen.t, self._after(k)
        # At the ends of a recording a step cannot be told from the end's own troubles.
        edge = max(3, int(FEW * t.size / 2.0))
        allowed = np.zeros(t.size, dtype=bool)
        allowed[edge : t.size - edge] = True
        for other, at in self.taken:
            if other == k:
                allowed[max(at - edge, 0) : at + edge] = False
        # A base of its own takes up what moved before.
        before, began = self._before(recording), allowed.copy()
        began[0] = before < t[0]
        for effect, change in self._kinds:
            may = allowed if isinstance(effect, InstrumentKnock) else began
            if not may.any():
                continue
            at = int(np.where(may, change.step_gains(k, after), -np.inf).argmax())
            shape = self._in_recording((np.arange(t.size) >= at).astype(np.float64), k) + after
            # Every instant was asked; the best of many is better than it should be.
            asked = t.size if at else len(self.problem.recordings)
            log_bayes_factor = change.log_bayes_factor(shape) - float(np.log(asked))
            time = float((t[at - 1] if at else before) + t[at]) / 2.0 + recording.later
            slip = replace(effect, time=time)  # type: ignore[call-arg]
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
            moved = self.problem.recordings[max(k, 1)]
            knock = InstrumentKnock(time=float(moved.seen.t[0]) + moved.later)
            yield Slip(knock, max(k, 1), size, smooth.sure, dated=False)
        else:
            yield Settling(k, late, size)

    def _age(self, k: int) -> Array:
        t = self.problem.recordings[k].seen.t
        return np.asarray((t - t[0]) / max(float(np.ptp(t)), TINY))

    def _before(self, recording: Recording) -> float:
        """Return when the last measurement before a recording was, by its stamps [s]; inf for none."""
        ends = [float(r.seen.t[-1]) + r.later - recording.later for r in self.problem.recordings]
        return max((end for end in ends if end < recording.seen.t[0]), default=np.inf)

    def _after(self, k: int) -> NDArray[np.bool_]:
        """Return the samples of recordings that began later: what gave way stays so in them."""
        began = np.array([r.joints.t[0] + r.later for r in self.problem.recordings])
        return np.repeat(began > began[k], self.rest.samples)

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
