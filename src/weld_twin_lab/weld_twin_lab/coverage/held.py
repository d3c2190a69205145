# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How many measured positions lie in the 90 % regions of a prediction."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import Diagnosis
from weld_twin_core.diagnosis.algebra.fit import Fit, robust_fit
from weld_twin_core.diagnosis.algebra.problem import Model, Problem, Scale
from weld_twin_core.diagnosis.frames.aligned import aligned
from weld_twin_core.effects import effects_from_list
from weld_twin_core.effects.dated import seen_from
from weld_twin_core.errors import TwinError
from weld_twin_core.recording import Measurements, Recording
from weld_twin_core.twin.directions import Directions
from weld_twin_core.twin.discrepancy import Discrepancy
from weld_twin_core.twin.domain import Domain
from weld_twin_core.twin.posterior import (
    Posterior,
    expected_poses,
    largest_sigma,
    pose_covariances,
)
from weld_twin_core.twin.twin import Twin

from ..blind.making import SealedCase
from ..real_arms.unseen import flagged

HOLD = 0.9
"""Share of the errors that a region promises to hold."""
Mask = NDArray[np.bool_]


def inside_region(errors: Array, covariances: Array, sigma: Array) -> Mask:
    """
    Return which errors lie in their 90 % region, shape (M,).

    errors: measured minus predicted, shape (M, 3) [m].
    covariances: of the true position about the predicted one, shape (M, 3, 3) [m^2].
    sigma: noise of the instrument per axis, shape (M,) [m]; it comes on top.
    """
    whole = covariances + (sigma**2)[:, None, None] * np.eye(3)
    solved = np.linalg.solve(whole, errors[..., None])[..., 0]
    return np.asarray((errors * solved).sum(axis=1) <= chi2.ppf(HOLD, 3))


def held(
    diagnosis: Diagnosis,
    train: Recording,
    other: Recording,
    sigma: Array,
    good: Mask | None = None,
) -> dict[str, Any]:
    """
    Return how well the regions hold on a recording that was not fitted, as plain JSON values.

    diagnosis: of ``train``.
    sigma: the instrument's noise at the other's measurements, shape (M,) [m].
    good: measurements that count, shape (M,).
    """
    posterior, measured = diagnosis.posterior, other.measured
    assert posterior is not None
    assert measured is not None
    twin = twin_for(diagnosis.model, train, other)
    use = within(other, measured) if good is None else good & within(other, measured)
    t = measured.t[use]
    expected, covariances = expected_poses(posterior, twin, other, t)
    errors = measured.position[use] - expected.position
    regions = inside_region(errors, covariances[:, :3, :3], sigma[use])
    flags = flagged(posterior, other, t)
    size = np.linalg.norm(errors, axis=1)
    return {
        'poses': int(t.size),
        'held': _mean(regions),
        'flagged': _mean(flags),
        'held_unflagged': _mean(regions[~flags]),
        'held_flagged': _mean(regions[flags]),
        'mean_error_m': _mean(size),
        'median_sigma_m': float(np.median(largest_sigma(covariances))) if t.size else None,
        'largest_error_m': float(size.max()) if t.size else None,
    }


def twin_for(model: Model, train: Recording, other: Recording) -> Twin:
    """Return the model of a recording for another."""
    found = seen_from(model.found, train.epoch_ns, train.span_ns, other)
    return Model(model.robot, model.bases[:1], model.known, found).twin(0)


def within(other: Recording, measured: Measurements) -> Mask:
    """Return which measurements lie inside the joint stream, shape (M,)."""
    if other.joints.static:
        return np.ones(measured.t.size, dtype=bool)
    ends = other.joints.t[[0, -1]]
    return np.asarray((measured.t >= ends[0]) & (measured.t <= ends[1]))


def _mean(values: Array | Mask) -> float | None:
    return float(np.mean(values)) if values.size else None


UNSEEN = 1e-9
"""Least size of a column in noises; one that does nothing in the recording counts as known."""
STEPS = 40
"""Halvings in which the size of what the oracle misses is sought; far below rounding."""


def oracle_sigma(
    case: SealedCase, pair: tuple[Recording, Recording], mask: NDArray[np.bool_]
) -> dict[str, float]:
    """
    Return the median of the largest standard deviation of position [m], by two measures, or nothing.

    Least squares with the true causes and the true noise, on the recording that the diagnosis had.
    ``formal_sigma_m`` is its covariance alone, as if real gears and drives were no richer than the
    textbook. ``oracle_sigma_m`` adds, alike in all directions, just as much as makes its regions
    hold nine of ten true poses of the very motion that is predicted: nobody who is right nine times
    in ten can be narrower by the same model.

    pair: what is fitted, and the motion that is predicted, seen where the tool really is.
    """
    train, other = pair
    cell = case.cell
    try:
        causes, known = (
            tuple(effects_from_list([dict(one) for one in some], cell.robot))
            for some in (case.causes, cell.known)
        )
    except TwinError:
        return {}
    problem, start = aligned([train], cell.robot, frozenset(cell.align), known)
    found, scale = robust_fit(problem, start.with_found(causes))
    own = replace(scale, position=cell.tracker.sigma)
    posterior = _posterior(problem, found, own, train)
    if not posterior.directions.count or other.measured is None:
        return {}
    at = other.measured.t[mask]
    twin = twin_for(found.model, train, other)
    covariances = pose_covariances(posterior, twin, other, at)[:, :3, :3]
    errors = other.measured.position[mask] - twin.poses(other, at).position
    missed = _missed(errors, covariances)
    return {
        'formal_sigma_m': float(np.median(largest_sigma(covariances))),
        'oracle_sigma_m': float(np.median(largest_sigma(covariances + missed * np.eye(3)))),
    }


def _posterior(problem: Problem, found: Fit, scale: Scale, train: Recording) -> Posterior:
    """Return the fitted coordinates and their covariance; what nothing shows counts as known."""
    frames = tuple(frame for frame in ('base', 'tool') if frame in problem.align)
    what = Directions(frames, 1, found.model.found)
    features = problem.features(found.model)
    rows = problem.whitened(
        [problem.seen(k, what.columns(maker, k)) for k, maker in enumerate(features)], scale
    )
    size = np.maximum(np.linalg.norm(rows, axis=1), UNSEEN)
    unit = rows / size[:, None]
    covariance = np.linalg.pinv(unit @ unit.T, rcond=1e-12, hermitian=True) / np.outer(size, size)
    robot = found.model.robot
    none = Discrepancy(0.0, 0.0, np.zeros(robot.n), np.zeros(robot.n), 1.0)
    middle = 0.5 * (covariance + covariance.T)
    return Posterior(what, np.zeros(what.count), middle, none, Domain.of([train], robot))


def _missed(errors: Array, covariances: Array) -> float:
    """Return the least variance per axis [m^2] that makes regions hold as many errors as they shall."""

    def held(variance: float) -> bool:
        wider = np.full(len(errors), np.sqrt(variance))
        return bool(inside_region(errors, covariances, wider).mean() >= HOLD)

    low, high = 1e-18, max(1e-18, float((errors**2).sum(axis=1).max()))
    for _ in range(STEPS):
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if held(middle) else (middle, high)
    return high
