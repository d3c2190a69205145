# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
What the model leaves on postures left out of the fit, beyond what open directions account for.

The recordings are cut into blocks of like posture. Each block in turn is predicted by the model
fitted on the others; what is left over is as large as makes nine of ten of those predictions hold.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import erf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ..algebra.definite import Index
from ..algebra.designed import Design
from ..algebra.fit import solve_scaled
from ..algebra.independent_rows import by_sample
from ..algebra.noise_floor import NoiseFloor
from ..algebra.problem import Problem, Scale

HALVINGS = 3
"""Eight blocks: each leaves out an eighth, few enough for the others to stand for the fit."""
HOLD = 0.9
"""Share of unseen postures that their regions shall hold."""
SHARES = (0.0, 0.25, 0.5, 0.75, 0.95)
"""Shares of what is left over that may come from the gears; never all, for tools shake too."""
STEPS = 60
"""Halvings of the bracket in which the size is sought; far below rounding."""

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
    residual : array, shape (rows,)
    labels : array, shape (rows,)
        Block of like posture of every row.

    """

    own: Design
    precision: Array
    pull: Array
    columns: Array
    turns: Array
    residual: Array
    labels: Array


def posture_blocks(problem: Problem) -> Array:
    """
    Return a block number for every row: neighbours in joint space, whenever they were visited.

    Halved a few times at the median of the direction in which the joints vary most.
    """
    q = np.concatenate(
        [r.joints.at(r.measured.t)[0] for r in problem.recordings if r.measured is not None]
    )
    labels = np.zeros(q.shape[0], dtype=int)
    for _ in range(HALVINGS):
        halves = labels * 2
        for k in np.unique(labels):
            mine = np.flatnonzero(labels == k)
            centred = q[mine] - q[mine].mean(axis=0)
            along = centred @ np.linalg.svd(centred, full_matrices=False)[2][0]
            halves[mine[np.argsort(along, kind='stable')[mine.size // 2 :]]] += 1
        labels = halves
    rows = np.concatenate(
        [np.full(m, c) for c, m in zip(problem.rows, problem.samples, strict=True)]
    )
    return np.repeat(labels, rows)


class Rest(NamedTuple):
    """What is left over: per axis at the tool [m], about each axis [rad], in every gear [rad]."""

    position: float
    orientation: float
    gear: float


def leftover(
    problem: Problem, scale: Scale, unseen: Unseen, given: Given, floor: NoiseFloor
) -> Rest:
    """
    Return the standard deviations of what is left over.

    Parameters
    ----------
    given : callable
        Mean and covariance of the uncertain coordinates given all rows but those of a mask.
    floor : NoiseFloor
        What the recordings themselves say of the instrument's noise.

    """
    samples = _by_sample(problem)
    errors, moments = _predicted(unseen, given, samples)
    levers = [unseen.turns[:, index].T @ unseen.turns[:, index] for index in samples]
    weight = np.concatenate(scale.weights)
    units = (scale.position, scale.orientation)

    def part(axes: slice) -> tuple[Array, Array, Array]:
        """Return errors, moments and levers on three axes of the samples that have them."""
        wide = [k for k, index in enumerate(samples) if index.size >= axes.stop]
        unit = units[axes.start // 3] / np.sqrt(weight[wide])
        count = axes.stop - axes.start
        return (
            np.array([errors[k][axes] for k in wide]).reshape(-1, count) * unit[:, None],
            np.array([moments[k][axes, axes] for k in wide]).reshape(-1, count, count)
            * unit[:, None, None] ** 2,
            np.array([levers[k][axes, axes] for k in wide]).reshape(-1, count, count)
            * unit[:, None, None] ** 2,
        )

    if all(index.size < 3 for index in samples):
        # Faces and lengths show one way each: nothing parts what is left by axes or gears.
        off, moment, _ = part(slice(0, 1))
        position = float(np.sqrt(max(float((off**2).mean() - moment.mean()), 0.0)))
        gear = 0.0
    else:
        position, gear = _shared(*part(slice(0, 3)))
    e, v, levered = part(slice(3, 6))
    # Without measured turns the tool turns as much as it shifts on an arm of a metre.
    turn = _size(e, v + gear**2 * levered, np.eye(3)) if e.size else position
    return Rest(_quiet(problem, position, floor), turn, gear)


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
    unseen: Unseen, given: Given, samples: list[Index]
) -> tuple[list[Array], list[Array]]:
    """Return the error of every sample predicted from other blocks, and its second moment."""
    errors, shifts = np.array(unseen.residual), np.zeros(unseen.residual.size)
    normal = unseen.own.normal()
    normal[np.diag_indices_from(normal)] += unseen.precision
    right = unseen.own.times(unseen.residual) - unseen.pull
    place = np.repeat(np.arange(len(samples)), [index.size for index in samples])
    moments: list[Array] = [np.zeros((0, 0))] * len(samples)
    for b in np.unique(unseen.labels):
        out = unseen.labels == b
        mine, columns = unseen.own.within(np.flatnonzero(out)), unseen.columns[:, out]
        pulled = right - mine.times(unseen.residual[out])
        moved = mine.mixed(solve_scaled(normal - mine.normal(), pulled, 1e-9))
        mean, covariance = given(out)
        errors[out] -= moved
        # The mean is counted from the fit to all rows, the error from the fit to the others.
        shifts[out] = mean @ columns - moved
        spread, at = covariance @ columns, 0
        for k in np.unique(place[out]):
            size = samples[k].size
            own = slice(at, at + size)
            shift = shifts[samples[k]]
            moments[k] = columns[:, own].T @ spread[:, own] + np.outer(shift, shift)
            at += size
    return [errors[index] for index in samples], moments


def _size(errors: Array, moments: Array, shape: Array) -> float:
    """Return the factor of a shape's root that makes regions hold as many errors as they shall."""
    limit = _limit(HOLD)
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


def _limit(hold: float) -> float:
    """Return the squared length that a normal vector of three axes keeps with a probability."""
    low, high = 0.0, 100.0
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        # chi-square with three degrees of freedom, in closed form
        tail = np.sqrt(2.0 * middle / np.pi) * np.exp(-0.5 * middle)
        inside = erf(np.sqrt(0.5 * middle)) - tail
        low, high = (middle, high) if inside < hold else (low, middle)
    return high


def _quiet(problem: Problem, size: float, floor: NoiseFloor) -> float:
    """Return a size without the instrument's noise, as far as that is known by itself."""
    told = [
        float(np.median(r.measured.sigma))
        for r in problem.recordings
        if r.measured is not None and r.measured.sigma is not None
    ]
    noise = float(np.mean(told)) if told else floor.sigma * floor.independent
    return float(np.sqrt(max(size**2 - noise**2, 0.0)))
