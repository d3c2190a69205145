# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Were poses measured, or computed from the joint positions? Were joint positions read at all?

With the constants of a controller's own model some rigid arm agrees with every posture to the last
digit. Of a real one gears, bearings and air leave hundredths of a millimetre, whatever is fitted.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...arrays import Array, spread_over
from ...recording import JointMotion, Recording
from ..algebra.fit import effect_precision, fit
from ..algebra.independent_rows import SAME_STATION, robust_spread
from ..algebra.problem import FRAMES, Model, Problem, Scale
from ..frames.changes import constant_errors
from ..limits import CLEAR, COMPUTED, ENOUGH, MOVED, NOISE, SAMPLES, STEPS, UNEXPLAINED, WORTH
from .evidence import Case, Finding, mistake, note
from .lengths import distance, length, middle_of_each
from .stamps import written

SMOOTH = 2e-8
"""Noise of a joint position [rad, m] below which no encoder has seen it."""


def computed(case: Case) -> Sequence[Finding]:
    """Return the recordings whose poses were computed from the joint positions beside them."""
    return [
        _mistake(recording, remaining)
        for k, recording in enumerate(case.recordings)
        if not recording.simulated and (remaining := _rounding_gap(case, k)) is not None
    ]


def _mistake(recording: Recording, remaining: float) -> Finding:
    much = f'to {length(remaining)}'.replace('to less than 0.001 mm', 'to the last digit')
    return mistake(
        f'The poses of {recording.name} agree with a rigid arm {much}, with no noise: they were '
        'computed from these joint positions, as the controller does, and not measured.',
        'computed',
        ('instrument',),
        "Record what an instrument measures (a tracker, a camera, contacts); a controller's own "
        'pose (tool0, tcp_pose) tells what it believes, not where the tool is',
    )


def _rounding_gap(case: Case, k: int) -> float | None:
    """Return what a rigid arm leaves of a recording [m] where that is no more than rounding."""
    if case.gap > UNEXPLAINED:
        return None
    robot = case.model.robot
    known = case.model.known + case.model.changed(k)
    nominal = Model(robot, (case.model.bases[k],), known)
    # Of few postures only the arm as it was given can be told from one bent to agree.
    for model in (nominal, nominal.with_found(constant_errors(robot))):
        tried = [_stations(recording, model) for recording in _paired(case, k)]
        trials = [(one, _fitted(one, model, 1)) for one in tried if one is not None]
        near = [pair for pair in trials if _gap(*pair) < CLEAR * NOISE]  # after a linear step
        if near:
            problem, start = min(near, key=lambda pair: _gap(*pair))
            remaining = _gap(problem, _fitted(problem, start, 2 * STEPS))
            if remaining < max(COMPUTED, _rounding(problem, start)):
                return remaining
    return None


def _paired(case: Case, k: int) -> Iterator[Recording]:
    """Yield the measurements as stations: with the joints at their stamps, before, after, in order."""
    recording = case.recordings[k]
    joints, seen = recording.joints, recording.seen
    each = [case.motions[k]]
    if not joints.static:
        after = np.searchsorted(joints.t, seen.t).clip(1, joints.t.size - 1)
        each += [joints.q[after - 1], joints.q[after]]
        if joints.t.size == seen.t.size:
            each.append(joints.q)
    for q in each:
        yield Recording(recording.name, JointMotion(seen.t, q, static=True), seen)


def _stations(recording: Recording, model: Model) -> Problem | None:
    """Return some postures that differ as a problem; None where they are too few."""
    seen, q = recording.seen, recording.joints.q
    _, first = np.unique(np.round(q / SAME_STATION), axis=0, return_index=True)
    first = np.sort(first)
    pick = first[spread_over(first.size, 2 * SAMPLES)]
    motion = JointMotion(seen.t[pick], q[pick], static=True)
    problem = Problem((Recording(recording.name, motion, seen.take(pick)),), frozenset(FRAMES))
    # Twice as many numbers as are fitted: fewer agree with any arm.
    return problem if 3 * pick.size > 2 * _count(problem, model) else None


def _count(problem: Problem, model: Model) -> int:
    return problem.frame_count + problem.shared_count + effect_precision(model).size


def _fitted(problem: Problem, model: Model, iterations: int) -> Model:
    scale = Scale(COMPUTED, COMPUTED, tuple(np.ones(m) for m in problem.samples))
    return fit(problem, model, scale, effect_precision(model), iterations=iterations).model


def _gap(problem: Problem, model: Model) -> float:
    """Return the median distance that is left [m], made up for what the fit took."""
    taken = _count(problem, model) / problem.size
    off = middle_of_each([distance(part) for part in problem.residuals(model)])
    return off / float(np.sqrt(1.0 - taken))


def _rounding(problem: Problem, model: Model) -> float:
    """Return the distance [m] that rounding of the numbers leaves, where that is little; else 0."""
    (recording,), (maker,) = problem.recordings, problem.features(model)
    q, turning = recording.joints.q, ~model.robot.prismatic
    step = written(recording.seen.position)
    angle = max(written(q), np.radians(written(np.degrees(q))))
    reach = [maker.column(('q', i))[:3] for i in np.flatnonzero(turning).tolist()]
    squares = np.sum([(column**2).sum(axis=0).mean() for column in reach])
    # A number that is rounded is off by anything up to half a step.
    evenly = 1.0 / (2.0 * np.sqrt(3))
    out = evenly * float(np.hypot(np.sqrt(3) * step, np.sqrt(squares) * angle)) / WORTH
    return out if out < CLEAR * COMPUTED else 0.0


def source(case: Case) -> Iterator[Finding]:
    """Yield a note when moving joint positions carry no trace of an encoder."""
    names = [r.name for r in case.recordings if _commanded(r.joints)]
    if names:
        yield note(
            f'The joint positions of {", ".join(names)} are as smooth as a command: what the '
            'drives make of it (lag, following error) is then part of the gap.'
        )


def _commanded(joints: JointMotion) -> bool:
    if joints.static or joints.t.size < ENOUGH:
        return False
    noise = _noise(joints.q)
    moving = np.ptp(joints.q, axis=0) > MOVED
    return bool(moving.any() and noise[moving].max() < SMOOTH)


def _noise(q: Array) -> Array:
    """Return the noise of every joint from its fifth differences, which a smooth path has not."""
    differences = np.poly(np.ones(5))
    fifth = [np.convolve(column, differences, mode='valid') for column in q.T]
    spread = np.array([robust_spread(each) for each in fifth])
    return np.asarray(spread / np.linalg.norm(differences))
