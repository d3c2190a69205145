# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Every ISO 9283 criterion that a recording allows, by the cycles found in it, and what it lacks.

A *stop* is a station at rest: a row of a static recording, or a stretch of a moving one in which
the arm stands. Stops at the same joint positions are cycles of one commanded pose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..arm.chain import forward
from ..arm.robot import Robot
from ..arm.rotation import nearest_rotation
from ..arrays import Array
from ..errors import DataError
from ..recording import JointMotion, Measurements, Recording
from .iso9283 import (
    DRIFT_CYCLES,
    PATH_CYCLES,
    POSE_CYCLES,
    DriftPerformance,
    PathPerformance,
    PosePerformance,
    along_path,
    crossing_performance,
    drift,
    multidirectional_variation,
    nearest_pass,
    pose_performance,
)

_SAME_POSE = 1e-3
"""
Two stops are of one pose where no joint differs by more [rad or m]; a joint stream repeats within
1e-4, and poses that are meant to differ are degrees apart. What differs is taken off again.
"""
_AT_REST = 2e-3
"""Speed [rad/s or m/s] of the fastest joint below which the arm stands; 2 mm/s a metre away."""
_DWELL = 0.5
"""Seconds an arm stands at least, so that it has settled when the second half begins."""
_LOOK = 0.05
"""Spacing [s] at which motion is looked at for stops; ten looks to the shortest."""
_END = 0.1
"""Share of a stop left out at its end, where clocks that differ would see the arm leave."""


class _Stop(NamedTuple):
    """What was measured while the arm stood."""

    t: float
    """[s]"""
    q: Array
    """Where the joints were commanded to be, shape (n,)."""
    position: Array
    """Shape (3,) [m]."""
    rotation: Array | None
    """Shape (3, 3), or None."""


@dataclass(frozen=True, eq=False)
class PoseCycles:
    """The stops at one commanded pose."""

    q: Array
    """The commanded joint positions of the first of them, shape (n,)."""
    command: Array
    """The pose the robot should then have, shape (4, 4)."""
    t: Array
    """Shape (cycles,) [s]."""
    attained: Array
    """Measured positions, less what their commands differ from the first, (cycles, 3) [m]."""
    rotation: Array | None
    """Shape (cycles, 3, 3), or None."""
    came_from: tuple[int, ...]
    """Number of the pose that the arm stood at before; -1 for the first stop of all."""


def measured_of(recording: Recording) -> Measurements:
    """Return the measurements of a recording; DataError where it has none."""
    if recording.measured is None or recording.measured.t.size == 0:
        raise DataError(f'{recording.name} holds no measured poses or points')
    return recording.measured


def stops(recording: Recording) -> list[_Stop]:
    """Return where the arm stood and was measured, in order of time; DataError for none."""
    measured, joints = measured_of(recording), recording.joints
    if joints.static:
        rows = joints.nearest(measured.t)
        turns = measured.rotation
        return [
            _Stop(
                float(measured.t[k]),
                joints.q[row],
                measured.position[k],
                None if turns is None else turns[k],
            )
            for k, row in enumerate(rows)
        ]
    return [
        result
        for start, end in _rests(joints)
        if (result := _mean_stop(joints, measured, start, end)) is not None
    ]


def _rests(joints: JointMotion) -> list[tuple[float, float]]:
    """Return start and end [s] of where the arm of a motion stands for `_DWELL` or longer."""
    t = np.arange(joints.t[0], joints.t[-1], _LOOK)
    if t.size < 2:
        return []
    speed = np.abs(np.diff(joints.at(t)[0], axis=0)).max(axis=1) / _LOOK
    still = np.concatenate([[False], speed < _AT_REST, [False]]).astype(int)
    begins, ends = np.flatnonzero(np.diff(still) > 0), np.flatnonzero(np.diff(still) < 0)
    return [
        (float(t[a]), float(t[b]))
        for a, b in zip(begins, ends, strict=True)
        if t[b] - t[a] >= _DWELL
    ]


