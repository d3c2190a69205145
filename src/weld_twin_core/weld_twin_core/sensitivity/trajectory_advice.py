# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Trajectory advice: which time law, torch rotation and base keep the deviation small.

The measure is the expected deviation to first order: exact enough to compare, without any runs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arm.robot import Robot
from ..arm.rotation import rotation_matrix, transform, wrapped
from ..arrays import Array
from ..effects import Effect
from ..errors import PathError
from ..motion.inverse import PathSolution, solve_path
from ..motion.paths import Path, Torch
from ..motion.profiles import PROFILES
from ..motion.seam_frame import seam_axes
from ..recording import JointMotion, Recording
from ..twin.twin import Twin
from .local import arc_weights
from .seam_study import Study, planned_study
from .tolerance import Tolerance, places, with_draws

_POINTS = 17
"""Points of the seam at which placements are compared."""
_SPEED = 0.02
"""Travel speed [m/s] while placements are compared."""


def expected_deviation(study: Study, tolerances: Sequence[Tolerance]) -> Array:
    """
    Return the root of the expected squared deviation at every path point, shape (N,) [m].

    To first order in the scatter, about the mean of every error.

    Parameters
    ----------
    study : Study
    tolerances : sequence of Tolerance

    """
    return _Scatter.of(study.known, tolerances).deviation(study)


def rms_over_arc(study: Study, deviation: Array) -> float:
    """Return the root mean square over the arc length of deviations (N,) [m]."""
    return float(np.sqrt((deviation**2 * arc_weights(study.s)).sum()))


@dataclass(frozen=True, eq=False)
class _Scatter:
    """Errors at their means, and how far each of them scatters: the same for every motion."""

    effects: tuple[Effect, ...]
    std: Array
    columns: list[int]

    @classmethod
    def of(cls, known: tuple[Effect, ...], tolerances: Sequence[Tolerance]) -> _Scatter:
        mean = np.array([t.distribution.mean for t in tolerances])
        std = np.array([t.distribution.std for t in tolerances])
        effects = with_draws(known, tolerances, mean)
        place = places(effects, tolerances)
        return cls(effects, std[list(place)], list(place.values()))

    def deviation(self, study: Study) -> Array:
        """Return the root of the expected squared deviation at every path point, (N,) [m]."""
        poses, change = Twin(study.robot, self.effects).linearise(study.recording, study.at)
        bias = poses.position - study.nominal.position
        scatter = (change[:, :3, self.columns] * self.std) ** 2
        return np.asarray(np.sqrt((bias**2).sum(axis=-1) + scatter.sum(axis=(1, 2))))


@dataclass(frozen=True)
class ProfileResult:
    """
    One time law on a seam: seconds of travel, expected deviation over arc length and its peak.

    ``same_time_m`` is the expected deviation when the law is stretched to the time that the
    slowest of those compared takes.
    """

    profile: str
    duration_s: float
    expected_m: float
    peak_m: float
    same_time_m: float


def compare_profiles(
    robot: Robot,
    path: Path,
    tolerances: Sequence[Tolerance],
    *,
    profiles: Sequence[str] = tuple(PROFILES),
    points: int = 400,
) -> tuple[ProfileResult, ...]:
    """
    Return what time laws do to the same seam, compared over arc length.

    Parameters
    ----------
    robot : Robot
    path : Path
    tolerances : sequence of Tolerance
    profiles : sequence of str
        Names of time laws.
    points : int
        Path points that are looked at.

    Raises
    ------
    ReachError, PathError
        The seam cannot be travelled.

    """
    studies = {name: planned_study(robot, path, name, points=points) for name in profiles}
    slowest = max(float(study.t[-1]) for study in studies.values())
    out = []
    for name, study in studies.items():
        same = _stretched(study, slowest / float(study.t[-1]))
        each, later = (expected_deviation(one, tolerances) for one in (study, same))
        rms = rms_over_arc(study, each), rms_over_arc(same, later)
        out.append(ProfileResult(name, float(study.t[-1]), rms[0], float(each.max()), rms[1]))
    return tuple(out)


def _stretched(study: Study, factor: float) -> Study:
    """Return the study of the same motion done more slowly."""
    motion = study.recording.joints
    rate = None if motion.qd is None else motion.qd / factor
    slow = replace(study.recording, joints=JointMotion(motion.t * factor, motion.q, rate))
    return replace(study, recording=slow)


@dataclass(frozen=True)
class Placement:
    """A torch rotation and a place of the base."""

    rotation: float = 0.0
    """Turn of the torch about the wire, which the weld does not notice [rad]."""
    x: float = 0.0
    y: float = 0.0
    """Move of the base in its own frame [m]."""
    yaw: float = 0.0
    """Its turn [rad]."""

    def robot(self, robot: Robot) -> Robot:
        """Return the robot on its new place."""
        move = transform(rotation_matrix([0.0, 0.0, self.yaw]), np.array([self.x, self.y, 0.0]))
        return robot.with_origin(robot.T_world_origin @ move)

    def torch(self, torch: Torch) -> Torch:
        """Return the turned torch."""
        return replace(torch, rotation=float(wrapped(torch.rotation + self.rotation)))


