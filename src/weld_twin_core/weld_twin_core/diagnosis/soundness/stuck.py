# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Do readings of joints stand still, to the last digit, while the tool goes on? Does one stray alone?"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...recording import JointMotion, Recording
from ...twin.features import Features
from ..algebra.problem import ROWS, Model
from ..frames.alignment import refined
from ..limits import CLEAR, ENOUGH, FEW, LATE, MOST, MOVED, RUN, SOUND
from .evidence import Case, Finding, mistake
from .lengths import distance, length

REMEDY = 'See to the driver that publishes the joint states, and measure again'


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
        if way > SOUND:
            sentence = (
                f'The joint positions of {recording.name} stand still {_when(recording, start, end)}'
                f' while the tool moves by {length(way)}.'
            )
            return mistake(sentence, 'joints_stuck', (), REMEDY)
    return None


def _way(position: Array) -> float:
    """Return how far places (M, 3) lie apart [m], without those that lie farthest out."""
    off = np.linalg.norm(position - np.median(position, axis=0), axis=1)
    left_out = max(1, round(FEW * len(off)))
    kept = position[np.argsort(off)[:-left_out]]
    return float(np.ptp(kept, axis=0).max())


def _joints(case: Case, k: int) -> Iterator[tuple[float, Finding]]:
    """Yield joints whose own motion would explain the gap while their reading stands still."""
    recording, fits = case.recordings[k], 0
    joints, names = recording.joints, case.model.robot.joint_names
    each = range(len(names))
    runs = [(i, *run) for i in each for run in _runs(joints.q[:, i : i + 1], joints)]
    for i, start, end in sorted(runs, key=lambda run: run[1] - run[2]):
        inside = _inside(recording, start, end)
        model, off = case.model, distance(case.residuals[k])
        if inside.sum() < 2 or inside.all() or not _larger(off, inside, 1.0):
            continue
        # Frames that were fitted to the stretch as well leave some of its gap elsewhere; of arms
        # that rest have dozens, only the longest are looked at so.
        if case.problem.align and fits < MOST and (~inside).sum() > ENOUGH:
            fits += 1
            model, off = _fitted_without(case, k, inside)
        if not _larger(off, inside, CLEAR):
            continue
        gap, remaining = float(np.median(off[inside])), _freed(model, recording, k, i, inside)
        if CLEAR * remaining < gap:
            sentence = (
                f'The reading of joint {names[i]!r} of {recording.name} stands still '
                f'{_when(recording, start, end)} while the joint moves: the gap there is '
                f'{length(gap)}, and {length(remaining)} with the joint set free.'
            )
            yield gap / remaining, mistake(sentence, 'joints_stuck', (names[i],), REMEDY)


def _larger(off: Array, inside: NDArray[np.bool_], factor: float) -> bool:
    """Return whether gaps, (M,), are so many times larger inside a stretch than a sound arm's are."""
    return bool(np.median(off[inside]) > max(SOUND, factor * float(np.median(off[~inside]))))


def _fitted_without(case: Case, k: int, inside: NDArray[np.bool_]) -> tuple[Model, Array]:
    """Return the model with its frames fitted to all but a stretch, and the gaps it leaves."""
    recordings = list(case.recordings)
    recordings[k] = recordings[k].with_measured(recordings[k].seen.take(~inside))
    problem = replace(case.problem, recordings=tuple(recordings)).thinned(ROWS)
    model = refined(problem, case.model)
    return model, distance(case.problem.residuals(model)[k])


def _runs(q: Array, joints: JointMotion) -> list[tuple[int, int]]:
    """Return first and last sample of every stretch in which q (N, m) does not change at all."""
    still = np.r_[False, (np.diff(q, axis=0) == 0.0).all(axis=1), False]
    edges = np.flatnonzero(np.diff(still.astype(int)))
    runs = [(int(start), int(end)) for start, end in zip(edges[::2], edges[1::2], strict=True)]
    if joints.static:
        return [(start, end) for start, end in runs if end - start >= RUN]
    # Longer than an arm takes to settle.
    return [(start, end) for start, end in runs if joints.t[end] - joints.t[start] > 2.0 * LATE]


