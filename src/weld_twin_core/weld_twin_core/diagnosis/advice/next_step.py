# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The measurement to make next where the verdict leaves a question open."""

from __future__ import annotations

from typing import Any

from ..hypotheses.search import Search
from ..verdict.decision import Verdict
from .experiment import next_experiment

MOST = 4
"""Explanations compared at most; each is predicted for every measurement that could be made."""


ANOTHER_PLACE = {
    'sentence': "Move what is touched by half the arm's reach, higher or lower than it was, and touch "
    'it in 12 postures there, wrist and elbow as different as the cell allows.',
    'reason': 'A place that was not used shows most of what the others leave open.',
}
"""What to do next where contacts measured: a motion in the air would show them nothing."""


def next_step(found: Search, verdict: Verdict) -> dict[str, Any] | None:
    """Return the next experiment as `next_experiment` does, None when the question is closed."""
    if verdict.status not in ('ambiguous', 'unknown'):
        return None
    if found.problem.touched:
        return dict(ANOTHER_PLACE)
    model = found.small.model
    named = {site for group in verdict.sets for site in group}
    alternatives = [model.found]
    for slot in found.slots:
        fits = [rival.fit.model.found for rival in slot if rival.site in named]
        alternatives += [effects for effects in fits if effects != model.found]
    return next_experiment(found.work.problem, model, alternatives[:MOST], found.work.scale)
