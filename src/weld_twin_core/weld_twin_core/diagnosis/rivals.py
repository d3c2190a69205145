# SPDX-FileCopyrightText: weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Who else could have done it: for every effect found, the others that would do as well in its place.

Probabilities come from the evidence of fitted alternatives. Families that share a subspace on
these data tie, and are named together.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .fit import Fit, fit
from .gram import Gram
from .result import Site
from .score import evidence
from .select import Workspace, fitted_with, ranking, without

TEMPERATURE = 2.0
"""Evidence is softened by this: real physics is a little richer than any model compared."""
SHORTLIST = 7
LISTED = 0.03
"""A rival this probable is named beside the leader."""


@dataclass(frozen=True, eq=False)
class Rival:
    """A unit in the place of a found effect: its evidence, and the fit with it."""

    site: Site
    nats: float
    fit: Fit
    probability: float = 0.0


def rivals(
    work: Workspace, now: Fit, k: int, effective: Callable[[Fit], float]
) -> tuple[Rival, ...]:
    """
    Return found effect k and those that could take its place, most probable first.

    Parameters
    ----------
    work : Workspace
    now : Fit
        The final fit, on the workspace's problem and scale.
    k : int
    effective : callable
        Number of independent rows of a fit.

    """
    effect = now.model.found[k]
    rest = fit(work.problem, without(now.model, k), work.scale, None, 4)
    out = [Rival(Site(effect.name, effect.site), _nats(rest, now, effective(now), 1.0), now)]
    gram = work.conditioned(rest.model, rest.residual)
    choices = ranking(gram, work.library.units, effective(now))
    taken = {(e.name, e.site) for e in now.model.found}
    choices = [c for c in choices if c.unit.site not in taken and c.nats > 0.0]
    if choices:
        reach = max(15.0, 0.35 * choices[0].nats)
        close = [c for c in choices if c.nats > choices[0].nats - reach]
        for choice in close[:SHORTLIST]:
            other = fitted_with(work, rest.model, choice.effect(gram))
            nats = _nats(rest, other, effective(other), choice.unit.trials)
            # Unused components of a vector effect buy nothing and cost nothing.
            spare = other.coordinates.size - rest.coordinates.size - choice.columns.size
            if spare > 0 and choice.columns.size < choice.unit.columns[choice.seed].size:
                nats += 0.5 * spare * float(np.log(max(effective(other), 3.0)))
            out.append(Rival(Site(*choice.unit.site), nats, other))
    weights = np.exp((np.array([r.nats for r in out]) - max(r.nats for r in out)) / TEMPERATURE)
    weights /= weights.sum()
    ranked = [replace(r, probability=float(w)) for r, w in zip(out, weights, strict=True)]
    return tuple(sorted(ranked, key=lambda r: -r.probability))


def _nats(rest: Fit, full: Fit, count: float, trials: float) -> float:
    gram = Gram(np.zeros((0, 0)), np.zeros(0), rest.rss, rest.residual.size, np.zeros(0))
    freedom = full.coordinates.size - rest.coordinates.size
    return evidence(gram, rest.rss - full.rss, freedom, count) - float(np.log(max(trials, 1.0)))
