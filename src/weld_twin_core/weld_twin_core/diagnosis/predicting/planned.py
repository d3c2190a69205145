# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
How sure a fitted model will be after so many stations, before anybody measures.

To first order the covariance of what a fit leaves open does not depend on what is measured, only
on where [1]_. So the cloud of models that `allowed` finds after a measurement is known beforehand,
from what arms of this kind may have. Stations are taken one after the other, each the one that
makes the poses in the region surest.

References
----------
.. [1] V. V. Fedorov, "Theory of Optimal Experiments", Academic Press, 1972.

"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...arm.chain import frames, rising
from ...arm.robot import Robot
from ...arrays import Array, halton
from ...errors import DataError
from ...motion.paths import default_seam
from ...motion.planned_motion import plan
from ...recording import JointMotion, Recording
from ...twin.directions import Directions, Discrepancy
from ...twin.domain import Domain
from ...twin.features import Features
from ...twin.posterior import Posterior, postures_within_limits
from ...twin.twin import Twin
from ..algebra.fit import LEAST_NOISE
from . import plausible_arm

SPREAD = np.radians(75.0)
"""Half the range of every joint about the posture of a usual seam [rad]: wide enough to show every
link, and not so wide that a reflector turns away from the instrument or an arm into itself."""
SLIDE = 0.3
"""The same of a joint that slides [m]."""
CLEAR = 0.1
"""Least height of wrist and tool above the plane that the base stands on or hangs from, and distance
from the base's axis, in reaches: what keeps most postures out of the floor and the arm's column."""
NEARER = 0.5
"""Share of the room of the usual seam's posture, if less than `CLEAR`, that stations keep."""
CANDIDATES = 160
"""Stations to choose from; twice as many make the choice better by per cents."""
JUDGED = 48
"""Other postures of the region, at which it is judged how sure the model is."""
TRIED = 6000
"""Postures drawn to find so many that are clear."""
DRAWS = 1000
"""Of a tool's error at each posture, to count how many lie within the tolerance."""


class Wanted(NamedTuple):
    """Tolerance of the tool's position, and noise of a measured coordinate [m]."""

    tolerance: float
    noise: float


@dataclass(frozen=True, eq=False)
class MeasurementPlan:
    """Stations to measure, and how sure the model will be after each."""

    q: Array  # in the order in which they say most, shape (N, n) [rad, m]
    sigma: Array
    """Standard deviation of the tool in its worst direction, in the middle of the region's
    postures, after that many stations, shape (N + 1,) [m]."""
    within: Array
    """Probability that the tool is within the tolerance at such a posture, shape (N + 1,)."""
    elsewhere: Array
    """As ``sigma``, of postures anywhere in the arm's reach: what a diagnosis will warn of."""


def plan_stations(
    robot: Robot, count: int, tolerance: float, noise: float, spread: float = SPREAD
) -> MeasurementPlan:
    """
    Return the stations that make a fitted model surest, with base and tool frame not known.

    tolerance: of the tool's position, in any direction [m].
    noise: standard deviation of a measured coordinate, of instrument and arm together [m].
    spread: half the range of every joint about the posture of a usual seam [rad].

    Raises DataError: a number means nothing, or hardly any posture of the region is clear of the
    floor.
    """
    if not (0.0 < tolerance < 1.0 and 0.0 < noise < 0.1 and count >= 1 and 0.0 < spread <= np.pi):
        raise DataError('a plan needs stations, a tolerance, a noise and a spread above zero')
    clear = clear_postures(robot, spread)
    if len(clear) < JUDGED + min(count, CANDIDATES):
        raise DataError(
            f'only {len(clear)} postures about a usual seam of {robot.name} are clear of floor and '
            'column; give a smaller --spread'
        )
    region = clear[:JUDGED], clear[JUDGED : JUDGED + max(CANDIDATES, count)]
    own = min(noise, LEAST_NOISE)
    before = _before_any(robot, region[1], own)
    given = Wanted(tolerance, float(np.sqrt(noise**2 - own**2)))
    return _planned(before, Twin(robot), region, count, given)


def _before_any(robot: Robot, q: Array, own: float) -> Posterior:
    """
    Return how sure an arm is before anything is measured of it, its frames not known.

    Of the arm's own scatter [m] a diagnosis counts as its own what nothing tells from it
    (`leftover.ROUGH`), and so does the plan of one.
    """
    effects = plausible_arm.directions(robot, ())
    what = Directions(('base', 'tool'), 1, effects, plausible_arm.fine_knots([q]))
    fine = np.full(robot.n, plausible_arm.FINE) * ~np.asarray(robot.prismatic)
    rest = Discrepancy(own, own, np.zeros(robot.n), fine, plausible_arm.SPACING)
    covariance = np.diag(plausible_arm.widths(robot, what) ** 2)
    stations = Recording('stations', JointMotion(np.arange(float(len(q))), q, static=True))
    return Posterior(what, np.zeros(what.count), covariance, rest, Domain.of([stations], robot))


