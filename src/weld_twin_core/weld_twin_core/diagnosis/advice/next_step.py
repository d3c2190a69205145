# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The measurement to make next where the verdict leaves a question open."""

from __future__ import annotations

from typing import Any

from ..hypotheses.search import Search
from ..verdict.decision import Verdict
from .experiment import next_experiment
from .next_touches import next_touches

MOST = 4
"""Explanations compared at most; each is predicted for every measurement that could be made."""


def next_step(found: Search, verdict: Verdict) -> dict[str, Any] | None:
    """Return the next experiment as `next_experiment` does, None when the question is closed."""
    if verdict.status not in ('ambiguous', 'unknown'):
        return None
    model = found.small.model
    named = {site for group in verdict.sets for site in group}
    alternatives = [model.found]
    for slot in found.slots:
        fits = [rival.fit.model.found for rival in slot if rival.site in named]
        alternatives += [effects for effects in fits if effects != model.found]
    if found.problem.touched:
        # A motion in the air would show nothing.
        return next_touches(found.problem, found.final.model, alternatives[:MOST], found.scale)
    return next_experiment(found.work.problem, model, alternatives[:MOST], found.work.scale)