def _mean_stop(
    joints: JointMotion, measured: Measurements, start: float, end: float
) -> _Stop | None:
    """Return the mean of the later half of a stop, without its last moments."""
    late = start + 0.5 * (end - start)
    rows = (measured.t >= late) & (measured.t <= end - _END * (end - start))
    if not rows.any():
        return None
    rotation = None
    if measured.rotation is not None:
        rotation = nearest_rotation(measured.rotation[rows].mean(axis=0))
    return _Stop(
        late, joints.at(np.array(late))[0], measured.position[rows].mean(axis=0), rotation
    )


def pose_cycles(result: list[_Stop], robot: Robot) -> list[PoseCycles]:
    """Return the stops by the pose that the robot was commanded to, as the poses first came."""
    if not result:
        return []
    q = np.stack([stop.q for stop in result])
    labels = _labels(q)
    commands = forward(robot, q)
    before = [-1, *labels[:-1]]
    ends = np.cumsum(np.bincount(labels))[:-1]
    return [
        _cycles([result[k] for k in rows], commands[rows], tuple(int(before[k]) for k in rows))
        for rows in np.split(np.argsort(labels, kind='stable'), ends)
    ]


def _labels(q: Array) -> np.ndarray:
    """Return the number of the pose of each stop, counted as they first come."""
    labels = np.full(len(q), -1)
    # Of thousands of stations, few are near in the first joint: only these are compared in all.
    order = np.argsort(q[:, 0])
    first = q[order, 0]
    low = np.searchsorted(first, q[:, 0] - _SAME_POSE, 'left')
    high = np.searchsorted(first, q[:, 0] + _SAME_POSE, 'right')
    count = 0
    for k in range(len(q)):
        if labels[k] < 0:
            near = order[low[k] : high[k]]
            alike = near[np.abs(q[near] - q[k]).max(axis=1) < _SAME_POSE]
            labels[alike[labels[alike] < 0]] = count
            count += 1
    return labels


def _cycles(result: list[_Stop], commands: Array, came_from: tuple[int, ...]) -> PoseCycles:
    first = commands[0]
    position = np.stack([stop.position for stop in result])
    turns = [stop.rotation for stop in result if stop.rotation is not None]
    rotation = None
    if len(turns) == len(result):
        off = np.stack(turns) @ np.swapaxes(commands[:, :3, :3], -1, -2)
        rotation = off @ first[:3, :3]
    return PoseCycles(
        result[0].q,
        first,
        np.array([stop.t for stop in result]),
        position - (commands[:, :3, 3] - first[:3, 3]),
        rotation,
        came_from,
    )


_RETURN = 5e-3
"""The motion is back where it came near the same joint positions [rad]; 5 mm a metre away."""
_AWAY = 0.05
"""It had left them if it was this far off in between [rad]: ten times as near as it comes back."""
_SAME_PATH = 0.01
"""Two cycles are of one path where no joint differs by more at the same share of it [rad]."""
_REFERENCES = 8
"""Cycles with which all are compared; one of the first eight is of the path that is repeated."""
_SHAPE = 100
"""Points at which two cycles are compared; a weave has some ten turns."""
_POINTS = 200
"""Points of the command path at which the criteria are evaluated."""
_CUT = 0.02
"""Share of the path left out at either end, where one cycle runs into the next."""
_CUSP = 0.5
"""Cosine of the turn from one step of the path to the next below which it has no direction."""
_SLACK = 0.03
"""Share of a cycle's time by which it may pass a point sooner or later than commanded ..."""
_SLACK_S = 0.25
"""... or seconds, whichever is more: clocks that differ, and lag."""
_FINER = 8
"""Points put between two measurements, on a cubic: chords would cut the corners of a weave."""
_GAP = 3.0
"""Spacings of the measurements that may be bridged so; where more is missing, nothing is known."""
_FEWEST = 10
"""Points of the path that every cycle was measured at, below which it is not judged."""


class _Span(NamedTuple):
    """Start and end of one cycle [s]."""

    start: float
    end: float


