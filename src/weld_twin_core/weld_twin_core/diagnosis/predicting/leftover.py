# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What the model leaves on postures left out of the fit, beyond what open directions account for.

The recordings are cut into regions of posture. Each in turn is predicted by the model fitted on the
others; what is left over is as large as makes nine of ten of those predictions hold. Of that, what
the instrument's noise is made of is taken off: noise differs from one sample to the next, what the
arm does does not. Stations that lie apart do not tell the two from each other. There it counts for
how much the arm has of all the small errors that could be told.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from ...arrays import Array
from ...recording import Recording
from ...twin.turns import just_turned
from ..algebra.definite import Index
from ..algebra.designed import Design
from ..algebra.fit import TRUSTED, solve_scaled
from ..algebra.independent_rows import by_sample
from ..algebra.noise_floor import NoiseFloor
from ..algebra.problem import Problem, Scale

HOLD = 0.9
"""Share of unseen postures that their regions shall hold."""
SHARES = (0.0, 0.25, 0.5, 0.75, 0.95)
"""Shares of what is left over that may come from the gears; never all, for tools shake too."""
ROUGH = 0.5
"""Share of small errors of a usual size from which on all that is left is the arm's. A judgement: of two
real arms under a tracker it is 0.3 to 0.6, and their stations repeat better than models predict."""
STEPS = 60
"""Halvings of the bracket in which the size is sought; far below rounding."""

FEW = 12
"""Samples after turns of a joint below which they tell nothing of what is left there."""
PEAK = 1.7321
"""Largest size of an error that grows from nothing and goes again, in that of its RMS: a triangle's."""
CLEAR = 2.0
"""Standard errors by which more must be left there than elsewhere: a bound that is told too wide does
less harm than one too narrow."""

Given = Callable[[NDArray[np.bool_]], tuple[Array, Array]]
"""Mean and covariance of the coordinates given all rows but those of a mask."""


@dataclass(frozen=True, eq=False)
class Unseen:
    """
    What predicts rows from others.

    Attributes
    ----------
    own : Design
        Whitened columns of frames and found effects: what the fit turned.
    precision, pull : array, shape (K,)
        Of the fit's prior, and how hard it pulls from where the fit is.
    columns : array, shape (P, rows)
        Those of the coordinates that are uncertain.
    turns : array, shape (n, rows)
        Those of the joints that turn.
    levers : array, shape (n, rows)
        Those of all joints.
    residual : array, shape (rows,)
    labels : array, shape (rows,)
        Block of like posture of every row.

    """

    own: Design
    precision: Array
    pull: Array
    columns: Array
    turns: Array
    levers: Array
    residual: Array
    labels: Array


class Rest(NamedTuple):
    """
    What is left over: per axis at the tool [m], about each axis [rad], in every gear [rad].

    ``turns``, shape (n,) [rad or m], is what is left over in joints that have just turned around,
    on top of that.
    """

    position: float
    orientation: float
    gear: float
    turns: Array


def leftover(
    problem: Problem,
    scale: Scale,
    unseen: Unseen,
    given: Given,
    floor: NoiseFloor,
    rough: float,
    lost: Array,
) -> Rest:
    """
    Return the standard deviations of what is left over.

    Parameters
    ----------
    given : callable
        Mean and covariance of the uncertain coordinates given all rows but those of a mask.
    floor : NoiseFloor
        What the recordings themselves say of the instrument's noise.
    rough : float
        Share of the arm's small errors that are of a usual size.
    lost : array, shape (n,) [rad or m]
        How much motion was found to be lost in every joint.

    """
    samples = _by_sample(problem)
    errors, moments, pairs = _predicted(problem, unseen, given, samples)
    levers = [unseen.turns[:, index].T @ unseen.turns[:, index] for index in samples]
    weight = np.concatenate(scale.weights)

    def part(axes: slice) -> tuple[Array, Array, Array]:
        """Return errors, moments and levers on three axes of the samples that have them."""
        wide = [k for k, index in enumerate(samples) if index.size >= axes.stop]
        unit = (scale.position if axes.start < 3 else scale.orientation) / np.sqrt(weight[wide])
        count = axes.stop - axes.start
        square = [
            np.array([each[k][axes, axes] for k in wide]).reshape(-1, count, count)
            * unit[:, None, None] ** 2
            for each in (moments, levers)
        ]
        off = np.array([errors[k][axes] for k in wide]).reshape(-1, count) * unit[:, None]
        return off, square[0], square[1]

    if all(index.size < 3 for index in samples):
        # Faces and lengths show one way each: nothing parts what is left by axes or gears.
        off, moment, _ = part(slice(0, 1))
        position, gear = float(np.sqrt(max((off**2).mean() - moment.mean(), 0.0))), 0.0
    else:
        position, gear = _shared(*part(slice(0, 3)))
    e, v, levered = part(slice(3, 6))
    # Without measured turns the tool turns as much as it shifts on an arm of a metre.
    turn = _size(e, v + gear**2 * levered, np.eye(3)) if e.size else position
    common = _common(errors, moments, pairs, weight > TRUSTED)
    share = _of_the_arm(*common, _noise(problem, floor, scale.position), rough, problem.at_rest)
    at_turns = _at_turns(problem, unseen, samples, errors, moments, lost)
    return Rest(position * share, turn * share, gear * share, at_turns)