@dataclass(frozen=True)
class PlacementResult:
    """
    A placement and the deviation to expect with it [m].

    ``label`` says what was free: 'as given', 'torch', 'base' or 'torch and base'.
    """

    label: str
    placement: Placement
    expected_m: float
    limit_margin_rad: float
    condition: float

    def as_dict(self) -> dict[str, Any]:
        """Return plain numbers."""
        p = self.placement
        return {
            'free': self.label,
            'rotation_rad': p.rotation,
            'x_m': p.x,
            'y_m': p.y,
            'yaw_rad': p.yaw,
            'expected_m': self.expected_m,
            'limit_margin_rad': self.limit_margin_rad,
            'condition': self.condition,
        }


@dataclass(frozen=True)
class Room:
    """How far the base may move [m, rad] and how much room the arm must keep."""

    shift: float = 0.2
    yaw: float = 0.5
    limit_margin: float = 0.1
    condition: float = 60.0


def advise(
    robot: Robot,
    path: Path,
    tolerances: Sequence[Tolerance],
    *,
    torch: Torch | None = None,
    room: Room | None = None,
    tries: int = 32,
    seed: int = 0,
) -> tuple[PlacementResult, ...]:
    """
    Return the best torch rotation, base place and both, after the placement as given.

    A Sobol sample of the room, then a simplex search from its best; every candidate is solved
    along the whole seam and must keep its distance from limits and singularities.

    Parameters
    ----------
    robot : Robot
    path : Path
    tolerances : sequence of Tolerance
    torch : Torch, optional
        As given; left out, upright on the seam.
    room : Room, optional
        How far the base may move, and how much room the arm must keep.
    tries : int
        Placements in the sample; the simplex search may take as many again for each free value.
    seed : int

    Raises
    ------
    ReachError
        The seam is out of reach as given.

    """
    search = _Search(robot, path, tuple(tolerances), torch or Torch(), room or Room())
    given = search.result('as given', np.zeros(4))
    out = [given]
    for label, free in (('torch', [0]), ('base', [1, 2, 3]), ('torch and base', [0, 1, 2, 3])):
        start = min(out, key=lambda r: r.expected_m) if len(free) == 4 else given
        out.append(search.best(label, free, tries, seed, start))
    return tuple(out)


class _Search:
    def __init__(
        self, robot: Robot, path: Path, tolerances: tuple[Tolerance, ...], torch: Torch, room: Room
    ) -> None:
        self.robot, self.length, self.scatter = robot, path.length, _Scatter.of((), tolerances)
        self.torch, self.room = torch, room
        self.s = np.linspace(0.0, path.length, _POINTS)
        self.seam = path.sample(self.s)
        self.axes = seam_axes(self.seam.tangent, self.seam.normal)
        self.span = np.array([np.pi, room.shift, room.shift, room.yaw])

    def study(self, values: Array) -> tuple[Study, PathSolution]:
        """Return the study of a placement, and how the arm stands."""
        placement = Placement(*map(float, values))
        robot, torch = placement.robot(self.robot), placement.torch(self.torch)
        # The seam is moved and not the arm: what is prepared for an arm serves all placements.
        back = self.robot.T_world_base @ np.linalg.inv(robot.T_world_base)
        solution = solve_path(self.robot, back @ torch.poses(self.seam))
        recording = Recording('placement', JointMotion(self.s / _SPEED, solution.q))
        nominal = Twin(robot).poses(recording)
        study = Study(robot, recording, None, self.s, self.axes, self.length, (), nominal)
        return study, solution

    def cost(self, values: Array) -> float:
        """Return the deviation to expect, infinite where the arm has no room."""
        try:
            study, solution = self.study(values)
        except PathError:
            return np.inf
        if solution.limit_margin.min() < self.room.limit_margin:
            return np.inf
        if solution.condition.max() > self.room.condition:
            return np.inf
        return rms_over_arc(study, self.scatter.deviation(study))

    def result(self, label: str, values: Array) -> PlacementResult:
        study, solution = self.study(values)
        return PlacementResult(
            label,
            Placement(*map(float, values)),
            rms_over_arc(study, self.scatter.deviation(study)),
            float(solution.limit_margin.min()),
            float(solution.condition.max()),
        )

    def best(
        self, label: str, free: list[int], tries: int, seed: int, start: PlacementResult
    ) -> PlacementResult:
        """Return the best placement found with some of torch rotation, base x, y and yaw free."""
        # Both bring most of scipy along, and whoever asks for no placement needs neither.
        from scipy.optimize import minimize
        from scipy.stats import qmc

        p = start.placement
        known = np.array([p.rotation, p.x, p.y, p.yaw])

        def full(part: Array) -> Array:
            values: Array = known.copy()
            values[free] = part
            return values

        def bounded(part: Array) -> float:
            outside = np.abs(full(part)) > self.span * (1.0 + 1e-12)
            return np.inf if outside.any() else self.cost(full(part))

        unit = qmc.Sobol(len(free), seed=seed).random(tries)
        guesses = [known[free], *((2.0 * unit - 1.0) * self.span[free])]
        costs = [bounded(guess) for guess in guesses]
        first = guesses[int(np.argmin(costs))]
        if not np.isfinite(min(costs)):
            return replace(start, label=label)
        simplex = first + np.vstack(
            [np.zeros(len(free)), np.diag(-0.1 * self.span[free]) * np.sign(first + 1e-12)]
        )
        result = minimize(
            bounded,
            first,
            method='Nelder-Mead',
            options={
                'initial_simplex': simplex,
                'maxfev': tries * len(free),
                'xatol': 1e-4,
                'fatol': 1e-9,
            },
        )
        return self.result(label, full(result.x if result.fun < min(costs) else first))
