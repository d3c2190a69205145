# Copyright 2026 weld_twin contributors
# SPDX-License-Identifier: Apache-2.0
"""
Who else could have done it: for every effect found, the others that would do as well in its place.

Probabilities come from the evidence of fitted alternatives. Families that share a subspace on
these data tie, and are named together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...effects.effect import Effect
from ..algebra.fit import Fit
from ..result import Site
from .other_sets import Other
from .seed_systems import Choice, evidence, ranking
from .selection import Workspace, fitted_with, implausible

SHORTLIST = 7
"""Rivals fitted at the most; bounds the time that a slot takes."""


@dataclass(frozen=True, eq=False)
class Rival:
    """
    A unit in the place of a found effect: its evidence, and the fit with it.

    Attributes
    ----------
    site : Site
    nats : float
    fit : Fit
    probability : float
        Its share of the evidence in this place.
    behind : float
        By how much a family that was taken out is ahead in this place [nats]; 0 of none.

    """

    site: Site
    nats: float
    fit: Fit
    probability: float = 0.0
    behind: float = 0.0


def rivals(
    work: Workspace,
    now: Fit,
    k: int,
    effective: Callable[[Fit], float],
    others: Sequence[Other] = (),
) -> tuple[Rival, ...]:
    """
    Return found effect k and those that could take its place, most probable first.

    Parameters
    ----------
    now : Fit
        The final fit, on the workspace's problem and scale.
    effective : callable
        Number of independent rows of a fit.
    others : sequence of Other
        Sets that do without something found: what takes its place may need company.

    """
    effect = now.model.found[k]
    rest = work.without(now, k).fit
    ranked, tried = contenders(work, rest, effective(now), now.model.found)
    own = next((c for c in ranked if c.unit.site == (effect.name, effect.site)), None)
    count = work.independent([now, *(f for _, f in tried)], [effect.name], effective)
    place = Place(work, effect.name, rest, count)
    out = [Rival(Site(effect.name, effect.site), place.nats(now, own), now)]
    for choice, other in tried:
        log_bayes_factor = place.nats(other, choice)
        out.append(Rival(Site(*choice.unit.site), log_bayes_factor, other))
    for other_set in others:
        if other_set.instead_of == (effect.name, effect.site):
            first = next((s for s in other_set.newcomers(now) if s not in _sites(out)), None)
            if first is not None:
                out.append(Rival(Site(*first), out[0].nats + other_set.ahead, other_set.fit))
    return weighed(out, work.beliefs.temperature)


def _sites(out: Sequence[Rival]) -> list[tuple[str, str | None]]:
    return [(alternative.site.effect, alternative.site.joint) for alternative in out]


def contenders(
    work: Workspace, rest: Fit, count: float, taken: Sequence[Effect], most: int = SHORTLIST
) -> tuple[list[Choice], list[tuple[Choice, Fit]]]:
    """
    Return how a library's units rank beside a fit, and those near the best, each fitted with it.

    Parameters
    ----------
    work : Workspace
        With the library asked.
    rest : Fit
        What each is added to.
    count : float
        Number of independent rows.
    taken : sequence of Effect
        Those in the model; they are no contenders.
    most : int
        Fitted at the most.

    """
    beliefs, sites = work.beliefs, {(e.name, e.site) for e in taken}
    systems = work.beside(rest.model, rest.residual)
    ranked = ranking(systems, work.library.units, count)
    choices = [c for c in ranked if c.unit.site not in sites and c.nats > 0.0]
    reach = max(beliefs.rival_nats, beliefs.rival_share * choices[0].nats) if choices else 0.0
    close = [c for c in choices if c.nats > choices[0].nats - reach][:most]
    tried = [(c, fitted_with(work, rest.model, c.effect())) for c in close]
    return ranked, [(c, other) for c, other in tried if not implausible(other.model)]


def weighed(out: Sequence[Rival], temperature: float) -> tuple[Rival, ...]:
    """Return rivals with probabilities that add up to one, most probable first."""
    log_bayes_factor = np.array([r.nats for r in out])
    weights = np.exp((log_bayes_factor - log_bayes_factor.max()) / temperature)
    weights /= weights.sum()
    reported = [replace(r, probability=float(w)) for r, w in zip(out, weights, strict=True)]
    return tuple(sorted(reported, key=lambda r: -r.probability))


@dataclass(frozen=True, eq=False)
class Place:
    """
    The place of an effect found, in which all that may stand there are weighed by one rule.

    Attributes
    ----------
    family : str
        Of the effect found.
    rest : Fit
        The fit without it.
    count : float
        Number of independent rows.

    """

    work: Workspace
    family: str
    rest: Fit
    count: float

    def nats(self, full: Fit, choice: Choice | None = None, unused: int = 0) -> float:
        """
        Return the evidence of a fit with something in this place.

        Parameters
        ----------
        full : Fit
            The fit with the effect, or with another in its place.
        choice : Choice or None
            The choice in its place, whose number of trials counts; none, and one is counted.
        unused : int
            Coordinates of what is in its place that buy nothing there, and cost nothing.

        """
        freedom = float(full.coordinates.size - self.rest.coordinates.size - unused)
        trials = 1.0
        if choice is not None:
            # Unused components of a vector effect buy nothing and cost nothing.
            freedom -= max(choice.unit.columns[choice.seed].size - choice.columns.size, 0)
            trials = max(choice.unit.trials, 1.0)
        before, after = (self.work.left(one, [self.family]) for one in (self.rest, full))
        return evidence(before, before - after, freedom, self.count) - float(np.log(trials))
