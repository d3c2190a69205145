# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""How sure of a pose one is who knows the causes, and fits their sizes and the frames alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from weld_twin_core.arm.robot import Robot
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.algebra.fit import robust_fit
from weld_twin_core.diagnosis.frames.aligned import posed
from weld_twin_core.effects import Effect, effects_from_list
from weld_twin_core.errors import TwinError
from weld_twin_core.recording import Recording
from weld_twin_core.twin.domain import Domain
from weld_twin_core.twin.posterior import (
    Directions,
    Discrepancy,
    Posterior,
    largest_sigma,
    pose_covariances,
)


def oracle_sigma(
    robot: Robot,
    known: Sequence[Effect],
    truth: dict[str, Any],
    pair: tuple[Recording, Recording],
    at: Array,
) -> float | None:
    """
    Return the median of the largest standard deviation of position [m].

    Least squares with the true causes and the true noise, whose covariance is seen through the
    derivatives of the pose. Directions that nothing shows count as known.

    Parameters
    ----------
    robot : Robot
    known : sequence of Effect
        Told beforehand.
    truth : dict
        Of a sealed case.
    pair : (Recording, Recording)
        What is fitted, and the motion that is predicted.
    at : array, shape (M,) [s]

    Returns
    -------
    float or None
        None where a cause has no formula, or nothing is predicted.

    """
    train, other = pair
    try:
        causes = effects_from_list([dict(cause) for cause in truth['causes']], robot)
    except TwinError:
        return None
    problem, start = posed([train], robot, frozenset(truth['align']), tuple(known))
    found, scale = robust_fit(problem, start.with_found(tuple(causes)), problem.unit_scale())
    frames = tuple(frame for frame in ('base', 'tool') if frame in problem.align)
    what = Directions(frames, 1, found.model.found)
    if not what.count or not at.size:
        return 0.0 if at.size else None
    scale = replace(scale, position=float(truth['sigma_m']))
    features = problem.features(found.model)
    seen = [problem.seen(k, what.columns(maker, k)) for k, maker in enumerate(features)]
    rows = problem.whitened(seen, scale)
    size = np.maximum(np.linalg.norm(rows, axis=1), 1e-300)
    unit = rows / size[:, None]
    covariance = np.linalg.pinv(unit @ unit.T, rcond=1e-12, hermitian=True) / np.outer(size, size)
    none = Discrepancy(0.0, 0.0, np.zeros(robot.n), np.zeros(robot.n), 1.0)
    posterior = Posterior(
        what,
        np.zeros(what.count),
        0.5 * (covariance + covariance.T),
        none,
        Domain.of([train], robot),
    )
    return float(
        np.median(largest_sigma(pose_covariances(posterior, found.model.twin(0), other, at)))
    )
