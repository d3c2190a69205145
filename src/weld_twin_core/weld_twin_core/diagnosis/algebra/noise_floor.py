# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The noise floor, estimated from the data: repeats, differences of neighbours, what is left."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...arrays import Array
from .independent_rows import ENOUGH, measured_axes, robust_spread, visited
from .problem import Problem

THIRD = 20.0
"""Variance of a third difference, 1 -3 3 -1, over that of what it is taken of."""
WIDEST = 3.5e-4
"""Noise of a coordinate [m] beyond which what a model leaves is not taken for an instrument's. Trackers
have 0.01 to 0.1 mm, optical ones and good cameras 0.1 to 0.35 mm. Noise that is wider has to show by
itself, in repeats or differences, or be given with the data: a misfit looks the same."""


SPREAD_ERROR = 1.17
"""Standard error of a spread by the median of sizes, times the root of how many there are, over it."""
SURELY = 3.0
"""Standard errors by which what is left has to be below a noise that was given or seen to replace it."""


class NoiseFloor(NamedTuple):
    sigma: float  # standard deviation of one measured coordinate, [m]
    independent: bool  # whether it was given, or seen in repeats or differences

    @property
    def rms_m(self) -> float:
        return self.sigma * float(np.sqrt(3))


def noise_floor(problem: Problem, residuals: list[Array], least: float = 0.0) -> NoiseFloor:
    """
    Return the noise of one measured coordinate, and whether it is independent of any model.

    residuals: of the best model at hand, shape (c, M). What it leaves bounds the floor from above;
    repeated stations and third differences in time, where the data have them, and what was given with
    them, are not touched by its faults.
    least: noise [m] that is believed all the same, where many coordinates take it up.
    """
    estimates = []
    independent = True
    for recording, part in zip(problem.recordings, residuals, strict=True):
        position = measured_axes(part[:3])
        remaining = max(spread_of(position), least)
        static = recording.joints.static
        direct = _repeats(recording.joints.q, position) if static else _differences(position)
        if direct is None and recording.measured is not None:
            reported = recording.measured.sigma
            direct = None if reported is None else float(np.median(reported))
            independent &= direct is not None
        # Of a linear axis one coordinate was measured: the other two add nothing to a distance.
        share = float(np.sqrt(position.shape[0] / 3))
        if direct is None:
            between = max(_between(position), least) if static else remaining
            sigma = min(_less(between, remaining, position.size), WIDEST)
        else:
            sigma = _less(remaining, direct, position.size)
        estimates.append((share * sigma, part.shape[1]))
    values, counts = zip(*estimates, strict=True)
    return NoiseFloor(float(np.average(values, weights=counts)), independent)


def spread_of(position: Array) -> float:
    """Return the spread of what a model leaves; two heaps are no wider than they are apart."""
    return min(robust_spread(position), float(np.sqrt((position**2).mean())))


def _less(one: float, other: float, count: int) -> float:
    """Return a spread that is below another by no chance, of so many numbers; else the other."""
    by_chance = 1.0 - SURELY * SPREAD_ERROR / np.sqrt(max(count, 1))
    return one if one < by_chance * other else other


def _between(position: Array) -> float:
    """
    Return the noise of stations as one differs from the next.

    Noise is new at every station. What hangs together from one to the next is none: a mount that creeps
    or steps, or an arm whose stations go from place to place. Differences hold the misfit of two
    stations, so the noise is at most that.
    """
    return robust_spread(np.diff(position, axis=1)) / float(np.sqrt(2.0))


def _differences(position: Array) -> float | None:
    if position.shape[1] < ENOUGH:
        return None
    third = np.diff(position, n=3, axis=1)
    return robust_spread(third) / float(np.sqrt(THIRD))


def _repeats(q: Array, position: Array) -> float | None:
    if q.shape[0] != position.shape[1]:
        return None
    station = visited(q)
    order = np.argsort(station, kind='stable')
    close = np.diff(station[order]) == 0
    if close.sum() < ENOUGH:
        return None
    change = np.diff(position[:, order], axis=1)[:, close]
    return robust_spread(change) / float(np.sqrt(2.0))