def plan_more(
    posterior: Posterior, twin: Twin, region: tuple[Array, Array], count: int, given: Wanted
) -> MeasurementPlan:
    """
    Return the stations that make a model surest in a region, after what was recorded already.

    Before the first of them it is as sure there as `twin.posterior.usual_sigma` says: the promise
    of a plan is the warning of the diagnosis. New stations count in the set-up that was recorded.

    region: postures at which it is judged how sure the model is, and those that may be measured.
    """
    offered = len(region[1])
    if not (0.0 < given.tolerance < 1.0 and 0.0 < given.noise < 0.1 and 0 <= count <= offered):
        raise DataError(
            f'a plan in a region needs a tolerance and a noise above zero, and at most the '
            f'{offered} stations that there are'
        )
    return _planned(posterior, twin, region, count, given)


def _planned(
    posterior: Posterior, twin: Twin, region: tuple[Array, Array], count: int, given: Wanted
) -> MeasurementPlan:
    anywhere = postures_within_limits(twin.robot, JUDGED)
    still = posterior.at_rest(twin, np.concatenate([*region, anywhere]))
    ways, rest = posterior.position_ways(Features(twin, still, still.joints.t))
    ends = np.cumsum([len(region[0]), len(region[1])])
    (seen, offered, far), (own, more, rest_far) = np.split(ways, ends), np.split(rest, ends)
    noise = more + given.noise**2 * np.eye(3)
    squares = np.random.default_rng(1).standard_normal((DRAWS, 3)) ** 2

    def sure() -> tuple[float, float, float]:
        """Return what `MeasurementPlan` has of the stations taken."""
        size, beyond = _sizes(seen, own), _sizes(far, rest_far)
        within = float((squares @ (size**2).T < given.tolerance**2).mean())
        return float(np.median(size[:, -1])), within, float(np.median(beyond[:, -1]))

    taken: list[int] = []
    certainties = [sure()]
    for _ in range(count):
        gain = _gains(seen, offered, noise)
        gain[taken] = -np.inf
        taken.append(int(gain.argmax()))
        rows = offered[taken[-1]]
        shown = rows.T @ np.linalg.solve(rows @ rows.T + noise[taken[-1]], rows)
        # What is still open of every way, as ways of one standard deviation again.
        root = np.linalg.cholesky(np.eye(len(shown)) - shown)
        seen, offered, far = seen @ root, offered @ root, far @ root
        certainties.append(sure())
    return MeasurementPlan(region[1][taken], *np.array(certainties).T)


def _sizes(ways: Array, rest: Array) -> Array:
    """Return standard deviations of position along its axes, the largest last, shape (K, 3) [m]."""
    spread = ways @ np.swapaxes(ways, 1, 2) + rest
    return np.asarray(np.sqrt(np.maximum(np.linalg.eigvalsh(spread), 0.0)))


def _gains(seen: Array, offered: Array, noise: Array) -> Array:
    """Return what each station offered takes off the variance of the poses judged, shape (C,)."""
    spread = offered @ np.swapaxes(offered, 1, 2) + noise
    cross = np.tensordot(seen, offered, axes=(2, 2))
    joint = np.einsum('miks,mikt->kst', cross, cross, optimize=True)
    return np.asarray(np.trace(np.linalg.solve(spread, joint), axis1=1, axis2=2))


def clear_postures(robot: Robot, spread: float) -> Array:
    """Return postures about that of a usual seam, clear of floor and column, (K, n)."""
    middle = plan(robot, default_seam(robot, 'line'), 'smooth', rate_hz=10.0).motion.q
    centre = middle[len(middle) // 2]
    own = robot.branches[1] if robot.behind else robot
    half = np.where(robot.prismatic, SLIDE, spread)
    low, high = np.maximum(centre - half, robot.lower), np.minimum(centre + half, robot.upper)
    q = low + halton(robot.n, TRIED) * (high - low)
    least = CLEAR * float(abs(robot.a).sum() + abs(robot.d).sum())
    (height,), (side,) = _room(own, centre[None, robot.behind :])
    heights, sides = _room(own, q[:, robot.behind :])
    above = heights > (least if height > least else height - NEARER * abs(height))
    off = sides > (least if side > least else NEARER * side)
    return np.asarray(q[above & off])


def _room(robot: Robot, q: Array) -> tuple[Array, Array]:
    """Return the least height of wrist and tool, and distance from the base's axis, (K,) each [m]."""
    chain = frames(robot.with_frames(base=np.eye(4)), q)
    wrist = [np.broadcast_to(row.z_point.T, (len(q), 3)) for row in chain.rows[robot.n // 2 :]]
    points = np.stack([*wrist, chain.flange_point, chain.position], axis=1)
    heights = (rising(robot) * points[..., 2]).min(axis=1)
    return heights, np.linalg.norm(points[..., :2], axis=-1).min(axis=1)
