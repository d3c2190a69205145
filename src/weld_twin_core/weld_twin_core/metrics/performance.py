# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Every ISO 9283 criterion that a recording allows, and what it lacks for the others."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arm.robot import Robot
from ..arrays import Array
from ..errors import DataError
from ..recording import Recording
from .cycles import PathCycles, PoseCycles, path_cycles, pose_cycles, stops
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
    pose_performance,
)

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
