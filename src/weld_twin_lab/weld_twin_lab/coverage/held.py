# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How many measured positions lie in the 90 % regions of a prediction."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import Diagnosis
from weld_twin_core.diagnosis.algebra.problem import Model
from weld_twin_core.effects.dated import seen_from
from weld_twin_core.recording import Measurements, Recording
from weld_twin_core.twin.posterior import expected_poses, largest_sigma
from weld_twin_core.twin.twin import Twin

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
