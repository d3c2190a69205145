# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Do readings of joints stand still, to the last digit, while the tool goes on?"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...recording import JointMotion, Recording
from ..algebra.problem import Model
from ..frames.alignment import refined
from .evidence import Case, Finding, distance, mistake
from .lengths import length
from .limits import (
    BY_ITSELF,
    STUCK_AFTER,
    STUCK_EXPLAINED,
    STUCK_LEAST,
    STUCK_STATIONS,
    STUCK_STRAYS,
    TINY,
)

ROUNDS = 12
"""Newton steps that find where a joint really stood; it may have gone on by a radian."""
STEP = 1e-5
"""Step [rad, m] of the derivative by a joint's position."""
REFITS = 3
"""Standing stretches, the longest, that frames are fitted without: arms that rest have dozens."""
FIT_ROWS = 2000
"""Rows of such a fit, which has twelve numbers to find."""
ENOUGH = 12
"""Measurements that must remain for it."""
LONGEST_STEP = 0.3
"""Longest Newton step [rad, m]: farther, the derivative means nothing."""


def stuck(case: Case) -> Iterator[Finding]:
    """Yield stretches in which a joint's reading stands still and the tool says it moved."""
    for k, recording in enumerate(case.recordings):
        if whole := _whole(recording):
            yield whole
        elif result := list(_joints(case, k)):
            yield max(result, key=lambda pair: pair[0])[1]


def _whole(recording: Recording) -> Finding | None:
    """Return that all joints stand still together while the measured tool moves."""
    seen = recording.seen
    for start, end in _runs(recording.joints.q, recording.joints):
        inside = _inside(recording, start, end)
        if inside.sum() < 2:
            continue
        way = _way(seen.position[inside])
        if way > BY_ITSELF:
            sentence = (
                f'The joint positions of {recording.name} stand still {_when(recording, start, end)}'
                f' while the tool moves by {length(way)}.'
            )
            return mistake(sentence, 'joints_stuck', (), REMEDY)
    return None


def _way(position: Array) -> float:
    """Return how far places (M, 3) lie apart [m], without those that lie farthest out."""
    off = np.linalg.norm(position - np.median(position, axis=0), axis=1)
    left_out = max(1, round(STUCK_STRAYS * len(off)))
    kept = position[np.argsort(off)[:-left_out]]
    return float(np.ptp(kept, axis=0).max())


REMEDY = 'See to the driver that publishes the joint states, and measure again'


def _joints(case: Case, k: int) -> Iterator[tuple[float, Finding]]:
    """Yield joints whose own motion would explain the gap while their reading stands still."""
    recording, refits = case.recordings[k], 0
    for start, end, i in _longest(case, k):
        inside = _inside(recording, start, end)
        if inside.sum() < 2 or inside.all():
            continue
        model, off = case.model, distance(case.residuals[k])
        if np.median(off[inside]) > max(BY_ITSELF, float(np.median(off[~inside]))):
            # Frames that were fitted to the stretch as well leave some of its gap elsewhere.
            if case.problem.align and refits < REFITS and (~inside).sum() > ENOUGH:
                refits += 1
                model, off = _unfitted(case, k, inside)
            result = _freed_there(model, recording, k, i, (start, end), off)
            if result is not None:
                yield result


def _longest(case: Case, k: int) -> list[tuple[int, int, int]]:
    """Return first sample, last sample and joint of every standing stretch, long ones first."""
    joints = case.recordings[k].joints
    result = [
        (start, end, i)
        for i in range(joints.q.shape[1])
        for start, end in _runs(joints.q[:, i : i + 1], joints)
    ]
    return sorted(result, key=lambda run: run[0] - run[1])


def _unfitted(case: Case, k: int, inside: NDArray[np.bool_]) -> tuple[Model, Array]:
    """Return the model with its frames fitted to all but a stretch, and the gaps it leaves."""
    recordings = list(case.recordings)
    recordings[k] = recordings[k].with_measured(recordings[k].seen.take(~inside))
    problem = replace(case.problem, recordings=tuple(recordings)).thinned(FIT_ROWS)
    model = refined(problem, case.model)
    return model, distance(case.problem.residuals(model)[k])


def _freed_there(
    model: Model, recording: Recording, k: int, i: int, run: tuple[int, int], off: Array
) -> tuple[float, Finding] | None:
    """Return that a joint went on while its reading stood still, and how much that explains."""
    inside, name = _inside(recording, *run), model.robot.joint_names[i]
    gap, rest = float(np.median(off[inside])), float(np.median(off[~inside]))
    if gap < max(BY_ITSELF, STUCK_EXPLAINED * rest):
        return None
    remaining = _freed(model, recording, k, i, inside)
    if remaining > gap / STUCK_EXPLAINED:
        return None
    sentence = (
        f'The reading of joint {name!r} of {recording.name} stands still '
        f'{_when(recording, *run)} while the joint moves: the gap there is '
        f'{length(gap)}, and {length(remaining)} with the joint set free.'
    )
    return gap / remaining, mistake(sentence, 'joints_stuck', (name,), REMEDY)


def _runs(q: Array, joints: JointMotion) -> list[tuple[int, int]]:
    """Return first and last sample of every stretch in which q (N, m) does not change at all."""
    still = np.r_[False, (np.diff(q, axis=0) == 0.0).all(axis=1), False]
    edges = np.flatnonzero(np.diff(still.astype(int)))
    out = []
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        enough = (
            end - start >= STUCK_STATIONS
            if joints.static
            else joints.t[end] - joints.t[start] > STUCK_LEAST
        )
        if enough:
            out.append((int(start), int(end)))
    return out


def _inside(recording: Recording, start: int, end: int) -> NDArray[np.bool_]:
    """Return which measurements lie in a stretch, bool (M,); after a stop the arm settles."""
    joints, t = recording.joints, recording.seen.t
    # Between the last still sample and the next the stream is already on its way.
    first, last = joints.t[start], joints.t[end]
    if not joints.static:
        first, last = first + STUCK_AFTER, joints.t[end - 1]
    return np.asarray((t >= first) & (t <= last), dtype=bool)


def _freed(model: Model, recording: Recording, k: int, i: int, inside: NDArray[np.bool_]) -> float:
    """Return the median gap [m] when joint i may stand anywhere at every measurement."""
    seen = recording.seen.take(inside)
    q = np.array(recording.joints.at(seen.t)[0])
    twin = model.twin(k)

    def tip(positions: Array) -> Array:
        motion = JointMotion(seen.t, positions, static=True)
        still = replace(recording, joints=motion, measured=seen)
        return twin.poses(still, seen.t).position

    nudge = np.zeros(q.shape[1])
    nudge[i] = STEP
    for _ in range(ROUNDS):
        here = tip(q)
        column = (tip(q + nudge) - here) / STEP
        pull = ((seen.position - here) * column).sum(axis=1)
        step = pull / np.maximum((column**2).sum(axis=1), TINY)
        q[:, i] += np.clip(step, -LONGEST_STEP, LONGEST_STEP)
    return float(np.median(np.linalg.norm(seen.position - tip(q), axis=1)))


def _when(recording: Recording, start: int, end: int) -> str:
    t = recording.joints.t
    if recording.joints.static:
        return f'from station {start} to {end}'
    return f'from t = {t[start]:.4g} to {t[end]:.4g} s'
