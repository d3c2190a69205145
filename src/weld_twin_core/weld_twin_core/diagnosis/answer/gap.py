# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The gap before any effect was found, and the residuals before and after for pictures."""

from __future__ import annotations

import numpy as np

from ..algebra.fit import trusted
from ..hypotheses.search import Search
from ..result import Gap, Traces


def gap(found: Search, floor: float) -> Gap:
    """
    Return the size of the gap over trusted samples.

    Parameters
    ----------
    found : Search
        Its baseline holds frames and known effects only.
    floor : float
        RMS of the noise alone, [m].

    """
    parts = found.problem.residuals(found.baseline.model)
    good = trusted(found.scale.weights)
    distance = np.concatenate(
        [np.linalg.norm(p[:3, g], axis=0) for p, g in zip(parts, good, strict=True)]
    )
    turns = [p[3:, g] for p, g in zip(parts, good, strict=True) if p.shape[0] > 3]
    turn = None
    if turns:
        turn = float(np.sqrt(np.mean(np.concatenate([(t**2).sum(axis=0) for t in turns]))))
    return Gap(
        rms_m=float(np.sqrt((distance**2).mean())),
        mean_m=float(distance.mean()),
        max_m=float(distance.max()),
        orientation_rms_rad=turn,
        samples=int(distance.size),
        noise_floor_m=floor,
    )


def traces(found: Search) -> Traces:
    """Return the position residuals before and after, sample by sample."""
    recordings = found.problem.recordings
    before = found.problem.residuals(found.baseline.model)
    after = found.problem.residuals(found.final.model)
    return Traces(
        t=tuple(r.measured.t for r in recordings if r.measured is not None),
        measured=tuple(r.measured.position for r in recordings if r.measured is not None),
        before=tuple(p[:3].T for p in before),
        after=tuple(p[:3].T for p in after),
        trusted=tuple(trusted(found.scale.weights)),
    )
