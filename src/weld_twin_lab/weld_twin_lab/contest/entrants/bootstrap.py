# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""Plain geometric calibration again and again, on poses drawn with replacement: the bootstrap."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from weld_twin_core.arm.chain import forward

from ..open_form import ContestAnswer, ContestCase
from .geometry import ALL, answer_with, fit

DRAWS = 20
"""Of poses: a standard deviation of so many is good to a sixth."""


def answer(case: ContestCase) -> ContestAnswer:
    """Return what `geometry` says, and by how much its predictions scatter beside what it leaves."""
    rng, measured = np.random.default_rng(0), case.measured
    asked, _ = case.ask.joints.at(case.times)
    predictions = []
    for _ in range(DRAWS):
        rows = np.sort(rng.choice(measured.t.size, measured.t.size))
        drawn = replace(case, train=case.train.with_measured(measured.take(np.unique(rows))))
        predictions.append(forward(fit(drawn, ALL).robot, asked)[:, :3, 3])
    seen, _ = case.train.joints.at(measured.t)
    remaining = measured.position - forward(fit(case, ALL).robot, seen)[:, :3, 3]
    sigma = np.sqrt(np.var(predictions, axis=0, ddof=1) + (remaining**2).mean())
    return replace(answer_with(case, ALL), sigma=sigma)