@dataclass(frozen=True, eq=False)
class PathCycles:
    """The cycles of one commanded path."""

    spans: tuple[_Span, ...]
    arc: Array
    """Length of the path to each point of evaluation, shape (m,) [m]."""
    command: Array
    """Shape (m, 3) [m]."""
    crossed: Array
    """Where each cycle passed the plane square to the path there, (cycles, m, 3) [m]."""


def path_cycles(recording: Recording, robot: Robot) -> PathCycles | None:
    """Return the cycles of the path repeated for most of the time, or None; DataError unmeasured."""
    measured, joints = measured_of(recording), recording.joints
    if joints.static or joints.t.size < 3:
        return None
    anchors = [joints.q[round(share * (joints.t.size - 1))] for share in (0.0, 0.25, 0.5)]
    anchors += [p.q for p in pose_cycles(stops(recording), robot) if p.t.size > 1]
    groups = [_of_one_path(joints, _spans(joints, q)) for q in anchors]
    best = max(groups, key=lambda group: sum(s.end - s.start for s in group[1:]))
    return _crossings(measured, joints, robot, best) if len(best) > 1 else None


def _spans(joints: JointMotion, anchor: Array) -> list[_Span]:
    """Return the stretches of a motion from leaving joint positions (n,) to coming back there."""
    a, step = joints.q[:-1], np.diff(joints.q, axis=0)
    length = np.maximum((step**2).sum(axis=1), 1e-30)
    part = np.clip(((anchor - a) * step).sum(axis=1) / length, 0.0, 1.0)
    off = np.abs(a + part[:, None] * step - anchor).max(axis=1)
    near, far = np.flatnonzero(off < _RETURN), np.flatnonzero(off > _AWAY)
    # between two passes next to each other the motion must have been away
    gaps = np.searchsorted(far, near[1:]) > np.searchsorted(far, near[:-1])
    moment = joints.t[:-1] + part * np.diff(joints.t)
    return [
        _Span(float(moment[i]), float(moment[j]))
        for i, j in zip(near[:-1][gaps], near[1:][gaps], strict=True)
    ]


def _of_one_path(joints: JointMotion, result: list[_Span]) -> list[_Span]:
    """Return the largest group of spans that go the same way."""
    if len(result) < 2:
        return result
    shapes = np.stack([_shape(joints, span) for span in result])
    alike = [np.abs(shapes - one).max(axis=(1, 2)) < _SAME_PATH for one in shapes[:_REFERENCES]]
    chosen = max(alike, key=lambda same: int(same.sum()))
    return [span for span, same in zip(result, chosen, strict=True) if same]


def _shape(joints: JointMotion, span: _Span) -> Array:
    """Return joint positions at even shares of the way through the joints, (_SHAPE, n)."""
    t, q = _within(joints, span)
    way = np.concatenate([[0.0], np.linalg.norm(np.diff(q, axis=0), axis=1).cumsum()])
    return joints.at(_when(way, t, np.linspace(0.0, way[-1], _SHAPE)))[0]


def _within(joints: JointMotion, span: _Span) -> tuple[Array, Array]:
    """Return the joint stream of a span with both its ends, stamps (K,) and positions (K, n)."""
    inside = joints.t[(joints.t > span.start) & (joints.t < span.end)]
    t = np.concatenate([[span.start], inside, [span.end]])
    return t, joints.at(t)[0]


def _when(way: Array, t: Array, wanted: Array) -> Array:
    """Return the time at which a way that only grows had reached each length."""
    moving = np.concatenate([[True], np.diff(way) > 0.0])
    return np.asarray(np.interp(wanted, way[moving], t[moving]))


