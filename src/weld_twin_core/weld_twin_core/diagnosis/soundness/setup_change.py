# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Did the set-up move: a step of the base at one time, or a slow settling?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ..algebra.problem import Problem
from .base_change import CONSTANTS, BaseChange, other_shapes
from .evidence import Case, Finding, distance, length
from .lengths import instant
from .snapshot import measured

SURE = 6.0
"""Nats by which a change of a set-up of stations must beat no change."""
SURE_MOVING = 20.0
"""The same for a moving arm, whose residuals hang together however good the model."""
MARGIN = 10.0
"""Nats by which a step must beat every smooth change, and a settling every other."""
MOST = 4
"""Most steps that are looked for in a recording."""
SEEN = 2.0
"""
A change this many times as large as the largest gaps did not happen: whatever is aligned, one side
of a step keeps half of it. A strong shake makes such steps that other columns undo.
"""
LARGEST = 0.99
"""Quantile of the gaps that counts as the largest; the last per cent may be outliers."""
EDGE = 0.05
"""A step nearer to an end of a recording or another step, as a share, is not looked for."""
SLOW = 2.0
"""Seconds below which nothing warms up; what dies away faster is a transient of the arm."""
NEIGHBOURS = np.geomspace(0.8, 1.25, 7)
"""Factors on a rough time constant that are tried about it."""


class Step(NamedTuple):
    """A step of the base: where, when [s], RMS motion [m] of the points, evidence in nats."""

    recording: str
    time: float
    size: float
    significance: float


class Settling(NamedTuple):
    """A settling of the base: where, time constant [s], RMS motion [m] at its start, nats."""

    recording: str
    time_constant: float
    size: float
    significance: float


def setup(case: Case) -> Sequence[Finding]:
    """Return steps and settling of the set-up; those that are dated are causes, and told there."""
    found = changes_of(*case.change)
    most = SEEN * max(float(np.quantile(distance(part), LARGEST)) for part in case.residuals)
    return [
        Finding('warning', _moved(case, each))
        if isinstance(each, Step)
        else Finding('note', _settled(case, each))
        for each in found
        if each.size < most and not (isinstance(each, Step) and case.slips)
    ]


def changes_of(problem: Problem, change: BaseChange) -> list[Step | Settling]:
    """
    Return steps and settlings of the base frame, strongest first.

    A step is named only when it explains much more than any smooth change and than a step of
    the joints, a settling only when a steady drift does not do as well; what is neither is taken
    out before the next is looked for.

    Parameters
    ----------
    problem : Problem
    change : BaseChange
        What a change in time would explain of its residuals.

    """
    out: list[Step | Settling] = []
    taken: list[_Trial] = []
    for _ in range(MOST):
        trials = [t for k in range(len(problem.rows)) for t in _trials(change, problem, k, taken)]
        best = max(trials, key=lambda trial: trial.nats, default=None)
        if best is None:
            break
        taken.append(best)
        if best.named is not None:
            out.append(best.named)
        change = change.without(best.shape)
    return out


class _Trial(NamedTuple):
    """A shape in time, its evidence, the sample where it is abrupt, and its name if it has one."""

    recording: int
    shape: Array
    nats: float
    at: int | None
    named: Step | Settling | None


def _trials(
    change: BaseChange, problem: Problem, k: int, taken: Sequence[_Trial]
) -> Iterator[_Trial]:
    """Yield the best smooth change and the best step of recording k, where they are sure."""
    recording, mine = problem.recordings[k], change.recording == k
    t, age = measured(recording).t, _age(problem, k)
    before = [trial.at for trial in taken if trial.recording == k]
    sure = SURE if recording.joints.static else SURE_MOVING
    constant, others = _smooth(change, mine, age)
    settled = _placed(np.exp(-age / constant), mine)
    other = max((_placed(shape, mine) for shape in others), key=change.gain)
    nats, plain = change.nats(settled), change.nats(other)
    if max(nats, plain) > sure and None not in before:
        span = float(np.ptp(t))
        slow = recording.joints.static or constant * span > SLOW
        if slow and nats > MARGIN + max(plain, change.of_joints.nats(settled)):
            found = Settling(recording.name, constant * span, change.size(settled), nats)
            yield _Trial(k, settled, nats, None, found)
        else:
            yield _Trial(k, other if plain > nats else settled, max(nats, plain), None, None)
    at = _step(change, k, before, whole=k > 0 and 'base' not in problem.align)
    if at is None:
        return
    shape = _placed(np.arange(t.size) >= at, mine)
    abrupt, joints = change.nats(shape), change.of_joints.nats(shape)
    joints += 0.0 if recording.joints.static else MARGIN
    if abrupt > max(sure, MARGIN + max(nats, plain), joints):
        yield _Trial(
            k, shape, abrupt, at, Step(recording.name, float(t[at]), change.size(shape), abrupt)
        )


def _step(change: BaseChange, k: int, before: Sequence[int | None], *, whole: bool) -> int | None:
    """Return the sample before which a step of recording k's base explains most."""
    gains = change.step_gains(k)
    edge = max(3, int(EDGE * gains.size))
    allowed = np.zeros(gains.size, dtype=bool)
    allowed[edge:-edge] = True
    allowed[0] = whole
    for at in before:
        if at is not None:
            allowed[max(at - edge, 0) : at + edge] = False
    return int(np.where(allowed, gains, -np.inf).argmax()) if allowed.any() else None


def _smooth(change: BaseChange, mine: NDArray[np.bool_], age: Array) -> tuple[float, list[Array]]:
    """Return the best time constant of a settling, and other smooth shapes of a recording."""

    def gain(constant: float) -> float:
        return change.gain(_placed(np.exp(-age / constant), mine))

    rough = max(CONSTANTS, key=gain)
    best = max(rough * NEIGHBOURS, key=gain)
    return float(best), other_shapes(age)


def _age(problem: Problem, k: int) -> Array:
    """Return time in the recording as a share of it, shape (M,)."""
    t = measured(problem.recordings[k]).t
    return np.asarray((t - t[0]) / max(float(np.ptp(t)), 1e-9))


def _placed(shape: NDArray[Any], mine: NDArray[np.bool_]) -> Array:
    out = np.zeros(mine.size)
    out[mine] = shape
    return out


def _moved(case: Case, step: Step) -> str:
    recording = next(r for r in case.recordings if r.name == step.recording)
    if step.time == measured(recording).t[0]:
        return (
            f'The set-up moved by {length(step.size)} before {step.recording}; have the base '
            'aligned, so that each recording gets its own.'
        )
    return (
        f'The set-up of {step.recording} moved by {length(step.size)} at '
        f'{instant(recording, step.time)}; split the '
        'recording there and have the base aligned, so that each part gets its own.'
    )


def _settled(case: Case, found: Settling) -> str:
    recording = next(r for r in case.recordings if r.name == found.recording)
    constant, unit = found.time_constant, 's'
    if recording.joints.static:
        constant, unit = constant / float(np.median(np.diff(measured(recording).t))), 'stations'
    return (
        f'The set-up of {found.recording} settles by {length(found.size)} with a time constant of '
        f'{constant:.3g} {unit}, as in warming up.'
    )