def _at_turns(
    problem: Problem,
    unseen: Unseen,
    samples: list[Index],
    errors: list[Array],
    moments: list[Array],
    lost: Array,
) -> Array:
    """
    Return how far joints may be off where they have just turned around, shape (n,) [rad or m].

    Laws of lost motion differ on that way alone, and look alike on the rest of a recording. Where more
    is left there than elsewhere, the law that was found does not hold, and any part of the motion may
    be lost: evenly likely ones have this standard deviation. Else it is as much as the noise may hide.
    """
    out = np.zeros(lost.size)
    seen = np.array([k for k, error in enumerate(errors) if error.size >= 3], dtype=int)
    if not lost.any() or problem.at_rest or not seen.size:
        return out
    excess = np.array([_excess(errors[k], errors[k], moments[k]) for k in seen])
    near = np.concatenate([_turned(problem, k) for k in range(len(problem.recordings))])[seen]
    for i in np.flatnonzero(lost):
        here, beside = excess[near[:, i]], excess[~near[:, i]]
        if min(here.size, beside.size) < FEW:
            continue
        doubt = CLEAR * np.sqrt(here.var() / here.size + beside.var() / beside.size)
        more, out[i] = here.mean() - beside.mean(), lost[i] / np.sqrt(3.0)
        if more <= doubt:
            size = np.mean(
                [(unseen.levers[i, samples[k][:3]] ** 2).mean() for k in seen[near[:, i]]]
            )
            out[i] = min(out[i], PEAK * np.sqrt(max(more + doubt, 0.0) / max(size, 1e-300)))
    return out


def _turned(problem: Problem, k: int) -> NDArray[np.bool_]:
    """Return which joints have just turned at the samples of a recording; none where it touched."""
    recording = problem.recordings[k]
    if recording.measured is None or problem.contact(k) is not None:
        return np.zeros((problem.samples[k], recording.joints.q.shape[1]), dtype=bool)
    return just_turned(recording.joints, recording.measured.t)


def _common(
    errors: list[Array],
    moments: list[Array],
    pairs: list[tuple[int, int, Array]],
    good: NDArray[np.bool_],
) -> tuple[float, float]:
    """Return the variance of what is left, and what of it neighbours have in common."""
    own = [_excess(errors[k], errors[k], moments[k]) for k in np.flatnonzero(good)]
    alike = [
        _excess(errors[k], errors[n], moment)
        for k, n, moment in pairs
        if good[k] and good[n] and errors[k].size == errors[n].size
    ]
    return float(np.mean(own)), float(np.mean(alike or [0.0]))


def _excess(one: Array, other: Array, moment: Array) -> float:
    """Return by how much two samples' errors agree, beyond what open directions account for."""
    axes = slice(0, 3)
    return float(one[axes] @ other[axes] - np.trace(moment[axes, axes])) / one[axes].size


def _of_the_arm(
    left: float, beside: float, noise: float | None, rough: float, at_rest: bool
) -> float:
    """
    Return the part of what is left over that is the arm's, as a factor of its size.

    Parameters
    ----------
    left, beside : float
        Variance of what is left, and what of it neighbours have in common [noise of the fit].
    noise : float, optional
        Standard deviation of the instrument [noise of the fit]; None where nothing tells it.
    at_rest : bool
        Whether stations were measured, which lie apart.

    """
    # Where open directions account for all of it, neighbours have nothing in common either.
    left = max(left, 1e-12)
    common = min(max(beside, 0.0), left)
    alone = left - common
    if noise is None:
        common += alone * min(rough / ROUGH, 1.0)
    elif at_rest:
        common += max(alone - noise**2, 0.0)
    return float(np.sqrt(common / left))


def _shared(errors: Array, moments: Array, levers: Array) -> tuple[float, float]:
    """Return what is left over per axis [m] and per gear [rad]: the likeliest mixture."""
    lever = float(np.trace(levers, axis1=1, axis2=2).mean()) / 3.0
    best = (-np.inf, 0.0, 0.0)
    for share in SHARES if lever > 0.0 else SHARES[:1]:
        shape = (1.0 - share) * np.eye(3) + share * levers / max(lever, 1e-300)
        size = _size(errors, moments, shape)
        whole = moments + (size**2 + 1e-18) * shape + 1e-18 * np.eye(3)
        solved = np.linalg.solve(whole, errors[..., None])[..., 0]
        likely = -0.5 * float(((errors * solved).sum(axis=1) + np.linalg.slogdet(whole)[1]).sum())
        gear = size * np.sqrt(share / max(lever, 1e-300))
        best = max(best, (likely, size * np.sqrt(1.0 - share), float(gear)))
    return best[1], best[2]


