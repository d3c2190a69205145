# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""The measurement to make next where the verdict leaves a question open."""

from __future__ import annotations

from typing import Any

from ...effects.effect import Effect
from ..hypotheses.choices import ranking
from ..hypotheses.search import Search
from ..verdict.decision import Verdict
from .experiment import next_experiment
from .limits import Limits
from .next_touches import next_touches

SURE = 0.9
"""Confidence from which a verdict closes the question. Answers from recordings that show little earn
less, however well they fit."""
TOUCHED = 4
"""The same where contacts measured: every touch that could be made is tried with each."""
MOST = 6
"""Explanations compared at most; each is predicted for every measurement that could be made."""


def next_step(
    found: Search, verdict: Verdict, limits: Limits | None = None
) -> dict[str, Any] | None:
    """
    Return the next experiment as `next_experiment` does, None when the question is closed.

    Parameters
    ----------
    found : Search
    verdict : Verdict
        With the confidence that it has earned.
    limits : Limits, optional
        What an experiment may cost, and where it has to stay.

    """
    if verdict.status in ('identified', 'none') and verdict.confidence >= SURE:
        return None
    listed = [found.small.model.found, *_in_place(found, verdict, named=True)]
    if found.problem.touched:
        if verdict.status in ('identified', 'none'):
            return None
        # A motion in the air would show nothing.
        final = found.final.model
        return next_touches(found.problem, final, listed[:TOUCHED], found.scale)
    closed = verdict.status == 'ambiguous' and verdict.confidence >= SURE and len(listed) > 1
    if not closed:
        listed += _in_place(found, verdict, named=False)
        listed += _beside(found)
    return next_experiment(
        found.work.problem,
        found.small.model,
        listed[:MOST],
        found.work.scale,
        limits,
        closed=closed,
    )


def _in_place(found: Search, verdict: Verdict, *, named: bool) -> list[tuple[Effect, ...]]:
    """Return the explanations with a rival in an effect's place: those named, or the others."""
    sites = {site for group in verdict.sets for site in group}
    own = found.small.model.found
    rivals = [rival for slot in found.slots for rival in slot if (rival.site in sites) is named]
    rivals.sort(key=lambda rival: -rival.probability)
    fits = [rival.fit.model.found for rival in rivals]
    return [effects for effects in fits if effects != own]


def _beside(found: Search) -> list[tuple[Effect, ...]]:
    """Return the explanations with one effect more, those first that come nearest to be needed."""
    model = found.small.model
    systems = found.work.beside(model, found.small.residual)
    ranked = ranking(systems, found.library.units, found.effective(found.small))
    taken = {(effect.name, effect.site) for effect in model.found}
    more = [choice for choice in ranked if choice.unit.site not in taken]
    return [(*model.found, choice.effect()) for choice in more[: MOST - 1]]
