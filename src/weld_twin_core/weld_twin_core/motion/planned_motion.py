# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""A planned motion: a seam travelled by a time law, as joint motion within the robot's limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

from ..arm.chain import chain_jacobian, frames
from ..arm.robot import Robot
from ..arm.rotation import missing
from ..arrays import Array
from ..errors import PathError
from ..recording import JointMotion
from .inverse import CarriedArm, PathSolution, rest
from .inverse.newton import least_step, polish, pose_error
from .paths import Path, SeamFrames, Torch
from .profiles import Profile, Timing, named
from .sample_count import MOST_SAMPLES

_DIFFERENCE = 1e-6
"""Arc length [m] over which the pose is differentiated."""


@dataclass(frozen=True, eq=False)
class _PlanReport:
    """What a plan asks of the robot."""

    duration: float
    """[s]"""
    slowed: float
    """How much longer the motion takes than the profile wanted; 1 if as wanted."""
    velocity_use: Array
    acceleration_use: Array
    """Largest joint velocity and acceleration as part of the limit, shape (n,)."""
    residual: float
    """Largest error of closure [m or rad]."""
    condition: float
    manipulability: float
    limit_margin: float
    """Worst along the seam; see `inverse.PathSolution`."""
    method: str
    """How the inverse kinematics was solved."""


@dataclass(frozen=True, eq=False)
class Plan:
    """
    A planned motion.

    Examples
    --------
    `plan` makes it.

    >>> import weld_twin_core as wt
    >>> robot = wt.load('ur5')
    >>> made = wt.plan(robot, wt.default_seam(robot), rate_hz=10.0)
    >>> isinstance(made, wt.Plan), made.poses.shape == (made.motion.t.size, 4, 4)
    (True, True)

    """

    motion: JointMotion
    """With velocity."""
    poses: Array
    """``T_world_tool`` commanded, shape (N, 4, 4)."""
    seam: SeamFrames
    """The seam under each sample."""
    s: Array
    """Arc length of each sample, shape (N,) [m]."""
    length: float
    """Of the seam [m]."""
    report: _PlanReport
    """What the plan asks of the robot."""


def plan(
    robot: Robot,
    path: Path,
    profile: Profile | str = 'smooth',
    rate_hz: float = 125.0,
    *,
    torch: Torch | None = None,
    fit: bool = False,
    seed: Array | None = None,
    told: Array | None = None,
    most_samples: int = MOST_SAMPLES,
) -> Plan:
    """
    Return the joint motion that travels a seam.

    Parameters
    ----------
    path : Path
        A seam; see `paths`.
    profile : Profile or str
        A time law, or the name of one with its default numbers: 'constant', 'trapezoid',
        's-curve', 'smooth' or 'aggressive'.
    rate_hz : float [1/s]
        How many joint states a second.
    torch : Torch, optional
        Left out, upright on the seam.
    fit : bool
        Slow the motion down until it is within the joint limits (`Robot.planned_velocity`), instead of
        refusing it.
    seed : array, shape (n,), optional
        Joint positions near which the motion begins.
    told : array, shape (K, m) [rad or m], optional
        Positions of the first joints of the chain, those of a positioner among them, at places spread
        evenly along the seam; one row where they stand still. Left out, a positioner stands at zero.
    most_samples : int
        How many the motion may have: near a singular posture ``fit`` may slow it down endlessly.

    Raises
    ------
    ReachError
        Part of the seam is out of reach.
    PathError
        A joint would have to be too fast; the message says which, when and by how much. Or the
        motion would have too many samples.

    Examples
    --------
    >>> import weld_twin_core as wt
    >>> robot = wt.load('ur5')
    >>> made = wt.plan(robot, wt.default_seam(robot, 'line'), 'smooth', rate_hz=50.0)
    >>> print(f'{made.length * 1e3:.0f} mm in {made.report.duration:.1f} s')
    298 mm in 14.9 s

    """
    if not (np.isfinite(rate_hz) and rate_hz > 0.0):
        raise PathError(f'the sample rate must be positive, got {rate_hz!r} Hz')
    law = named(profile) if isinstance(profile, str) else profile
    line = _JointLine(robot, path, torch or Torch(), seed, told)
    slowed, dt = 1.0, 1.0 / rate_hz
    for _ in range(20):
        timing = _slowed(law.sample(path.length, dt / slowed, most_samples), slowed)
        motion, residual = line.motion(timing)
        velocity, acceleration = _use(robot, motion, fit)
        excess = max(velocity.max(), np.sqrt(acceleration.max()))
        if excess <= 1.0 or not fit:
            break
        slowed *= 1.01 * excess
    if excess > 1.0:
        raise PathError(_too_fast(robot, motion, timing, velocity, acceleration))
    report = _PlanReport(
        duration=float(timing.t[-1]),
        slowed=slowed,
        velocity_use=velocity,
        acceleration_use=acceleration,
        residual=residual,
        condition=float(line.solution.condition.max()),
        manipulability=float(line.solution.manipulability.min()),
        limit_margin=float(line.solution.limit_margin.min()),
        method=line.solution.method,
    )
    seam = path.sample(timing.s)
    return Plan(motion, line.poses(timing.s), seam, timing.s, path.length, report)