def _inside(recording: Recording, start: int, end: int) -> NDArray[np.bool_]:
    """Return which measurements lie in a stretch, bool (M,); after a stop the arm settles."""
    joints, t = recording.joints, recording.seen.t
    # Between the last still sample and the next the stream is already on its way.
    first, last = joints.t[start], joints.t[end]
    if not joints.static:
        first, last = first + LATE, joints.t[end - 1]
    return np.asarray((t >= first) & (t <= last), dtype=bool)


def _freed(model: Model, recording: Recording, k: int, i: int, inside: NDArray[np.bool_]) -> float:
    """Return the gap [m] of all but a few measurements when joint i may stand anywhere at each."""
    seen, twin = recording.seen.take(inside), model.twin(k)
    column = Features(twin, recording, seen.t).column(('q', i)).T
    away = seen.position - twin.poses(recording, seen.t).position
    if model.robot.prismatic[i]:
        along = column[:, :3]
        off = away - (away * along).sum(axis=1, keepdims=True) * along
        return float(np.quantile(np.linalg.norm(off, axis=1), 1.0 - FEW))
    axis = column[:, 3:]
    lever = np.cross(column[:, :3], axis)
    seen_from_axis = away + lever
    along = (seen_from_axis * axis).sum(axis=1)
    out = np.linalg.norm(seen_from_axis - along[:, None] * axis, axis=1)
    off = np.hypot(along, out - np.linalg.norm(lever, axis=1))
    return float(np.quantile(off, 1.0 - FEW))


def _when(recording: Recording, start: int, end: int) -> str:
    t = recording.joints.t
    if recording.joints.static:
        return f'from station {start} to {end}'
    return f'from t = {t[start]:.4g} to {t[end]:.4g} s'


def without_astray(
    recording: Recording, names: Sequence[str]
) -> tuple[Recording, tuple[str, ...]]:
    """Return it without samples of a motion at which a joint's reading strays alone, and sentences."""
    joints = recording.joints
    each = astray(joints)
    out = np.unique(np.concatenate(each))
    if not out.size:
        return recording, ()
    qd = None if joints.qd is None else np.delete(joints.qd, out, axis=0)
    t, q = np.delete(joints.t, out), np.delete(joints.q, out, axis=0)
    said = (
        f'The reading of joint {name!r} of {recording.name} leapt off its path and back '
        f'{"once" if at.size == 1 else f"{at.size} times"}, first at t = {joints.t[at[0]]:.4g} s to '
        f'{own[at[0]]:.4g}: left out.'
        for name, own, at in zip(names, joints.q.T, each, strict=False)
        if at.size
    )
    return replace(recording, joints=replace(joints, t=t, q=q, qd=qd)), tuple(said)


def astray(joints: JointMotion) -> list[NDArray[np.int_]]:
    """Return the samples of a motion in which each joint's reading leaps off its path and back."""
    if joints.static or joints.t.size <= ENOUGH:
        return [np.zeros(0, dtype=int)] * joints.q.shape[1]
    return [_leaps(joints.t, q) for q in joints.q.T]


def _leaps(t: Array, q: Array) -> NDArray[np.int_]:
    """Return where a position (N,) leaps and back, faster by far than it ever goes besides, (K,)."""
    step = np.diff(q)
    speed = np.abs(step) / np.diff(t)
    there, back = step[:-1], step[1:]
    leap = (there * back < 0.0) & (np.minimum(np.abs(there), np.abs(back)) > MOVED)
    at = np.flatnonzero(leap)
    fast = np.minimum(speed[at], speed[at + 1])
    order = np.argsort(-fast)
    count, usual = 0, np.array(speed)
    for tried, k in enumerate(order[: int(FEW * t.size)].tolist(), start=1):
        usual[at[k] : at[k] + 2] = 0.0
        if fast[k] > CLEAR * usual.max():
            count = tried
    return np.sort(at[order[:count]]) + 1
