# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a diagnosis predicts on stations it has never seen."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.algebra.problem import Model, Problem, usable
from weld_twin_core.diagnosis.result import Diagnosis
from weld_twin_core.effects.setup_motion import seen_from
from weld_twin_core.recording import Recording

ALIGN = frozenset({'base', 'tool'})


@dataclass(frozen=True)
class Errors:
    """Measured minus predicted [m, rad]."""

    mean_m: float
    max_m: float
    rms_m: float
    orientation_rms_rad: float | None
    poses: int

    def as_dict(self) -> dict[str, Any]:
        """Return the entry of the results file."""
        return asdict(self)


def residual(model: Model, train: Recording, other: Recording) -> Array:
    """
    Return measured minus predicted, shape (3 or 6, M) [m, rad]; nothing is fitted.

    Parameters
    ----------
    model : Model
        Fitted on ``train``.
    train, other : Recording

    """
    found = seen_from(model.found, train.epoch_ns, train.span_ns, other)
    placed = Model(model.robot, model.bases[:1], model.known, found)
    return Problem((usable(other),), ALIGN).residuals(placed)[0]


def errors(parts: Array) -> Errors:
    """Return the figures of residuals, shape (3 or 6, M)."""
    size = np.linalg.norm(parts[:3], axis=0)
    turn = None
    if parts.shape[0] > 3:
        turn = float(np.sqrt((parts[3:] ** 2).sum(axis=0).mean()))
    return Errors(
        float(size.mean()), float(size.max()), float(np.sqrt((size**2).mean())), turn, size.size
    )


def inside(diagnosis: Diagnosis, before: Errors, after: Errors) -> bool:
    """Return whether the share of the gap left on unseen poses is one the diagnosis claimed."""
    low, high = diagnosis.shrink.ci95
    return low <= after.rms_m / before.rms_m <= high