class _JointLine:
    """Joint positions as a function of arc length: the same place gives the same posture."""

    def __init__(
        self, robot: Robot, path: Path, torch: Torch, seed: Array | None, external: Array | None
    ) -> None:
        external = rest(robot)[None] if external is None else np.atleast_2d(external)
        self.axes = CarriedArm(robot, external.shape[1])
        self.robot, self.path, self.torch = self.axes.arm, path, torch
        self._external = _along(external, path.length)
        self._first = path.sample(np.zeros(1))
        count = int(np.ceil(path.length / min(path.length / 256.0, path.detail / 24.0)))
        grid = np.linspace(0.0, path.length, count + 1)
        self.solution: PathSolution = self.axes.solve_path(
            self.poses(grid), self._external(grid), seed
        )
        self._spline = CubicSpline(grid, self.solution.q)

    def poses(self, s: Array) -> Array:
        """Return tool poses, shape (N, 4, 4), at arc lengths."""
        return self.torch.poses(self.path.sample(s), self._first)

    def _seen(self, s: Array) -> Array:
        return self.axes.seen(self.poses(s), self._external(s))

    def motion(self, timing: Timing) -> tuple[JointMotion, float]:
        poses = self._seen(timing.s)
        q, _ = polish(self.robot, self._spline(timing.s), poses)
        rate = self._spline(timing.s, 1)
        jacobian = chain_jacobian(self.robot, frames(self.robot, q))
        lacking = self._twist(timing.s) - (jacobian @ rate[..., None])[..., 0]
        rate = rate + least_step(jacobian, lacking)
        # Rounded, so that a joint at rest is at rest and not reversing within the last digit.
        q = q.round(12)
        residual = float(np.abs(pose_error(frames(self.robot, q), poses)).max())
        velocity = self.axes.whole(self._external(timing.s, 1), rate) * timing.sd[:, None]
        q = self.axes.whole(self._external(timing.s), q)
        return JointMotion(timing.t, q, velocity.round(9)), residual

    def _twist(self, s: Array) -> Array:
        """Return d(pose)/ds, shape (N, 6), by central differences."""
        before, after = self._seen(s - _DIFFERENCE), self._seen(s + _DIFFERENCE)
        return missing(after, before) / (2.0 * _DIFFERENCE)


def _along(external: Array, length: float) -> Callable[..., Array]:
    """Return positions and, of order 1, their slopes at arc lengths, without overshoot between."""
    if len(external) == 1:
        return lambda s, order=0: np.broadcast_to(
            external[0] * (order == 0), (*s.shape, external.shape[1])
        )
    course: Callable[..., Array] = PchipInterpolator(
        np.linspace(0.0, length, len(external)), external
    )
    return course


def _slowed(timing: Timing, factor: float) -> Timing:
    return Timing(timing.t * factor, timing.s, timing.sd / factor, timing.sdd / factor**2)


def _accelerations(motion: JointMotion) -> Array:
    if motion.t.size < 2:
        return np.zeros_like(motion.q)
    return np.gradient(motion.velocity, motion.t, axis=0)


def _use(robot: Robot, motion: JointMotion, fit: bool) -> tuple[Array, Array]:
    """Return the largest velocity and acceleration as part of the limits, shape (n,) each."""
    fastest = robot.planned_velocity if fit else robot.max_velocity
    velocity = np.abs(motion.velocity).max(axis=0) / fastest
    return velocity, np.abs(_accelerations(motion)).max(axis=0) / robot.max_acceleration


def _too_fast(
    robot: Robot, motion: JointMotion, timing: Timing, velocity: Array, acceleration: Array
) -> str:
    if velocity.max() > 1.0:
        use, values, limits = velocity, motion.velocity, robot.max_velocity
        what, unit = 'a velocity', '/s'
    else:
        use, values, limits = acceleration, _accelerations(motion), robot.max_acceleration
        what, unit = 'an acceleration', '/s^2'
    j = int(np.argmax(use))
    k = int(np.argmax(np.abs(values[:, j])))
    unit = ('m' if robot.prismatic[j] else 'rad') + unit
    return (
        f'joint {robot.joint_names[j]!r} would need {what} of {abs(values[k, j]):.3g} {unit} at '
        f't = {timing.t[k]:.3f} s ({timing.s[k]:.3f} m along the seam), its limit is '
        f'{limits[j]:.3g}; slow the profile down or let it be fitted to the limits'
    )
