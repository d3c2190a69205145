# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""What a diagnosis predicts on stations it has never seen."""

from __future__ import annotations

from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis.algebra.problem import Model, Problem, usable
from weld_twin_core.effects.setup_motion import seen_from
from weld_twin_core.recording import Recording

ALIGN = frozenset({'base', 'tool'})


def residual(model: Model, train: Recording, other: Recording) -> Array:
    """
    Return measured minus predicted, shape (3 or 6, M) [m, rad]; nothing is fitted.

    model: fitted on ``train``.
    """
    found = seen_from(model.found, train.epoch_ns, train.span_ns, other)
    placed = Model(model.robot, model.bases[:1], model.known, found)
    return Problem((usable(other),), ALIGN).residuals(placed)[0]
