# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""One split diagnosed on its training poses and judged on its held-out ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

from weld_twin_core.arm import catalog
from weld_twin_core.arrays import Array
from weld_twin_core.diagnosis import Diagnosis, diagnose
from weld_twin_core.diagnosis.frames.aligned import frames_only

from .data import Split
from .unseen_stations import ALIGN, Errors, errors, inside, residual


@dataclass(frozen=True, eq=False)
class Judged:
    """
    A split with its diagnosis and what that predicts on the held-out poses.

    Attributes
    ----------
    split : Split
    diagnosis : Diagnosis
        Of the training poses alone.
    before, after : Errors
        On the held-out poses: frames fitted only, and with everything found.
    before_parts, after_parts : array, shape (3 or 6, M)
        The residuals behind them [m, rad].
    seconds : float

    """

    split: Split
    diagnosis: Diagnosis
    before: Errors
    after: Errors
    before_parts: Array
    after_parts: Array
    seconds: float

    @property
    def within(self) -> bool:
        """Return whether the claimed interval contains what is got."""
        return inside(self.diagnosis, self.before, self.after)

    @property
    def reached(self) -> bool:
        """Return whether every goal of the split is reached."""
        goal, got = self.split.goal, self.after
        pairs = [
            (goal.mean_m, got.mean_m),
            (goal.max_m, got.max_m),
            (goal.orientation_rad, got.orientation_rms_rad),
        ]
        return all(g is None or (v is not None and v <= g) for g, v in pairs)


def judge(split: Split, tell: Callable[[str], None] = lambda text: None) -> Judged:
    """Return a split diagnosed on its training poses and judged on the others."""
    nominal = catalog.load(split.robot)
    start = perf_counter()
    diagnosis = diagnose([split.train], nominal, align=ALIGN, progress=tell)
    seconds = perf_counter() - start
    before = residual(frames_only(split.train, nominal, ALIGN), split.train, split.test)
    after = residual(diagnosis.model, split.train, split.test)
    return Judged(split, diagnosis, errors(before), errors(after), before, after, seconds)