def _crossings(
    measured: Measurements, joints: JointMotion, robot: Robot, result: Sequence[_Span]
) -> PathCycles | None:
    times, arc = _even_times(joints, robot, result)
    ways = _positions(joints, robot, times[0])
    ahead = np.diff(ways, axis=0, append=2.0 * ways[-1:] - ways[-2:-1])
    behind = np.diff(ways, axis=0, prepend=2.0 * ways[:1] - ways[1:2])
    sizes = np.linalg.norm(ahead, axis=1) * np.linalg.norm(behind, axis=1)
    straight = (ahead * behind).sum(axis=1) > _CUSP * sizes
    crossed = np.stack(
        [
            _passes(measured, ways, ahead + behind, when, span)
            for when, span in zip(times, result, strict=True)
        ]
    )
    good = straight & np.isfinite(crossed).all(axis=(0, 2))
    if good.sum() < _FEWEST:
        return None
    return PathCycles(tuple(result), arc[good], ways[good], crossed[:, good])


def _positions(joints: JointMotion, robot: Robot, t: Array) -> Array:
    poses = forward(robot, joints.at(t)[0])
    return np.asarray(poses[..., :3, 3])


def _even_times(
    joints: JointMotion, robot: Robot, result: Sequence[_Span]
) -> tuple[list[Array], Array]:
    """Return when each cycle was commanded to be at even steps of the path, and their lengths."""
    shares = np.linspace(_CUT, 1.0 - _CUT, _POINTS)
    times, arc = [], np.zeros(0)
    for span in result:
        t, _ = _within(joints, span)
        steps = np.linalg.norm(np.diff(_positions(joints, robot, t), axis=0), axis=1)
        way = np.concatenate([[0.0], steps.cumsum()])
        times.append(_when(way, t, shares * way[-1]))
        arc = arc if arc.size else shares * way[-1]
    return times, arc


def _passes(measured: Measurements, ways: Array, along: Array, when: Array, span: _Span) -> Array:
    """Return where one cycle passed the planes, (m, 3); NaN where nothing was measured."""
    slack = max(_SLACK * (span.end - span.start), _SLACK_S)
    rows = (measured.t >= span.start - slack) & (measured.t <= span.end + slack)
    out = np.full_like(ways, np.nan)
    if rows.sum() < 4:
        return out
    t, points = _finer(measured.t[rows], measured.position[rows])
    first, last = (np.searchsorted(t, when + side * slack) for side in (-1.0, 1.0))
    for i, (a, b) in enumerate(zip(first, last, strict=True)):
        passed = nearest_pass(points[a:b], ways[i], along[i])
        if passed is not None:
            out[i] = passed
    return out


def _finer(t: Array, position: Array) -> tuple[Array, Array]:
    """Return measurements with points between them; those of a gap are not numbers."""
    from scipy.interpolate import CubicSpline  # slow to load, and few motions repeat a path

    share = np.arange(_FINER) / _FINER
    steps = np.diff(t)
    dense = (t[:-1, None] + steps[:, None] * share).ravel()
    points = CubicSpline(t, position)(dense)
    points[np.repeat(steps > _GAP * np.median(steps), _FINER)] = np.nan
    return dense, points


_HOUR = 3600.0
"""Seconds."""


@dataclass(frozen=True, eq=False)
class PoseTest:
    """One commanded pose and its criteria."""

    q: Array
    """Shape (n,)."""
    command: Array
    """Shape (3,) [m]."""
    performance: PosePerformance
    variation_m: float | None
    """vAP: how far apart the pose is reached from different poses before it [m]."""
    approaches: int
    """How many poses it was reached from, twice or more each."""
    drift: DriftPerformance | None
    """dAP and dRP over groups of `DRIFT_CYCLES` cycles."""
    hours: float
    """From the first cycle to the last."""

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers."""
        return {
            'q': self.q.tolist(),
            'command_m': self.command.tolist(),
            **self.performance.as_dict(),
            'vap_m': self.variation_m,
            'approaches': self.approaches,
            'drift': None if self.drift is None else self.drift.as_dict(),
            'hours': self.hours,
        }


@dataclass(frozen=True, eq=False)
class PathTest:
    """One commanded path and its criteria."""

    performance: PathPerformance
    arc: Array
    at: Array
    rt: Array
    """Length of the path to each point, and accuracy and repeatability there, shape (m,) [m]."""
    seconds: float
    """From leaving the start of a cycle to being back near it, the median of them."""

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers."""
        return {
            **self.performance.as_dict(),
            'length_m': float(self.arc[-1]),
            'cycle_s': self.seconds,
            'profile': {
                'arc_m': self.arc.tolist(),
                'at_m': self.at.tolist(),
                'rt_m': self.rt.tolist(),
            },
        }


