# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Did the set-up move: a step of the base at one time, or a slow settling?"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ..problem import Model, Problem
from .base_change import BaseChange, base_change
from .case import Case, Finding, length, measured

SURE = 10.0
"""Nats by which a change must beat no change, and a step every smooth change or step of joints."""
MOST = 3
MOST_ROWS = 18000
EDGE = 0.04
"""A step nearer to either end of a recording, as a share of it, is not looked for."""
CONSTANTS = np.geomspace(0.02, 0.7, 9)
"""Time constants of settling, as shares of the recording."""


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
    """Return steps and settling of the set-up in what the aligned model leaves."""
    out = [
        Finding('warning', _moved(case, step))
        for step in moved_setup(case.residuals, case.problem, case.model)
    ]
    out += [
        Finding(
            'note',
            f'The set-up of {found.recording} settles by {length(found.size)} with a time '
            f'constant of {found.time_constant:.3g} {_unit(case, found.recording)}, as in '
            'warming up.',
        )
        for found in settling(case.residuals, case.problem, case.model)
    ]
    return out


def moved_setup(parts: list[Array], problem: Problem, model: Model) -> list[Step]:
    """
    Return steps of the base frame that explain much more than any smooth change.

    Parameters
    ----------
    parts : list of array, shape (c, M)
        Residuals of the model, one per recording; of the baseline or of any later model.
    problem : Problem
    model : Model

    """
    problem, parts = _thinned(problem, parts)
    change = base_change(parts, problem, model)
    out: list[Step] = []
    for _ in range(MOST):
        found = _best_step(change, problem)
        if found is None:
            break
        step, shape = found
        out.append(step)
        change = change.without(shape)
    return out


def settling(parts: list[Array], problem: Problem, model: Model) -> list[Settling]:
    """Return exponential settlings of the base, one per recording at most; see `moved_setup`."""
    problem, parts = _thinned(problem, parts)
    change = base_change(parts, problem, model)
    out = []
    for k, recording in enumerate(problem.recordings):
        mine = change.recording == k
        age = _age(problem, k)
        shapes = [_placed(np.exp(-age / c), mine) for c in CONSTANTS]
        best = int(np.argmax([change.gain(shape) for shape in shapes]))
        nats = change.nats(shapes[best])
        if nats < SURE:
            continue
        steps = change.step_gains(k)
        others = [age, age**2, np.arange(steps.size) >= steps.argmax()]
        if nats > max(change.nats(_placed(other, mine)) for other in others) + SURE:
            span = float(np.ptp(measured(recording).t))
            size = change.size(shapes[best])
            out.append(Settling(recording.name, float(CONSTANTS[best]) * span, size, nats))
    return out


def _best_step(change: BaseChange, problem: Problem) -> tuple[Step, Array] | None:
    best: tuple[Step, Array] | None = None
    for k, recording in enumerate(problem.recordings):
        mine = change.recording == k
        gains = change.step_gains(k)
        whole = k > 0 and 'base' not in problem.align
        edge = max(3, int(EDGE * gains.size))
        allowed = np.zeros(gains.size, dtype=bool)
        allowed[edge:-edge] = True
        allowed[0] = whole
        if not allowed.any():
            continue
        at = int(np.where(allowed, gains, -np.inf).argmax())
        shape = _placed(np.arange(gains.size) >= at, mine)
        nats = change.nats(shape)
        rivals = (change.nats(_smooth(change, problem, k)), change.of_joints.nats(shape))
        if nats < SURE + max(0.0, *rivals):
            continue
        step = Step(recording.name, float(measured(recording).t[at]), change.size(shape), nats)
        if best is None or step.significance > best[0].significance:
            best = step, shape
    return best


def _smooth(change: BaseChange, problem: Problem, k: int) -> Array:
    """Return the smooth change of recording k's base that explains most, shape (M,)."""
    mine, age = change.recording == k, _age(problem, k)
    shapes = [age, age**2, *(np.exp(-age / c) for c in CONSTANTS)]
    shapes += [np.exp(-(1.0 - age) / c) for c in CONSTANTS]
    shapes += [np.sin(n * np.pi * age) for n in (1, 2)] + [np.cos(n * np.pi * age) for n in (1, 2)]
    return max((_placed(shape, mine) for shape in shapes), key=change.gain)


def _age(problem: Problem, k: int) -> Array:
    """Return time in the recording as a share of it, shape (M,)."""
    t = measured(problem.recordings[k]).t
    return np.asarray((t - t[0]) / max(float(np.ptp(t)), 1e-9))


def _placed(shape: NDArray[Any], mine: NDArray[np.bool_]) -> Array:
    out = np.zeros(mine.size)
    out[mine] = shape
    return out


def _thinned(problem: Problem, parts: list[Array]) -> tuple[Problem, list[Array]]:
    few = problem.thinned(MOST_ROWS)
    out = []
    for whole, thin, part in zip(problem.recordings, few.recordings, parts, strict=True):
        out.append(part[:, np.isin(measured(whole).t, measured(thin).t)])
    return few, out


def _moved(case: Case, step: Step) -> str:
    recording = next(r for r in case.recordings if r.name == step.recording)
    if step.time == measured(recording).t[0]:
        return (
            f'The set-up moved by {length(step.size)} before {step.recording}; have the base '
            'aligned, so that each recording gets its own.'
        )
    unit = _unit(case, step.recording)
    when = f'station {step.time:.4g}' if unit == 'stations' else f't = {step.time:.4g} s'
    return (
        f'The set-up of {step.recording} moved by {length(step.size)} at {when}; split the '
        'recording there and have the base aligned, so that each part gets its own.'
    )


def _unit(case: Case, name: str) -> str:
    static = any(r.name == name and r.joints.static for r in case.recordings)
    return 'stations' if static else 's'
