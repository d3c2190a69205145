# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a study looks at: a motion, instants on it and the seam under them; what a run comes to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..arm.robot import Robot
from ..arrays import Array, readonly, spread_over
from ..effects import Effect
from ..errors import DataError
from ..motion.paths import Path, Torch
from ..motion.planned_motion import Plan, plan
from ..motion.profiles import Profile, named
from ..motion.seam_frame import path_tangents, seam_axes
from ..recording import Recording
from ..twin.poses import Poses
from ..twin.twin import Twin

POINTS = 200
"""Path points that a study looks at unless another number is given."""


@dataclass(frozen=True, eq=False)
class Study:
    """A motion along a seam, sampled where the deviation is looked at."""

    robot: Robot
    recording: Recording
    """The commanded joint motion and the side signals."""
    at: Array | None
    """Instants looked at, shape (N,) [s]; left out, the joint stamps."""
    s: Array
    """Arc length travelled along the seam, shape (N,) [m]; falls where the motion goes back."""
    axes: Array
    """Rows along, across and normal of the seam, in the world frame, shape (N, 3, 3)."""
    length: float
    """[m]"""
    known: tuple[Effect, ...]
    """Effects believed to act; deviations are counted from the twin that has them."""
    nominal: Poses
    """Of that twin, shape (N, 3) and (N, 3, 3)."""

    @property
    def samples(self) -> int:
        """Return the number of path points N."""
        return len(self.s)

    @property
    def t(self) -> Array:
        """Return the instants looked at, shape (N,) [s]."""
        return self.recording.joints.t if self.at is None else self.at

    @property
    def q(self) -> Array:
        """Return the joint positions there, shape (N, n) [rad or m]."""
        joints = self.recording.joints
        return joints.q if self.at is None else joints.at(self.at)[0]

    def on_seam(self, vectors: Array) -> Array:
        """Return vectors (..., N, 3) of the world as along, across, normal, same shape."""
        return (self.axes @ vectors[..., None])[..., 0]

    def deviations(self, effects: tuple[Effect, ...]) -> Array:
        """Return by how much effects displace the tool, (..., N, 3) [m], in seam axes."""
        position = Twin(self.robot, effects).poses(self.recording, self.at).position
        return self.on_seam(position - self.nominal.position)


def planned_study(
    robot: Robot,
    path: Path,
    profile: Profile | str = 'smooth',
    *,
    points: int = POINTS,
    torch: Torch | None = None,
    known: tuple[Effect, ...] = (),
) -> Study:
    """
    Return the study of a seam travelled by a time law, slowed to the joint limits.

    Parameters
    ----------
    robot : Robot
    path : Path
    profile : Profile or str
        A time law, or the name of one with its default numbers.
    points : int
        Path points that are looked at, evenly spread over time.
    torch : Torch, optional
        Left out, upright on the seam.
    known : tuple of Effect
        Effects believed to act; deviations are counted from the twin that has them.

    Raises
    ------
    ReachError, PathError
        The seam cannot be travelled.
    DataError
        Fewer than two path points.

    """
    if points < 2:
        raise DataError(f'a study needs at least 2 path points, got {points}')
    law = named(profile) if isinstance(profile, str) else profile
    duration = float(law.law(path.length).x[-1])
    # A little fast, so that rounding cannot add a sample beyond the end.
    rate = (points - 1) / (duration * (1.0 - 1e-12))
    return study_of_plan(robot, plan(robot, path, law, rate, torch=torch, fit=True), known)


def study_of_plan(robot: Robot, planned: Plan, known: tuple[Effect, ...] = ()) -> Study:
    """
    Return the study of a planned motion, at its own samples.

    Parameters
    ----------
    robot : Robot
    planned : Plan
    known : tuple of Effect
        Effects believed to act.

    """
    recording = Recording('planned', planned.motion)
    axes = seam_axes(planned.seam.tangent, planned.seam.normal)
    nominal = Twin(robot, known).poses(recording)
    return Study(robot, recording, None, planned.s, axes, planned.length, known, nominal)


def recorded_study(
    robot: Robot,
    recording: Recording,
    *,
    points: int = POINTS,
    normal: Array | None = None,
    known: tuple[Effect, ...] = (),
) -> Study:
    """
    Return the study of a motion that was recorded, at instants evenly spread over it.

    Parameters
    ----------
    robot : Robot
    recording : Recording
    points : int
        At most as many as there are measurements, or joint states without any.
    normal : array, shape (3,), optional
        Direction out of the work; left out, against the tool's z at every sample.
    known : tuple of Effect

    Raises
    ------
    DataError
        The tool does not move.

    """
    stamps = recording.joints.t if recording.measured is None else recording.measured.t
    inside = stamps[(stamps >= recording.joints.t[0]) & (stamps <= recording.joints.t[-1])]
    if inside.size < 2:
        raise DataError(f'recording {recording.name!r} has fewer than two samples to study')
    at = readonly(inside[spread_over(inside.size, points)], (None,), 'instants')
    nominal = Twin(robot, known).poses(recording, at)
    tangent = path_tangents(nominal.position)
    out = _away(nominal.rotation, tangent) if normal is None else normal
    steps = np.linalg.norm(np.diff(nominal.position, axis=0), axis=1)
    s = np.concatenate([[0.0], np.cumsum(steps)])
    return Study(robot, recording, at, s, seam_axes(tangent, out), float(s[-1]), known, nominal)


def _away(rotation: Array, tangent: Array) -> Array:
    """Return the direction against the wire, or against the tool's x where that is the travel."""
    wire = -rotation[..., 2]
    head_on = np.abs((wire * tangent).sum(axis=-1, keepdims=True)) > 0.99
    return np.where(head_on, -rotation[..., 0], wire)


class Outcomes(NamedTuple):
    """
    Numbers of D runs, shape (D,) each.

    ``d_norm`` is the largest deviation over the path length, ``max_m`` and ``rms_m`` are of its
    length, ``across_m`` and ``stickout_m`` the largest component across the seam and along its
    normal.
    """

    d_norm: Array
    max_m: Array
    rms_m: Array
    across_m: Array
    stickout_m: Array


def outcomes(off: Array, length: float) -> Outcomes:
    """Return what runs come to by deviations along, across and normal, (3, D, N) [m], and length [m]."""
    along, across, normal = off
    square = along * along
    square += across * across
    square += normal * normal
    largest = np.sqrt(square.max(axis=-1))
    return Outcomes(
        largest / length,
        largest,
        np.sqrt(square.mean(axis=-1)),
        np.maximum(across.max(axis=-1), -across.min(axis=-1)),
        np.maximum(normal.max(axis=-1), -normal.min(axis=-1)),
    )


def joined(parts: list[Outcomes]) -> Outcomes:
    """Return the outcomes of several chunks of draws as one."""
    return Outcomes(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def refuse_unfinite(values: Array, what: str) -> None:
    """Raise DataError where model results are no numbers, with how many and the first run."""
    bad = ~np.isfinite(values)
    if bad.any():
        first = int(np.argmax(bad.reshape(len(values), -1).any(axis=1)))
        raise DataError(
            f'{what}: {int(bad.sum())} of {bad.size} model results are not finite, the first in '
            f'run {first}; indices of the others would be wrong, so none are given'
        )
