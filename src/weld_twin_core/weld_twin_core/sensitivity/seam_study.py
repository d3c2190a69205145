# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a study looks at: a motion, instants on it and the seam under them; what a run comes to.

The tolerance stack says by Monte Carlo how far off the seam it is, and how often inside the weld's.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import bdtr, bdtrik, betaincinv

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


_PERCENTILES = (5.0, 25.0, 50.0, 75.0, 90.0, 95.0, 99.0)
"""Percentiles by which the distribution is reported [%]."""
_COVERAGE = 0.95
"""Confidence of the intervals of the percentiles."""


@dataclass(frozen=True)
class WeldTolerance:
    """How far off a weld may be."""

    across_m: float = 5e-4
    """Most to either side of the seam [m]; half a wire diameter suits MIG."""
    stickout_m: float = 1e-3
    """Most along the work normal, which changes the wire's free length [m]."""

    def __post_init__(self) -> None:
        if not (self.across_m > 0.0 and self.stickout_m > 0.0):
            raise DataError(
                f'weld tolerances must be positive, got {self.across_m} m across and '
                f'{self.stickout_m} m of stick-out'
            )


@dataclass(frozen=True)
class _Probability:
    """A frequency with its 95 % Clopper-Pearson interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class ToleranceStack:
    """What the tolerances add up to."""

    runs: int
    seed: int
    percentiles: dict[str, Array]
    """Value and 95 % interval at `_PERCENTILES`, by the number of `Outcomes`, shape (K, 3)."""
    inside_across: _Probability
    inside_stickout: _Probability
    inside_both: _Probability
    """That the whole seam stays inside the weld's tolerance."""
    tolerance: WeldTolerance

    @property
    def half(self) -> float:
        """Return the half-width of the widest of the three intervals: whether there were enough runs."""
        all_three = (self.inside_across, self.inside_stickout, self.inside_both)
        return max(0.5 * (p.high - p.low) for p in all_three)

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers and lists."""
        return {
            'runs': self.runs,
            'seed': self.seed,
            'tolerance': asdict(self.tolerance),
            'percentiles': {
                key: [
                    {'percent': p, 'value': float(v), 'low': float(a), 'high': float(b)}
                    for p, (v, a, b) in zip(_PERCENTILES, rows, strict=True)
                ]
                for key, rows in self.percentiles.items()
            },
            'inside': {
                'across': asdict(self.inside_across),
                'stickout': asdict(self.inside_stickout),
                'both': asdict(self.inside_both),
                'widest_half': self.half,
            },
        }


def probabilities(runs: int, inputs: int, seed: int = 0) -> Array:
    """
    Return independent probabilities, shape (runs, inputs).

    Parameters
    ----------
    runs : int
        At least 20.
    inputs : int
        Number of tolerances.
    seed : int

    Raises
    ------
    DataError
        Fewer than 20 runs.

    """
    if runs < 20:
        raise DataError(f'a tolerance stack needs at least 20 runs, got {runs}')
    return np.random.default_rng(seed).random((runs, inputs))


def tolerance_stack(
    result: Outcomes, tolerance: WeldTolerance | None = None, *, seed: int = 0
) -> ToleranceStack:
    """
    Return what independent runs say about the weld.

    Parameters
    ----------
    result : Outcomes
        Of runs at `probabilities`.
    tolerance : WeldTolerance, optional
        Left out, 0.5 mm across and 1 mm of stick-out.
    seed : int
        The runs' own, for the record.

    Raises
    ------
    DataError
        A result is not a number.

    """
    refuse_unfinite(np.stack(result, axis=1), 'tolerance stack')
    limits = tolerance or WeldTolerance()
    across, stickout = result.across_m <= limits.across_m, result.stickout_m <= limits.stickout_m
    keys = ('d_norm', 'max_m', 'across_m', 'stickout_m')
    return ToleranceStack(
        len(result.d_norm),
        seed,
        {key: _percentiles(getattr(result, key)) for key in keys},
        _frequency(across),
        _frequency(stickout),
        _frequency(across & stickout),
        limits,
    )


def _frequency(inside: np.ndarray) -> _Probability:
    hits, runs, tail = int(inside.sum()), inside.size, 0.5 * (1.0 - _COVERAGE)
    low = float(betaincinv(hits, runs - hits + 1, tail)) if hits else 0.0
    high = float(betaincinv(hits + 1, runs - hits, 1.0 - tail)) if hits < runs else 1.0
    return _Probability(hits / runs, low, high)


def _percentiles(values: Array) -> Array:
    """Return percentiles with the interval that order statistics give without a model."""
    ordered, runs, tail = np.sort(values), values.size, 0.5 * (1.0 - _COVERAGE)
    out = []
    for percent in _PERCENTILES:
        chance = np.array([tail, 1.0 - tail])
        low, high = np.clip(_ranks(chance, runs, percent / 100.0), 0, runs - 1)
        out.append([float(np.percentile(ordered, percent)), ordered[low], ordered[high]])
    return np.array(out)


def _ranks(chance: Array, runs: int, share: float) -> NDArray[np.intp]:
    """Return the least numbers of hits, of so many runs, that are exceeded with at most a chance."""
    # What scipy's distribution returns, without the half second that importing it takes.
    result = np.ceil(bdtrik(chance, runs, share))
    below = np.maximum(result - 1.0, 0.0)
    enough = bdtr(below, runs, share) >= chance
    return np.asarray(np.where(enough, below, result), dtype=np.intp)