def _by_sample(problem: Problem) -> list[Index]:
    """Return the row numbers of every sample."""
    size = sum(c * m for c, m in zip(problem.rows, problem.samples, strict=True))
    parts = by_sample(np.arange(size), problem.rows, problem.samples)
    return [row for part in parts for row in part]


def _predicted(
    problem: Problem, unseen: Unseen, given: Given, samples: list[Index]
) -> tuple[list[Array], list[Array], list[tuple[int, int, Array]]]:
    """
    Return the error of every sample predicted from other regions, and its second moment.

    And of every sample with its neighbour, the numbers of both and their common moment.
    """
    errors, shifts = np.array(unseen.residual), np.zeros(unseen.residual.size)
    normal = unseen.own.normal()
    normal[np.diag_indices_from(normal)] += unseen.precision
    right = unseen.own.times(unseen.residual) - unseen.pull
    place = np.repeat(np.arange(len(samples)), [index.size for index in samples])
    moments: list[Array] = [np.zeros((0, 0))] * len(samples)
    pairs: list[tuple[int, int, Array]] = []
    for b in np.unique(unseen.labels):
        out = unseen.labels == b
        mine, columns = unseen.own.within(np.flatnonzero(out)), unseen.columns[:, out]
        pulled = right - mine.times(unseen.residual[out])
        moved = mine.mixed(solve_scaled(normal - mine.normal(), pulled, 1e-9))
        mean, covariance = given(out)
        errors[out] -= moved
        # The mean is counted from the fit to all rows, the error from the fit to the others.
        shifts[out] = mean @ columns - moved
        spread, here = covariance @ columns, np.unique(place[out])
        ends = np.cumsum([0, *(samples[k].size for k in here)])
        own = {k: slice(a, b) for k, a, b in zip(here, ends[:-1], ends[1:], strict=True)}

        def moment(one: int, other: int) -> Array:
            """Return the common second moment of two samples of the region."""
            shift = np.outer(shifts[samples[one]], shifts[samples[other]])
            return np.asarray(columns[:, own[one]].T @ spread[:, own[other]] + shift)  # noqa: B023

        for k in here:
            moments[k] = moment(k, k)
        pairs += [(k, n, moment(k, n)) for k, n in _neighbours(problem, here)]
    return [errors[index] for index in samples], moments, pairs


def _neighbours(problem: Problem, here: Array) -> list[tuple[int, int]]:
    """Return every sample of some and the next in time; of stations, the next in posture."""
    if here.size < 2:
        return []
    if not problem.at_rest:
        return [(int(k), int(n)) for k, n in pairwise(here)]
    q = np.concatenate([_postures(r) for r in problem.recordings])[here]
    apart = ((q[:, None] - q[None]) ** 2).sum(axis=2)
    np.fill_diagonal(apart, np.inf)
    return [(int(k), int(n)) for k, n in zip(here, here[apart.argmin(axis=1)], strict=True)]


def _postures(recording: Recording) -> Array:
    assert recording.measured is not None
    return recording.joints.at(recording.measured.t)[0]


def _size(errors: Array, moments: Array, shape: Array) -> float:
    """Return the factor of a shape's root that makes regions hold as many errors as they shall."""
    limit = float(chdtri(3.0, 1.0 - HOLD))
    # Of few errors the largest say more of those to come than their count: conformal level.
    wanted = min(HOLD * (1.0 + 1.0 / len(errors)), 1.0)

    # On the axes in which both are diagonal, every size asked for costs a division.
    root = np.linalg.inv(np.linalg.cholesky(np.broadcast_to(shape, moments.shape)))
    spread, turn = np.linalg.eigh(root @ (moments + 1e-18 * np.eye(3)) @ np.swapaxes(root, -1, -2))
    along = (np.swapaxes(turn, -1, -2) @ (root @ errors[..., None]))[..., 0] ** 2

    def held(variance: float) -> float:
        return float(np.mean((along / (spread + variance)).sum(axis=1) <= limit))

    low, high = 0.0, 100.0 * float((errors**2).sum(axis=1).max()) + 1e-18
    if held(low) >= wanted:
        return 0.0
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if held(middle) >= wanted else (middle, high)
    return float(np.sqrt(high))


def _noise(problem: Problem, floor: NoiseFloor, unit: float) -> float | None:
    """Return the instrument's noise in units [m], told with the data or seen in them; None without."""
    told = [
        float(np.median(r.measured.sigma))
        for r in problem.recordings
        if r.measured is not None and r.measured.sigma is not None
    ]
    if told:
        return float(np.mean(told)) / unit
    return floor.sigma / unit if floor.independent else None