@dataclass(frozen=True, eq=False)
class Performance:
    """What a recording tells by the standard."""

    poses: tuple[PoseTest, ...]
    """Those with two cycles or more."""
    path: PathTest | None
    lacking: tuple[str, ...]
    """What the standard asks for and the recording does not have, in sentences."""

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers; the worst pose counts for all, as in the standard."""
        result = [pose.performance for pose in self.poses]
        return {
            'ap_m': max((f.ap_m for f in result), default=None),
            'rp_m': max((f.rp_m for f in result), default=None),
            'poses': [pose.as_dict() for pose in self.poses],
            'path': None if self.path is None else self.path.as_dict(),
            'lacking': list(self.lacking),
        }


def performance_of(recording: Recording, robot: Robot) -> Performance:
    """Return the criteria of cycles that a placed robot's recording repeats; DataError for none."""
    groups = pose_cycles(stops(recording), robot)
    poses = tuple(_pose_test(group) for group in groups if group.t.size > 1)
    cycles = path_cycles(recording, robot)
    path = None if cycles is None else _path_test(cycles)
    lacking = [*_pose_lack(groups), *_path_lack(recording, path)]
    if not poses and path is None:
        raise DataError(
            f'{recording.name} repeats neither a pose nor a path: {"; ".join(lacking)}; '
            f'ISO 9283 asks for {POSE_CYCLES} cycles of each pose or {PATH_CYCLES} of a path'
        )
    return Performance(poses, path, tuple(lacking))


def _pose_test(cycles: PoseCycles) -> PoseTest:
    command = cycles.command
    result = pose_performance(cycles.attained, command[:3, 3], cycles.rotation, command[:3, :3])
    before = np.array(cycles.came_from)
    ways = [cycles.attained[before == pose] for pose in np.unique(before)]
    ways = [way for way in ways if len(way) > 1]
    count = len(cycles.t) // DRIFT_CYCLES
    groups = [cycles.attained[k * DRIFT_CYCLES :][:DRIFT_CYCLES] for k in range(count)]
    return PoseTest(
        cycles.q,
        command[:3, 3],
        result,
        multidirectional_variation(ways) if len(ways) > 1 else None,
        len(ways),
        drift(groups, command[:3, 3]) if count > 1 else None,
        float(cycles.t[-1] - cycles.t[0]) / _HOUR,
    )


def _path_test(cycles: PathCycles) -> PathTest:
    accuracy, spread = along_path(cycles.crossed, cycles.command)
    return PathTest(
        crossing_performance(cycles.crossed, cycles.command),
        cycles.arc,
        accuracy,
        spread,
        float(np.median([span.end - span.start for span in cycles.spans])),
    )


def _pose_lack(groups: list[PoseCycles]) -> list[str]:
    if not groups:
        return ['the arm never stands still while it is measured']
    counts = [group.t.size for group in groups]
    repeated = [count for count in counts if count > 1]
    if not repeated:
        return [f'no pose was measured twice, {len(counts)} different ones once each']
    if min(repeated) < POSE_CYCLES:
        return [
            f'a pose has {min(repeated)} cycles, the standard asks for {POSE_CYCLES}: the '
            'repeatability is less certain'
        ]
    return []


def _path_lack(recording: Recording, path: PathTest | None) -> list[str]:
    if path is None and recording.joints.static:
        return ['stations at rest have no path']
    if path is None:
        return ['the motion does not go the same way twice']
    if path.performance.cycles < PATH_CYCLES:
        return [
            f'the path has {path.performance.cycles} cycles, the standard asks for {PATH_CYCLES}: '
            'the repeatability is less certain'
        ]
    return []
